// SPDX-License-Identifier: BSD-3-Clause
// Live: the plant at its own fixed rate. Threads hand over by a mailbox and a ring; nothing else is shared:
//   rt     (FIFO P)    sleeps to its deadline, steps the plant, publishes the state on a connection of its own
//   rx     (FIFO P-1)  commands, judged by the gate
//   sensor (normal)    obstacles as a perception source tells them, at the time of motion of the newest step
//   main   (normal)    statistics, PLANT_STATUS and SCENE, words for people, signals
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

#include <math.h>      // HUGE_VAL
#include <stdatomic.h> // atomic_bool
#include <stdlib.h>    // EXIT_FAILURE

enum { POLL_MS = 50 };
static const int64_t poll_ns = POLL_MS * INT64_C(1000000);
static const int64_t tell_pause_ns = 1000 * 1000;
enum { TELL_MAX = 16 }; // messages before a pause: a receive buffer of Linux's default size holds 90
static const int64_t report_period_ns = LW_NS_PER_S / 20;
static const int64_t warm_up_ns = LW_NS_PER_S / 2;

// A command that was taken, when, and what had become of the stream then.
struct arrival {
    struct lw_joint_command command;
    int64_t arrival_ns;
    struct lw_lease lease;
};

// A step of the plant, and when it was.
struct moment {
    int64_t tick;
    int64_t time_ns;
};

struct live {
    struct lw_simulation *simulation;
    struct lw_bus *rt_bus, *rx_bus, *main_bus;
    struct lw_mailbox command_box; // rx -> rt: struct arrival
    _Alignas(LW_CACHE_LINE) struct arrival command_slots[LW_MAILBOX_SLOTS];
    struct lw_mailbox moment_box; // rt -> sensor: struct moment
    _Alignas(LW_CACHE_LINE) struct moment moment_slots[LW_MAILBOX_SLOTS];
    struct lw_sensor sensor;       // sensor
    struct lw_health health;       // rt -> main
    struct lw_gate gate;           // rt -> rx: set before the first state
    struct lw_lease lease;         // rx
    atomic_int_fast64_t state_seq; // rt -> rx: newest state published, or just being published
    atomic_bool stopping;          // main -> rt: ramp to rest, then end
    atomic_bool abandoned;         // main -> rt: end now, a second signal came
    atomic_bool rt_done;           // rt -> all
    atomic_bool bus_failed;        // rx -> main
};

// --- receiving ---

static void on_command(void *user, enum lw_channel channel, const union lw_message *message)
{
    (void)channel;
    struct live *live = user;
    const int64_t now_ns = lw_clock_mono_ns(), state_seq = atomic_load(&live->state_seq);
    const enum lw_verdict verdict =
        state_seq == 0 ? LW_REFUSED_GUARD
                       : lw_gate_judge(&live->gate, &live->lease, &message->joint_command, state_seq, now_ns);
    if (!lw_refusals_note(&live->simulation->program->refusals, verdict))
        return;
    struct arrival *slot = lw_mailbox_slot(&live->command_box);
    *slot = (struct arrival){.command = message->joint_command, .arrival_ns = now_ns, .lease = live->lease};
    lw_mailbox_publish(&live->command_box);
}

static void *receive(void *user)
{
    struct live *live = user;
    lw_program_realtime_thread(live->simulation->program, 1);
    while (!atomic_load(&live->rt_done) && !atomic_load(&live->bus_failed))
        if (!lw_bus_handle(live->rx_bus, POLL_MS))
            atomic_store(&live->bus_failed, true);
    return NULL;
}

// --- the real-time thread ---

struct loop {
    struct live *live;
    struct lw_periodic periodic;
    int64_t start_ns;
    struct lw_record record;
};

// Takes the newest command, or ramps to rest when the program is to stop.
static void obey(struct loop *loop)
{
    struct live *live = loop->live;
    struct lw_record *record = &loop->record;
    struct lw_plant_state *arm = &live->simulation->arm;
    const struct arrival *arrival = lw_mailbox_take(&live->command_box, &record->fresh);
    record->expected = arm->mode == LW_PLANT_MOVING;
    record->age_ns = record->expected ? record->time_ns - arrival->arrival_ns : 0;
    record->lease = arrival->lease;
    record->command = arrival->command;
    if (atomic_load(&live->stopping))
        lw_plant_stop(arm);
    else if (record->fresh)
        lw_plant_obey(arm, &arrival->command, arrival->arrival_ns);
}

// Publishes the state and hands over the account of this period.
static void publish(struct loop *loop)
{
    struct live *live = loop->live;
    struct lw_record *record = &loop->record;
    // Counted first: the answer may be here before this thread returns from sending.
    atomic_fetch_add(&live->state_seq, 1);
    record->sent = lw_simulation_publish_state(live->simulation, live->rt_bus, &record->state) == LW_OK;
    record->skipped = loop->periodic.skipped;
    const bool silence = record->state.mode == LW_PLANT_STOPPING && !atomic_load(&live->stopping);
    record->faults = silence ? LW_FAULT_PEER_TIMEOUT : 0;
    record->exec_ns = lw_clock_mono_ns() - record->time_ns;
    lw_health_note(&live->health, record);
}

