// SPDX-License-Identifier: BSD-3-Clause
// Lockstep: one plant step, then wait for the controller's answer to it. What gets lost is sent again, so a scene
// always gives the same result, as fast as the machine allows.
//
// Units    ns; motion time for the plant, CLOCK_MONOTONIC for waiting.
// Frames   see plant.h.
// Arrays   none.
// Memory   static, lives as long as the process.
// Errors   see simulation.h.
#include "simulator/simulation.h"

#include "base/clock.h"    // lw_clock_mono_ns
#include "base/periodic.h" // lw_periodic_*
#include "base/stop.h"     // lw_stop_signal

enum { RESEND_MS = 100 };
static const int64_t resend_ns = RESEND_MS * INT64_C(1000000);
static const int64_t patience_ns = 5 * LW_NS_PER_S; // for an answer, once there was a first one

struct lockstep {
    struct lw_simulation *simulation;
    struct lw_bus *bus;
    struct lw_gate gate;
    struct lw_lease lease;
    struct lw_sensor sensor;
    struct lw_told told;         // of the newest sample
    bool echoed;                 // the message told last
    struct lw_joint_state state; // published last
    bool answered;               // the state published last, by one who knows the whole sample
    bool started;                // a first answer came
    int64_t wanted_since;        // CLOCK_MONOTONIC when the state was published first
};

// Whether an answer was computed with the message told last.
static bool is_echo(const struct lockstep *l, const struct lw_joint_command *command)
{
    return command->world.session == l->simulation->plant.session && command->world_channel == (int)l->told.channel &&
           command->world.seq == l->told.seq;
}

// Takes the answer to the state published last, once the whole sample was told.
static void on_command(void *user, enum lw_channel channel, const union lw_message *message)
{
    (void)channel;
    struct lockstep *l = user;
    struct lw_simulation *s = l->simulation;
    const struct lw_joint_command *command = &message->joint_command;
    if (l->answered || command->state_tick != s->arm.tick)
        return;
    l->echoed |= is_echo(l, command);
    if (!l->echoed || !l->told.all)
        return;
    const enum lw_verdict verdict = lw_gate_judge(&l->gate, &l->lease, command, l->state.stamp.seq, lw_clock_mono_ns());
    l->answered = lw_refusals_note(&s->program->refusals, verdict);
    if (l->answered)
        lw_plant_obey(&s->arm, command, s->arm.tick * s->plant.period_ns);
    l->started |= l->answered;
}

// Publishes the next message of the sample, if there is one, and the state. One message at a time: an answer says what
// came last, and so whether it came.
static enum lw_status publish(struct lockstep *l)
{
    const struct lw_simulation *s = l->simulation;
    enum lw_status status = LW_OK;
    if (!l->told.all) {
        status = lw_simulation_tell(&l->sensor, s->arm.tick * s->plant.period_ns, 1, l->bus, &l->told);
        l->echoed = false;
    }
    return status == LW_OK ? lw_simulation_publish_state(s, l->bus, &l->state) : status;
}

// Publishes what the sensor sees and the state until it is answered. False when stopped or given up.
static bool ask(struct lockstep *l)
{
    const struct lw_program *program = l->simulation->program;
    if (lw_sensor_look(&l->sensor, l->simulation->arm.tick * l->simulation->plant.period_ns))
        l->told = (struct lw_told){0};
    l->answered = false;
    l->wanted_since = lw_clock_mono_ns();
    int64_t publish_ns = l->wanted_since;
    while (!l->answered && lw_stop_signal() == 0) {
        const int64_t now_ns = lw_clock_mono_ns();
        if (l->started && now_ns - l->wanted_since > patience_ns) {
            lw_program_fail(program, "no answer from the controller for 5 s at t = %.3f s",
                            (double)l->simulation->arm.tick * l->simulation->plant.period_s);
            return false;
        }
        // Again, and from the start, only after a while: other messages than the answer end the wait, too.
        const bool again = now_ns >= publish_ns && publish_ns > l->wanted_since;
        if (again)
            l->told = (struct lw_told){0};
        const bool due = now_ns >= publish_ns || (l->echoed && !l->told.all);
        if (due)
            publish_ns = now_ns + resend_ns;
        if ((due && publish(l) != LW_OK) || !lw_bus_handle(l->bus, RESEND_MS)) {
            lw_program_fail(program, "the bus failed");
            return false;
        }
    }
    return l->answered;
}

// One controller period: ask, then step the plant; states in between are published for the log alone.
static bool step(struct lockstep *l)
{
    struct lw_simulation *s = l->simulation;
    const int ratio = lw_scene_plant_ratio(&s->program->scene);
    if (!ask(l))
        return false;
    if (s->arm.tick >= s->last_tick)
        return true;
    for (int i = 0; i < ratio; i++) {
        lw_plant_step(&s->plant, &s->arm, s->arm.tick * s->plant.period_ns);
        if (i < ratio - 1 && lw_simulation_publish_state(s, l->bus, &l->state) != LW_OK) {
            lw_program_fail(s->program, "the bus failed");
            return false;
        }
    }
    return true;
}

// Asked to stop in mid-motion: ramps to rest by itself, as when commands cease. The state now may not be known to
// anybody yet, even when it is one of rest.
static void come_to_rest(struct lockstep *l)
{
    struct lw_simulation *s = l->simulation;
    lw_plant_stop(&s->arm);
    while (lw_simulation_publish_state(s, l->bus, &l->state) == LW_OK && !lw_plant_at_rest(&s->arm))
        lw_plant_step(&s->plant, &s->arm, s->arm.tick * s->plant.period_ns);
}

int lw_simulation_lockstep(struct lw_simulation *simulation)
{
    static struct lockstep lockstep;
    struct lw_program *program = simulation->program;
    lockstep.simulation = simulation;
    // The plant waits for its answer, however late: neither age nor start-up matter.
    lockstep.gate = lw_simulation_gate(simulation);
    lockstep.gate.open_ns = 0;
    lockstep.gate.max_lag = INT64_MAX;
    lw_sensor_init(&lockstep.sensor, &program->scene);
    if (lw_program_open(program, &lockstep.bus) != LW_OK)
        return 1;
    bool ok = lw_program_subscribe(program, lockstep.bus, LW_CHANNEL_JOINT_COMMAND, on_command, &lockstep) == LW_OK;
    if (ok)
        lw_program_say(program, "waiting for leeway-controller --lockstep %s", program->path);
    const int64_t pace_ns = (lw_scene_plant_ratio(&program->scene) + 1) * LW_NS_PER_S / program->pace;
    struct lw_periodic pace = lw_periodic_start(lw_clock_mono_ns(), pace_ns);
    int64_t announce_ns = 0;
    bool done = false;
    while (ok && !done) {
        done = simulation->arm.tick >= simulation->last_tick;
        lw_program_announce(program, lockstep.bus, &announce_ns);
        ok = step(&lockstep);
        (void)lw_periodic_wait(&pace);
    }
    if (ok)
        lw_program_say(program, "done, %.3f s of motion", (double)simulation->arm.tick * simulation->plant.period_s);
    if (lw_stop_signal() != 0)
        come_to_rest(&lockstep);
    lw_bus_close(lockstep.bus);
    return ok || lw_stop_signal() != 0 ? lw_stop_exit_status() : 1;
}
