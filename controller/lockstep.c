// SPDX-License-Identifier: BSD-3-Clause
// Lockstep: the controller answers every joint state of its rate with one command and waits for the next.
// One thread and one connection, so that messages are handled in the order in which they were sent.
//
// Units    ns of motion time.
// Frames   see tick.h.
// Arrays   none.
// Memory   static, lives as long as the process.
// Errors   see control.h.
#include "controller/control.h"

#include "base/clock.h"      // lw_clock_mono_ns
#include "collision/world.h" // lw_world_apply
#include "base/stop.h"       // lw_stop_signal

enum { POLL_MS = 100 };
static const int64_t quiet_ns = 300 * 1000 * 1000; // without a state for this long, no plant waits for us

struct lockstep {
    struct lw_control *control;
    struct lw_bus *bus;
    struct lw_world world;
    struct lw_snapshot seen; // the world as the tick sees it
    bool changed;            // it is not the world any more
    bool failed;
    struct lw_request request;
    struct lw_request_memory requests; // those put into `request`
    struct lw_controller_state before; // the last tick
    union lw_message command;          // last one sent
    int64_t plant_session;             // of the state it answers
    int64_t plant_tick;
};

// Every obstacle was checked when it came: a world that cannot be shown is none to go on with.
static void look(struct lockstep *l)
{
    const enum lw_status status = l->changed ? lw_world_build(&l->world, &l->seen) : LW_OK;
    if (status != LW_OK)
        lw_program_fail(l->control->program, "obstacles: %s", lw_status_text(status));
    l->failed |= status != LW_OK;
    l->changed = false;
}

static void tick(struct lockstep *l, const struct lw_joint_state *joint)
{
    look(l);
    const struct lw_tick_input in = {
        .time_ns = joint->tick * joint->period_ns, .joint = joint, .world = &l->seen, .request = &l->request};
    l->before = l->control->state;
    lw_tick(&l->control->config, &l->control->state, &in, &l->command.joint_command);
    l->plant_session = joint->stamp.session;
    l->plant_tick = joint->tick;
}

// Whether the last command was computed with the newest message about obstacles.
static bool knows_world(const struct lockstep *l)
{
    const struct lw_joint_command *command = &l->command.joint_command;
    return command->world.session == l->world.last.session && command->world.seq == l->world.last.seq &&
           command->world_channel == l->world.last_channel;
}

// A state that comes again was sent again because its answer got lost: it gets the same answer. When obstacles came
// in between, which had got lost or were not yet all told, its tick is taken back and done with them.
static void on_joint_state(struct lockstep *l, const struct lw_joint_state *joint)
{
    if (joint->tick % lw_scene_plant_ratio(&l->control->program->scene) != 0)
        return;
    const bool answered = joint->stamp.session == l->plant_session && joint->tick == l->plant_tick &&
                          l->command.joint_command.mode == LW_COMMAND_VELOCITY;
    if (answered && !knows_world(l))
        l->control->state = l->before;
    if (!answered || !knows_world(l))
        tick(l, joint);
    if (lw_bus_publish(l->bus, LW_CHANNEL_JOINT_COMMAND, &l->command) != LW_OK)
        lw_program_say(l->control->program, "a command could not be sent; the plant asks again");
}

static void on_obstacles(struct lockstep *l, const struct lw_obstacle_change *change)
{
    const enum lw_status status = lw_world_apply(&l->world, change);
    l->changed |= lw_refusals_note(&l->control->program->refusals, lw_verdict_of(status));
}

static void on_message(void *user, enum lw_channel channel, const union lw_message *message)
{
    struct lockstep *l = user;
    if (channel == LW_CHANNEL_JOINT_STATE)
        on_joint_state(l, &message->joint_state);
    else if (channel == LW_CHANNEL_OBSTACLES || channel == LW_CHANNEL_HULL)
        on_obstacles(l, &message->obstacles);
    else if (lw_request_is_new(&l->requests, &message->request)) // a repetition must not replace one not ticked yet
        l->request = message->request;
}

static enum lw_status subscribe(struct lockstep *l)
{
    // States last: who asks for an answer has told of the obstacles before.
    static const enum lw_channel channels[] = {LW_CHANNEL_OBSTACLES, LW_CHANNEL_HULL, LW_CHANNEL_GOAL, LW_CHANNEL_STOP,
                                               LW_CHANNEL_JOINT_STATE};
    enum lw_status status = LW_OK;
    for (size_t i = 0; status == LW_OK && i < sizeof channels / sizeof channels[0]; i++)
        status = lw_program_subscribe(l->control->program, l->bus, channels[i], on_message, l);
    return status;
}

// Whether the program may end: it was asked to, and the arm is at rest, or no plant asks any more.
static bool may_end(const struct lockstep *l, int64_t *heard_ns, int64_t *last_tick)
{
    const struct lw_controller_state *state = &l->control->state;
    const int64_t now_ns = lw_clock_mono_ns();
    if (lw_stop_signal() == 0 || state->tick != *last_tick)
        *heard_ns = now_ns;
    *last_tick = state->tick;
    const bool stopped = state->request.kind == LW_REQUEST_STOP && lw_controller_at_rest(state);
    const bool quiet = now_ns - *heard_ns > quiet_ns;
    return lw_stop_signal() != 0 && (stopped || quiet || lw_stop_count() > 1);
}

// Answers states until asked to stop and the arm was braked. False when something failed.
static bool serve(struct lockstep *l)
{
    int64_t announce_ns = 0, heard_ns = 0, last_tick = 0;
    while (!may_end(l, &heard_ns, &last_tick)) {
        if (lw_stop_signal() != 0)
            l->request = lw_request_shutdown;
        lw_program_announce(l->control->program, l->bus, &announce_ns);
        const bool ok = lw_bus_handle(l->bus, POLL_MS);
        if (!ok)
            lw_program_fail(l->control->program, "the bus failed");
        if (!ok || l->failed)
            return false;
    }
    return true;
}

int lw_control_lockstep(struct lw_control *control)
{
    static struct lockstep lockstep;
    lockstep.control = control;
    if (lw_program_open(control->program, &lockstep.bus) != LW_OK)
        return 1;
    if (subscribe(&lockstep) != LW_OK) {
        lw_bus_close(lockstep.bus);
        return 1;
    }
    lw_program_say(control->program, "ready, in lockstep");
    const bool ok = serve(&lockstep);
    lw_program_say(control->program, "%lld ticks, %lld messages refused", (long long)control->state.tick,
                   (long long)lw_refusals_total(&control->program->refusals));
    lw_bus_close(lockstep.bus);
    return ok ? lw_stop_exit_status() : 1;
}
