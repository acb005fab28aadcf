// SPDX-License-Identifier: BSD-3-Clause
// Live: the plant at its own fixed rate. Three threads, handing newest values over by a mailbox:
//   rt    (FIFO 80) sleeps to its deadline, steps the plant, publishes the state on a connection of its own
//   LCM's (FIFO 79) receive threads of the commands, drained by `rx`
//   main  (normal)  obstacles at 10 Hz as a sensor would, scene announcements, words for people, signals
//
// Units    ns of CLOCK_MONOTONIC.
// Frames   see plant.h.
// Arrays   none.
// Memory   static, touched and locked before the loop starts.
// Errors   see simulation.h.
#include "simulator/simulation.h"

#include "base/clock.h"    // lw_clock_mono_ns
#include "base/mailbox.h"  // lw_mailbox_*
#include "base/periodic.h" // lw_periodic_*
#include "base/stop.h"     // lw_stop_signal
#include "base/thread.h"   // lw_thread_*

#include <stdatomic.h> // atomic_bool
#include <stdlib.h>    // EXIT_FAILURE

enum { RT_PRIORITY = 80, RX_PRIORITY = 79, POLL_MS = 50, OBSTACLE_POLLS = 2 };

struct live {
    struct lw_simulation *simulation;
    struct lw_bus *rt_bus, *rx_bus, *sensor_bus;
    struct lw_mailbox command_box;
    _Alignas(LW_CACHE_LINE) struct lw_joint_command command_slots[LW_MAILBOX_SLOTS];
    atomic_bool stopping;             // main -> rt: ramp to rest, then end
    atomic_bool rt_done;              // rt -> main, rx
    atomic_int mode;                  // rt -> main: enum lw_plant_mode
    atomic_int_fast64_t tick;         // rt -> main
    atomic_int_fast64_t timeouts;     // rt -> main: times that commands ceased
    atomic_int_fast64_t timeout_tick; // rt -> main: when they did last
    atomic_int_fast64_t skipped;      // rt -> main
    atomic_int_fast64_t unsent;       // rt -> main: states the system refused to send
};

// --- receiving ---

static void on_command(void *user, enum lw_channel channel, const union lw_message *message)
{
    (void)channel;
    struct live *live = user;
    struct lw_joint_command *slot = lw_mailbox_slot(&live->command_box);
    *slot = message->joint_command;
    lw_mailbox_publish(&live->command_box);
}

static void *rx_main(void *user)
{
    struct live *live = user;
    (void)lw_thread_set_priority(RX_PRIORITY); // main has already said when the system refuses
    while (!atomic_load(&live->rt_done))
        if (!lw_bus_handle(live->rx_bus, POLL_MS))
            break;
    return NULL;
}

// --- the real-time thread ---

// Takes the newest command, or ramps to rest when the program is to stop.
static void obey(struct live *live, int64_t now_ns)
{
    struct lw_simulation *s = live->simulation;
    bool fresh = false;
    const struct lw_joint_command *command = lw_mailbox_take(&live->command_box, &fresh);
    if (atomic_load(&live->stopping))
        lw_plant_stop(&s->arm);
    else if (fresh)
        (void)lw_plant_accept(&s->plant, &s->arm, command, now_ns);
}

// Tells main what changed, without ever waiting for it.
static void tell(struct live *live, enum lw_plant_mode before, int64_t skipped)
{
    const struct lw_plant_state *arm = &live->simulation->arm;
    if (before == LW_PLANT_MOVING && arm->mode == LW_PLANT_STOPPING) {
        atomic_store(&live->timeout_tick, arm->tick);
        atomic_fetch_add(&live->timeouts, 1);
    }
    atomic_store(&live->mode, (int)arm->mode);
    atomic_store(&live->tick, arm->tick);
    atomic_store(&live->skipped, skipped);
}

static void step(struct live *live, const struct lw_periodic *loop)
{
    struct lw_simulation *s = live->simulation;
    obey(live, loop->wake_ns);
    const enum lw_plant_mode before = s->arm.mode;
    lw_plant_step(&s->plant, &s->arm, loop->wake_ns);
    if (lw_simulation_publish_state(s, live->rt_bus) != LW_OK)
        atomic_fetch_add(&live->unsent, 1);
    tell(live, before, loop->skipped);
}

