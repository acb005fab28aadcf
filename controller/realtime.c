// SPDX-License-Identifier: BSD-3-Clause
// The real-time thread: one tick a period, half a plant period behind the plant's messages.
//
// Units    see live.h.
// Frames   see tick.h.
// Arrays   none.
// Memory   stack and static; nothing is allocated.
// Errors   a command that the system refuses to send is counted; the next tick sends another.
#include "base/clock.h"    // lw_clock_mono_ns
#include "base/periodic.h" // lw_periodic_*
#include "base/phase.h"    // lw_phase_correct
#include "controller/live.h"

static const int64_t warm_up_ns = LW_NS_PER_S / 2;

struct loop {
    struct lw_live *live;
    struct lw_periodic periodic;
    struct lw_phase phase;
    int64_t start_ns;
    struct lw_record record; // of the tick now running, then of the one before
    union lw_message message;
};

// Takes the newest of everything and computes the command.
static const struct lw_arrival *compute(struct loop *loop)
{
    struct lw_live *live = loop->live;
    struct lw_record *record = &loop->record;
    bool other = false;
    const struct lw_arrival *arrival = lw_mailbox_take(&live->state_box, &record->fresh);
    const struct lw_snapshot *world = lw_mailbox_take(&live->world_box, &other);
    const struct lw_request *request = lw_mailbox_take(&live->request_box, &other);
    record->time_ns = loop->periodic.wake_ns;
    record->warm = record->time_ns - loop->start_ns > warm_up_ns;
    record->age_ns = record->time_ns - arrival->arrival_ns;
    const struct lw_tick_input in = {.time_ns = record->time_ns,
                                     .state_age_ns = record->age_ns,
                                     .warming_up = !record->warm,
                                     .joint = &arrival->joint,
                                     .world = world,
                                     .request = atomic_load(&live->stopping) ? &lw_request_shutdown : request};
    lw_tick(&live->control->config, &live->control->state, &in, &loop->message.joint_command);
    return arrival;
}

static unsigned faults(const struct lw_joint_command *command, bool expected)
{
    return (expected && (command->flags & LW_STALE) ? LW_FAULT_PEER_TIMEOUT : 0u) |
           (command->flags & LW_FOREIGN ? LW_FAULT_LEASE : 0u) |
           (command->flags & LW_NOT_FINITE ? LW_FAULT_BAD_INPUT : 0u);
}

// One period. Returns the state it used.
static const struct lw_arrival *step(struct loop *loop)
{
    struct lw_record *record = &loop->record;
    struct lw_joint_command *command = &loop->message.joint_command;
    record->wake_late_ns = lw_periodic_wait(&loop->periodic);
    const struct lw_arrival *arrival = compute(loop);
    command->wake_late_ns = record->wake_late_ns;
    command->previous_exec_ns = record->exec_ns;
    command->skipped = loop->periodic.skipped;
    command->compute_ns = lw_clock_mono_ns() - record->time_ns;
    record->sent = lw_bus_publish(loop->live->rt_bus, LW_CHANNEL_JOINT_COMMAND, &loop->message) == LW_OK;
    record->exec_ns = lw_clock_mono_ns() - record->time_ns;

    // The account of this tick, for statistics and the file written after a fault.
    record->skipped = loop->periodic.skipped;
    record->lease = arrival->lease;
    record->state = arrival->joint;
    record->command = *command;
    record->expected = arrival->joint.stamp.session != 0 && arrival->joint.mode != LW_PLANT_ENDED;
    if (!record->expected)
        record->age_ns = 0;
    record->faults = faults(command, record->expected);
    lw_health_note(&loop->live->health, record);
    return arrival;
}

// Moves the next deadline half a plant period behind the arrivals. A plant slower than this loop, or one that says so,
// moves it by no more than one of our own periods.
static void follow(struct loop *loop, const struct lw_arrival *arrival)
{
    const int64_t own_ns = loop->periodic.period_ns, plant_ns = arrival->joint.period_ns;
    const bool idle = loop->message.joint_command.mode == LW_COMMAND_IDLE;
    loop->periodic.deadline_ns += lw_phase_correct(&loop->phase, loop->periodic.deadline_ns, arrival->arrival_ns,
                                                   plant_ns < own_ns ? plant_ns : own_ns, idle);
}

void *lw_live_realtime(void *user)
{
    static struct loop loop;
    struct lw_live *live = user;
    lw_program_realtime_thread(live->control->program, 0);
    loop.live = live;
    loop.start_ns = lw_clock_mono_ns();
    loop.periodic = lw_periodic_start(loop.start_ns, live->control->config.period_ns);
    for (bool ended = false; !ended;) {
        const struct lw_arrival *arrival = step(&loop);
        if (loop.record.fresh)
            follow(&loop, arrival);
        // An arm that another controller moves is not ours to bring to rest.
        const bool foreign = (loop.message.joint_command.flags & LW_FOREIGN) != 0;
        const bool rest = foreign || lw_controller_at_rest(&live->control->state);
        ended = atomic_load(&live->stopping) && (rest || !loop.record.sent);
        ended |= atomic_load(&live->abandoned);
    }
    lw_health_end(&live->health);
    atomic_store(&live->rt_done, true);
    return NULL;
}