static void step(struct loop *loop)
{
    struct lw_simulation *s = loop->live->simulation;
    loop->record.time_ns = loop->periodic.wake_ns;
    loop->record.warm = loop->record.time_ns - loop->start_ns > warm_up_ns;
    obey(loop);
    lw_plant_step(&s->plant, &s->arm, loop->record.time_ns);
    struct moment *moment = lw_mailbox_slot(&loop->live->moment_box);
    *moment = (struct moment){.tick = s->arm.tick, .time_ns = loop->record.time_ns};
    lw_mailbox_publish(&loop->live->moment_box);
    publish(loop);
}

static void *run_plant(void *user)
{
    static struct loop loop;
    struct live *live = user;
    struct lw_simulation *s = live->simulation;
    lw_program_realtime_thread(s->program, 0);
    loop.live = live;
    loop.start_ns = lw_clock_mono_ns();
    // Now, not when the set-up began: that may have taken longer than the gate stays shut.
    live->gate = lw_simulation_gate(s);
    loop.periodic = lw_periodic_start(loop.start_ns + s->plant.period_ns, s->plant.period_ns);

    // When done, wait out one controller period so that the last state is answered too.
    int periods_left = lw_scene_plant_ratio(&s->program->scene) + 1;
    while (periods_left > 0) {
        loop.record.wake_late_ns = lw_periodic_wait(&loop.periodic);
        const bool done = s->program->until_done && s->arm.tick >= s->last_tick;
        if (!done)
            step(&loop);
        periods_left -= done;
        if (atomic_load(&live->stopping) && (lw_plant_at_rest(&s->arm) || atomic_load(&live->abandoned)))
            periods_left = 0;
    }
    // Tells the controller that no more states will come. Nobody answers, and this is no work of the last period.
    s->arm.mode = LW_PLANT_ENDED;
    loop.record.time_ns = lw_clock_mono_ns();
    loop.record.expected = false;
    loop.record.age_ns = 0;
    publish(&loop);
    lw_health_end(&live->health);
    atomic_store(&live->rt_done, true);
    return NULL;
}

// --- sensor ---

// Looks, and tells a sample that is new or due once more. A pause after each part lets receivers empty their buffers.
// False when it was not sent.
static bool tell(struct live *live, struct lw_bus *bus, int64_t *again_ns)
{
    bool fresh = false;
    const struct moment *moment = lw_mailbox_take(&live->moment_box, &fresh);
    const int64_t wake_ns = lw_clock_mono_ns();
    const int64_t now_ns = moment->time_ns > 0 ? moment->time_ns : wake_ns; // 0: no step yet
    const bool is_new = lw_sensor_look(&live->sensor, moment->tick * live->simulation->plant.period_ns);
    if (!is_new && wake_ns < *again_ns)
        return true;
    *again_ns = wake_ns + live->sensor.period_ns;
    struct lw_told told = {.count = 0};
    struct lw_periodic pause = lw_periodic_start(wake_ns + tell_pause_ns, tell_pause_ns);
    while (!told.all) {
        if (lw_simulation_tell(&live->sensor, now_ns, TELL_MAX, bus, &told) != LW_OK)
            return false;
        if (!told.all)
            (void)lw_periodic_wait(&pause);
    }
    return true;
}

static void *sense(void *user)
{
    struct live *live = user;
    const struct lw_program *program = live->simulation->program;
    struct lw_bus *bus = NULL;
    bool failing = false;
    int64_t again_ns = 0;
    if (lw_program_open(program, &bus) != LW_OK)
        atomic_store(&live->bus_failed, true);
    // Often enough for a sample not to wait, seldom enough to rest, and never so long that it keeps the program.
    const int64_t look_ns = live->sensor.period_ns / 8;
    struct lw_periodic loop = lw_periodic_start(lw_clock_mono_ns(), look_ns > poll_ns         ? poll_ns
                                                                    : look_ns < tell_pause_ns ? tell_pause_ns
                                                                                              : look_ns);
    while (!atomic_load(&live->rt_done) && !atomic_load(&live->bus_failed)) {
        lw_program_say_sent(program, "OBSTACLES", tell(live, bus, &again_ns), &failing);
        (void)lw_periodic_wait(&loop);
    }
    lw_bus_close(bus);
    return NULL;
}

// --- main ---

static enum lw_status subscribe(struct live *live)
{
    const struct lw_program *program = live->simulation->program;
    // LCM's read thread of the commands inherits the priority of the thread that subscribes.
    lw_program_realtime_thread(program, 1);
    const enum lw_status status =
        lw_program_subscribe(program, live->rx_bus, LW_CHANNEL_JOINT_COMMAND, on_command, live);
    lw_program_normal_thread();
    return status;
}