static void *rt_main(void *user)
{
    struct live *live = user;
    struct lw_simulation *s = live->simulation;
    lw_thread_prefault_stack();
    (void)lw_thread_set_priority(RT_PRIORITY);

    // When done, wait out one controller period so that the last state is answered too.
    int periods_left = lw_scene_plant_ratio(&s->program->scene) + 1;
    struct lw_periodic loop = lw_periodic_start(lw_clock_mono_ns() + s->plant.period_ns, s->plant.period_ns);
    while (periods_left > 0) {
        (void)lw_periodic_wait(&loop);
        const bool done = s->program->until_done && s->arm.tick >= s->last_tick;
        if (!done)
            step(live, &loop);
        periods_left -= done;
        if (atomic_load(&live->stopping) && lw_plant_at_rest(&s->arm))
            periods_left = 0;
    }
    atomic_store(&live->rt_done, true);
    return NULL;
}

// --- main ---

static enum lw_status subscribe(struct live *live)
{
    const struct lw_program *program = live->simulation->program;
    // LCM's read thread of the commands inherits the priority of the thread that subscribes.
    lw_program_go_realtime(program, RX_PRIORITY);
    const enum lw_status status =
        lw_program_subscribe(program, live->rx_bus, LW_CHANNEL_JOINT_COMMAND, on_command, live);
    (void)lw_thread_set_priority(0);
    return status;
}

// Says when commands cease, and when they come again.
static void say_mode(const struct live *live, int64_t *timeouts, bool *stopped)
{
    const struct lw_simulation *s = live->simulation;
    const int64_t now = atomic_load(&live->timeouts);
    if (now != *timeouts)
        lw_program_say(s->program, "no command for %g ms at t = %.3f s: ramping to rest",
                       s->program->scene.plant.timeout_s * 1e3,
                       (double)atomic_load(&live->timeout_tick) * s->plant.period_s);
    else if (*stopped && atomic_load(&live->mode) == LW_PLANT_MOVING)
        lw_program_say(s->program, "commands again at t = %.3f s",
                       (double)atomic_load(&live->tick) * s->plant.period_s);
    *timeouts = now;
    *stopped = atomic_load(&live->mode) == LW_PLANT_STOPPING;
}

// Sensor and words, until the real-time thread is done.
static void serve(struct live *live)
{
    const struct lw_program *program = live->simulation->program;
    struct lw_periodic loop = lw_periodic_start(lw_clock_mono_ns(), POLL_MS * INT64_C(1000000));
    int64_t timeouts = 0, announce_ns = 0;
    bool stopped = false;
    for (int poll = 0; !atomic_load(&live->rt_done); poll++) {
        lw_program_announce(program, live->sensor_bus, &announce_ns);
        if (poll % OBSTACLE_POLLS == 0 && lw_simulation_publish_obstacles(live->simulation, live->sensor_bus) != LW_OK)
            lw_program_say(program, "OBSTACLES could not be sent");
        (void)lw_periodic_wait(&loop);
        say_mode(live, &timeouts, &stopped);
        if (lw_stop_signal() != 0)
            atomic_store(&live->stopping, true);
    }
}

static int run_threads(struct live *live)
{
    const struct lw_simulation *s = live->simulation;
    pthread_t rt, rx;
    if (!lw_program_thread(s->program, &rx, rx_main, live))
        return EXIT_FAILURE;
    const bool ok = lw_program_thread(s->program, &rt, rt_main, live);
    if (ok) {
        lw_program_say(s->program, "ready, %g Hz", s->program->scene.plant.rate_hz);
        serve(live);
        pthread_join(rt, NULL);
    }
    atomic_store(&live->rt_done, true);
    pthread_join(rx, NULL);
    lw_program_say(s->program, "%.3f s of motion, %lld periods skipped, %lld states not sent, %lld messages refused",
                   (double)s->arm.tick * s->plant.period_s, (long long)atomic_load(&live->skipped),
                   (long long)atomic_load(&live->unsent), (long long)lw_bus_refused(live->rx_bus));
    return ok ? lw_stop_exit_status() : EXIT_FAILURE;
}

int lw_simulation_live(struct lw_simulation *simulation)
{
    static struct live live;
    live.simulation = simulation;
    lw_mailbox_init(&live.command_box, live.command_slots, sizeof live.command_slots[0]);
    int status = EXIT_FAILURE;
    if (lw_program_open(simulation->program, &live.rt_bus) == LW_OK &&
        lw_program_open(simulation->program, &live.rx_bus) == LW_OK &&
        lw_program_open(simulation->program, &live.sensor_bus) == LW_OK && subscribe(&live) == LW_OK)
        status = run_threads(&live);
    lw_bus_close(live.sensor_bus);
    lw_bus_close(live.rx_bus);
    lw_bus_close(live.rt_bus);
    return status;
}
