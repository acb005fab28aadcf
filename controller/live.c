// SPDX-License-Identifier: BSD-3-Clause
// Live: starts the threads in their order, tells the world how they fare, and ends them.
//
// Units    see live.h.
// Frames   see tick.h.
// Arrays   none.
// Memory   static.
// Errors   see control.h.
#include "controller/live.h"

#include "base/clock.h"    // lw_clock_mono_ns
#include "base/periodic.h" // lw_periodic_*
#include "base/stop.h"     // lw_stop_signal

#include <math.h>   // isfinite
#include <stdlib.h> // EXIT_FAILURE

static const int64_t report_period_ns = LW_NS_PER_S / 20;

static enum lw_run_state run_state(const struct lw_live *live, const struct lw_joint_command *command)
{
    if (atomic_load(&live->stopping))
        return LW_ENDING;
    if (command->flags & LW_WARMING_UP)
        return LW_STARTING;
    if (command->flags & LW_WAITING)
        return LW_RUN_WAITING;
    return command->flags & (LW_STOPPED | LW_STALE | LW_NOT_FINITE | LW_FOREIGN | LW_CONTACT) ? LW_STOPPING
                                                                                              : LW_RUNNING;
}

// Statistics and STATUS, once.
static void report(struct lw_live *live, int64_t now_ns)
{
    struct lw_program *program = live->control->program;
    const struct lw_record *newest = lw_health_collect(&live->health);
    if (newest == NULL)
        return;
    const struct lw_joint_command *command = &newest->command;
    const int64_t heard_ns = atomic_load(&live->world_heard_ns);
    struct lw_report report = {.state = run_state(live, command),
                               .clearance = command->nearest.clearance,
                               .deviation = isfinite(command->deviation) ? command->deviation : 0,
                               .stuck_since_ns = command->stuck_since_ns,
                               .obstacle_count = command->obstacle_count,
                               .world_age_ns = heard_ns > 0 ? newest->time_ns - heard_ns : -1};
    lw_program_report(program, live->status_bus, &live->health, &report);
    if (program->postmortem != NULL)
        lw_postmortem_watch(&live->postmortem, program, live->status_bus, &live->health, &live->heard, now_ns);
}

// Reports, announcements and signals, until the real-time thread is done. True when all went well.
static bool serve(struct lw_live *live)
{
    int64_t announce_ns = 0;
    struct lw_periodic loop = lw_periodic_start(lw_clock_mono_ns(), report_period_ns);
    while (!atomic_load(&live->rt_done)) {
        lw_program_announce(live->control->program, live->status_bus, &announce_ns);
        (void)lw_periodic_wait(&loop);
        report(live, lw_clock_mono_ns());
        if (lw_stop_signal() != 0 || atomic_load(&live->bus_failed))
            atomic_store(&live->stopping, true);
        if (lw_stop_count() > 1)
            atomic_store(&live->abandoned, true);
    }
    report(live, INT64_MAX);
    return !atomic_load(&live->bus_failed);
}

// Starts the threads, the real-time one last, and waits for their end.
static int run_threads(struct lw_live *live)
{
    static void *(*const run[])(void *) = {lw_live_receive, lw_live_world, lw_live_realtime};
    enum { THREADS = sizeof run / sizeof run[0] };
    const struct lw_program *program = live->control->program;
    pthread_t thread[THREADS];
    int started = 0;
    while (started < THREADS && lw_program_thread(program, &thread[started], run[started], live))
        started++;
    bool ok = started == THREADS;
    if (ok) {
        lw_program_say(program, "ready, %g Hz", program->scene.rate_hz);
        ok = serve(live);
    }
    atomic_store(&live->rt_done, true);
    for (int i = 0; i < started; i++)
        pthread_join(thread[i], NULL);
    const struct lw_record *newest = lw_health_past(&live->health, 0);
    lw_program_say(program, "%lld ticks, %lld periods skipped, %lld messages refused",
                   (long long)live->control->state.tick, newest != NULL ? (long long)newest->skipped : 0LL,
                   (long long)lw_refusals_total(&program->refusals));
    ok &= lw_program_write_histogram(program, &live->health);
    return ok ? lw_stop_exit_status() : EXIT_FAILURE;
}

static bool open_all(struct lw_live *live)
{
    struct lw_bus **const bus[] = {&live->rt_bus, &live->world_bus, &live->status_bus};
    for (size_t i = 0; i < sizeof bus / sizeof bus[0]; i++)
        if (lw_program_open(live->control->program, bus[i]) != LW_OK)
            return false;
    return lw_program_open_stream(live->control->program, &live->rx_bus) == LW_OK &&
           lw_program_open_stream(live->control->program, &live->world_rx_bus) == LW_OK &&
           lw_live_subscribe(live) == LW_OK;
}

int lw_control_live(struct lw_control *control)
{
    static struct lw_live live;
    live.control = control;
    lw_mailbox_init(&live.state_box, live.state_slots, sizeof live.state_slots[0]);
    lw_mailbox_init(&live.world_box, live.world_slots, sizeof live.world_slots[0]);
    lw_mailbox_init(&live.request_box, live.request_slots, sizeof live.request_slots[0]);
    lw_heard_init(&live.heard);
    if (!lw_program_go_realtime(control->program))
        return EXIT_FAILURE;
    int status = EXIT_FAILURE;
    if (!lw_health_init(&live.health, control->config.period_ns))
        lw_program_fail(control->program, "out of memory");
    else if (open_all(&live))
        status = run_threads(&live);
    lw_health_free(&live.health);
    lw_bus_close(live.status_bus);
    lw_bus_close(live.world_bus);
    lw_bus_close(live.world_rx_bus);
    lw_bus_close(live.rx_bus);
    lw_bus_close(live.rt_bus);
    return status;
}
