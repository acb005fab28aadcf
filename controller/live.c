// SPDX-License-Identifier: BSD-3-Clause
// Live: fixed rate against the clock. Three threads, handing newest values over by mailboxes:
//   rt     (FIFO 80) sleeps to its deadline, ticks, publishes on a connection of its own
//   LCM's  (FIFO 79) receive threads of the joint states, drained by `rx`
//   main   (normal)  obstacles and requests, scene announcements, signals
//
// Units    ns of CLOCK_MONOTONIC.
// Frames   see tick.h.
// Arrays   none.
// Memory   static, touched and locked before the loop starts.
// Errors   see control.h.
#include "controller/control.h"

#include "base/clock.h"    // lw_clock_*
#include "base/mailbox.h"  // lw_mailbox_*
#include "base/periodic.h" // lw_periodic_*
#include "base/stop.h"     // lw_stop_signal
#include "base/thread.h"   // lw_thread_*

#include <pthread.h>   // pthread_create
#include <stdatomic.h> // atomic_bool
#include <stdlib.h>    // EXIT_FAILURE

enum { POLL_MS = 50, RT_PRIORITY = 80, RX_PRIORITY = 79, PHASE_SAMPLES = 16 };

// A joint state and when it came.
struct arrival {
    struct lw_joint_state joint;
    int64_t arrival_ns;
};

struct live {
    struct lw_control *control;
    struct lw_bus *rt_bus, *rx_bus, *world_bus;
    struct lw_mailbox state_box, world_box, request_box;
    _Alignas(LW_CACHE_LINE) struct arrival state_slots[LW_MAILBOX_SLOTS];
    _Alignas(LW_CACHE_LINE) struct lw_world world_slots[LW_MAILBOX_SLOTS];
    _Alignas(LW_CACHE_LINE) struct lw_request request_slots[LW_MAILBOX_SLOTS];
    struct lw_world world;             // main's working copy
    struct lw_request_memory requests; // main: those put into the mailbox
    struct lw_stamp last_state;        // rx: newest joint state taken
    int64_t world_refused;             // main: changes that did not fit or were overtaken
    atomic_bool stopping;              // main -> rt: brake, then end
    atomic_bool abandoned;             // main -> rt: end now, a second signal came
    atomic_bool rt_done;               // rt -> main: at rest, or never moved
    atomic_int_fast64_t skipped;       // rt -> main
};

// --- receiving ---

// Takes a joint state that is newer than the last one; a new session starts afresh.
static void on_joint_state(void *user, enum lw_channel channel, const union lw_message *message)
{
    (void)channel;
    struct live *live = user;
    const struct lw_stamp *stamp = &message->joint_state.stamp;
    if (stamp->session == live->last_state.session && stamp->seq <= live->last_state.seq)
        return;
    live->last_state = *stamp;
    struct arrival *slot = lw_mailbox_slot(&live->state_box);
    *slot = (struct arrival){.joint = message->joint_state, .arrival_ns = lw_clock_mono_ns()};
    lw_mailbox_publish(&live->state_box);
}

static void on_obstacles(void *user, enum lw_channel channel, const union lw_message *message)
{
    (void)channel;
    struct live *live = user;
    if (lw_world_apply(&live->world, &message->obstacles) != LW_OK) {
        live->world_refused++;
        return;
    }
    struct lw_world *slot = lw_mailbox_slot(&live->world_box);
    *slot = live->world;
    lw_mailbox_publish(&live->world_box);
}

static void on_request(void *user, enum lw_channel channel, const union lw_message *message)
{
    (void)channel;
    struct live *live = user;
    // Repetitions stay out of the mailbox, where they could replace a newer request that no tick has taken yet.
    if (!lw_request_is_new(&live->requests, &message->request))
        return;
    struct lw_request *slot = lw_mailbox_slot(&live->request_box);
    *slot = message->request;
    lw_mailbox_publish(&live->request_box);
}

static void *rx_main(void *user)
{
    struct live *live = user;
    (void)lw_thread_set_priority(RX_PRIORITY);
    while (!atomic_load(&live->rt_done))
        if (!lw_bus_handle(live->rx_bus, POLL_MS))
            break;
    return NULL;
}

// --- the real-time thread ---

static const struct arrival *take_state(struct live *live)
{
    bool fresh = false;
    return lw_mailbox_take(&live->state_box, &fresh);
}

// Listens to the plant until its phase is known: the time, modulo its period, at which its messages come.
// False when asked to stop before that.
static bool find_phase(struct live *live, int64_t *phase_ns)
{
    struct lw_periodic loop = lw_periodic_start(lw_clock_mono_ns(), live->control->config.period_ns);
    for (int heard = 0; heard < PHASE_SAMPLES;) {
        if (atomic_load(&live->stopping))
            return false;
        (void)lw_periodic_wait(&loop);
        bool fresh = false;
        const struct arrival *state = lw_mailbox_take(&live->state_box, &fresh);
        if (!fresh)
            continue;
        const int64_t period_ns = state->joint.period_ns;
        *phase_ns = heard == 0 ? state->arrival_ns : lw_periodic_phase(*phase_ns, state->arrival_ns, period_ns);
        heard++;
    }
    return true;
}