// Says when commands cease, and when they come again.
static void say_mode(const struct live *live, const struct lw_joint_state *state, enum lw_plant_mode *before)
{
    const struct lw_simulation *s = live->simulation;
    const double t = (double)state->tick * s->plant.period_s;
    if (state->mode == LW_PLANT_STOPPING && *before == LW_PLANT_MOVING && !atomic_load(&live->stopping))
        lw_program_say(s->program, "no command for %g ms at t = %.3f s: ramping to rest",
                       s->program->scene.plant.timeout_s * 1e3, t);
    if (state->mode == LW_PLANT_MOVING && *before == LW_PLANT_STOPPING)
        lw_program_say(s->program, "commands again at t = %.3f s", t);
    *before = state->mode;
}

static enum lw_run_state run_state(const struct live *live, const struct lw_record *record)
{
    static const enum lw_run_state states[] = {[LW_PLANT_HOLD] = LW_RUN_WAITING,
                                               [LW_PLANT_MOVING] = LW_RUNNING,
                                               [LW_PLANT_STOPPING] = LW_STOPPING,
                                               [LW_PLANT_ENDED] = LW_ENDING};
    if (atomic_load(&live->stopping))
        return LW_ENDING;
    return record->warm ? states[record->state.mode] : LW_STARTING;
}

// Statistics, PLANT_STATUS and words, once.
static void report(struct live *live, enum lw_plant_mode *before)
{
    const struct lw_record *newest = lw_health_collect(&live->health);
    if (newest == NULL)
        return;
    say_mode(live, &newest->state, before);
    struct lw_report report = {.state = run_state(live, newest), .clearance = HUGE_VAL, .world_age_ns = -1};
    lw_program_report(live->simulation->program, live->main_bus, &live->health, &report);
}

// Reports, announcements and signals, until the real-time thread is done.
static bool serve(struct live *live)
{
    enum lw_plant_mode before = LW_PLANT_HOLD;
    int64_t announce_ns = 0;
    struct lw_periodic loop = lw_periodic_start(lw_clock_mono_ns(), report_period_ns);
    while (!atomic_load(&live->rt_done)) {
        lw_program_announce(live->simulation->program, live->main_bus, &announce_ns);
        (void)lw_periodic_wait(&loop);
        report(live, &before);
        if (lw_stop_signal() != 0 || atomic_load(&live->bus_failed))
            atomic_store(&live->stopping, true);
        if (lw_stop_count() > 1)
            atomic_store(&live->abandoned, true);
    }
    report(live, &before);
    return !atomic_load(&live->bus_failed);
}

static int run_threads(struct live *live)
{
    static void *(*const run[])(void *) = {receive, sense, run_plant};
    enum { THREADS = sizeof run / sizeof run[0] };
    const struct lw_simulation *s = live->simulation;
    pthread_t thread[THREADS];
    int started = 0;
    while (started < THREADS && lw_program_thread(s->program, &thread[started], run[started], live))
        started++;
    bool ok = started == THREADS;
    if (ok) {
        lw_program_say(s->program, "ready, %g Hz", s->program->scene.plant.rate_hz);
        ok = serve(live);
    }
    atomic_store(&live->rt_done, true);
    for (int i = 0; i < started; i++)
        pthread_join(thread[i], NULL);
    const struct lw_record *newest = lw_health_past(&live->health, 0);
    lw_program_say(s->program, "%.3f s of motion, %lld periods skipped, %lld states not sent, %lld messages refused",
                   (double)s->arm.tick * s->plant.period_s, newest != NULL ? (long long)newest->skipped : 0LL,
                   (long long)live->health.unsent, (long long)lw_refusals_total(&s->program->refusals));
    ok &= lw_program_write_histogram(s->program, &live->health);
    return ok ? lw_stop_exit_status() : EXIT_FAILURE;
}

int lw_simulation_live(struct lw_simulation *simulation)
{
    static struct live live;
    struct lw_program *program = simulation->program;
    live.simulation = simulation;
    lw_mailbox_init(&live.command_box, live.command_slots, sizeof live.command_slots[0]);
    lw_mailbox_init(&live.moment_box, live.moment_slots, sizeof live.moment_slots[0]);
    lw_sensor_init(&live.sensor, &program->scene);
    if (!lw_program_go_realtime(program))
        return EXIT_FAILURE;
    int status = EXIT_FAILURE;
    if (!lw_health_init(&live.health, simulation->plant.period_ns))
        lw_program_fail(program, "out of memory");
    else if (lw_program_open(program, &live.rt_bus) == LW_OK &&
             lw_program_open_stream(program, &live.rx_bus) == LW_OK &&
             lw_program_open(program, &live.main_bus) == LW_OK && subscribe(&live) == LW_OK)
        status = run_threads(&live);
    lw_health_free(&live.health);
    lw_bus_close(live.main_bus);
    lw_bus_close(live.rx_bus);
    lw_bus_close(live.rt_bus);
    return status;
}