static void tick(struct live *live, const struct lw_periodic *loop, union lw_message *message)
{
    bool fresh = false;
    const struct arrival *state = take_state(live);
    const struct lw_world *world = lw_mailbox_take(&live->world_box, &fresh);
    const struct lw_request *request = lw_mailbox_take(&live->request_box, &fresh);
    const struct lw_tick_input in = {.time_ns = loop->wake_ns,
                                     .state_age_ns = loop->wake_ns - state->arrival_ns,
                                     .joint = &state->joint,
                                     .world = world,
                                     .request = atomic_load(&live->stopping) ? &lw_request_shutdown : request};
    lw_tick(&live->control->config, &live->control->state, &in, &message->joint_command);
}

// Ticks until main asks to stop and the arm was braked.
static void control(struct live *live, int64_t phase_ns)
{
    // Half a plant period after the plant's message: both clocks are one host's, so the phase stays.
    const int64_t offset_ns = take_state(live)->joint.period_ns / 2;
    struct lw_periodic loop = lw_periodic_start(phase_ns + offset_ns, live->control->config.period_ns);
    lw_periodic_skip(&loop, lw_clock_mono_ns());
    loop.skipped = 0;
    int64_t exec_ns = 0;
    bool ended = false;
    while (!ended) {
        union lw_message message;
        const int64_t late_ns = lw_periodic_wait(&loop);
        tick(live, &loop, &message);
        message.joint_command.wake_late_ns = late_ns;
        message.joint_command.previous_exec_ns = exec_ns;
        message.joint_command.skipped = loop.skipped;
        // A lost command is the plant's timeout to handle; the next tick sends another.
        const bool sent = lw_bus_publish(live->rt_bus, LW_CHANNEL_JOINT_COMMAND, &message) == LW_OK;
        ended = atomic_load(&live->stopping) && (!sent || lw_controller_at_rest(&live->control->state));
        ended |= atomic_load(&live->abandoned);
        exec_ns = lw_clock_mono_ns() - loop.wake_ns;
        atomic_store(&live->skipped, loop.skipped);
    }
}

static void *rt_main(void *user)
{
    struct live *live = user;
    lw_thread_prefault_stack();
    (void)lw_thread_set_priority(RT_PRIORITY); // main has already said when the system refuses
    int64_t phase_ns = 0;
    if (find_phase(live, &phase_ns))
        control(live, phase_ns);
    atomic_store(&live->rt_done, true);
    return NULL;
}

// --- main ---

static enum lw_status subscribe(struct live *live)
{
    const struct lw_program *program = live->control->program;
    // LCM's read thread of the joint states inherits the priority of the thread that subscribes.
    lw_program_go_realtime(program, RX_PRIORITY);
    enum lw_status status = lw_program_subscribe(program, live->rx_bus, LW_CHANNEL_JOINT_STATE, on_joint_state, live);
    (void)lw_thread_set_priority(0);
    if (status == LW_OK)
        status = lw_program_subscribe(program, live->world_bus, LW_CHANNEL_OBSTACLES, on_obstacles, live);
    if (status == LW_OK)
        status = lw_program_subscribe(program, live->world_bus, LW_CHANNEL_GOAL, on_request, live);
    if (status == LW_OK)
        status = lw_program_subscribe(program, live->world_bus, LW_CHANNEL_STOP, on_request, live);
    return status;
}

// Obstacles, requests and signals, until the real-time thread is done. True when all went well.
static bool serve(struct live *live)
{
    bool ok = true;
    int64_t announce_ns = 0;
    while (!atomic_load(&live->rt_done)) {
        lw_program_announce(live->control->program, live->world_bus, &announce_ns);
        ok = ok && lw_bus_handle(live->world_bus, POLL_MS);
        if (lw_stop_signal() != 0 || !ok)
            atomic_store(&live->stopping, true);
        if (lw_stop_count() > 1)
            atomic_store(&live->abandoned, true);
    }
    return ok;
}

static int run_threads(struct live *live)
{
    const struct lw_program *program = live->control->program;
    pthread_t rt, rx;
    if (!lw_program_thread(program, &rx, rx_main, live))
        return EXIT_FAILURE;
    bool ok = lw_program_thread(program, &rt, rt_main, live);
    if (ok) {
        lw_program_say(program, "ready, %g Hz", program->scene.rate_hz);
        ok = serve(live);
        pthread_join(rt, NULL);
    }
    atomic_store(&live->rt_done, true);
    pthread_join(rx, NULL);
    const int64_t refused = lw_bus_refused(live->rx_bus) + lw_bus_refused(live->world_bus) + live->world_refused;
    lw_program_say(program, "%lld ticks, %lld periods skipped, %lld messages refused",
                   (long long)live->control->state.tick, (long long)atomic_load(&live->skipped), (long long)refused);
    return ok ? lw_stop_exit_status() : EXIT_FAILURE;
}

int lw_control_live(struct lw_control *control)
{
    static struct live live;
    live.control = control;
    lw_mailbox_init(&live.state_box, live.state_slots, sizeof live.state_slots[0]);
    lw_mailbox_init(&live.world_box, live.world_slots, sizeof live.world_slots[0]);
    lw_mailbox_init(&live.request_box, live.request_slots, sizeof live.request_slots[0]);
    int status = EXIT_FAILURE;
    if (lw_program_open(control->program, &live.rt_bus) == LW_OK &&
        lw_program_open(control->program, &live.rx_bus) == LW_OK &&
        lw_program_open(control->program, &live.world_bus) == LW_OK && subscribe(&live) == LW_OK)
        status = run_threads(&live);
    lw_bus_close(live.world_bus);
    lw_bus_close(live.rx_bus);
    lw_bus_close(live.rt_bus);
    return status;
}
