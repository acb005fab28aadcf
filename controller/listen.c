// SPDX-License-Identifier: BSD-3-Clause
// Listening: joint states for the real-time thread, and what the two listening threads subscribe to.
//
// Units    see live.h.
// Frames   see tick.h.
// Arrays   none.
// Memory   see live.h.
// Errors   a message that is not taken is counted by reason.
#include "base/clock.h" // lw_clock_mono_ns
#include "controller/live.h"

enum { POLL_MS = 50 };

// --- joint states ---

static void on_joint_state(void *user, enum lw_channel channel, const union lw_message *message)
{
    (void)channel;
    struct lw_live *live = user;
    const struct lw_joint_state *joint = &message->joint_state;
    const int64_t now_ns = lw_clock_mono_ns(), lease_ns = lw_lease_ns(live->control->config.stale_after_ns);
    const enum lw_verdict verdict = lw_lease_take(&live->lease, &joint->stamp, now_ns, lease_ns);
    if (!lw_refusals_note(&live->control->program->refusals, verdict))
        return;
    // A plant that goes in good order leaves its place to the next one at once.
    if (joint->mode == LW_PLANT_ENDED)
        live->lease.last_ns -= lease_ns;
    struct lw_arrival *slot = lw_mailbox_slot(&live->state_box);
    *slot = (struct lw_arrival){.joint = *joint, .arrival_ns = now_ns, .lease = live->lease};
    lw_mailbox_publish(&live->state_box);
}

void *lw_live_receive(void *user)
{
    struct lw_live *live = user;
    lw_program_realtime_thread(live->control->program, 1);
    while (!atomic_load(&live->rt_done) && !atomic_load(&live->bus_failed))
        if (!lw_bus_handle(live->rx_bus, POLL_MS))
            atomic_store(&live->bus_failed, true);
    return NULL;
}

// --- subscriptions ---

enum lw_status lw_live_subscribe(struct lw_live *live)
{
    const struct lw_program *program = live->control->program;
    // LCM's read thread of the joint states inherits the priority of the thread that subscribes.
    lw_program_realtime_thread(program, 1);
    enum lw_status status = lw_program_subscribe(program, live->rx_bus, LW_CHANNEL_JOINT_STATE, on_joint_state, live);
    lw_program_normal_thread();
    return status == LW_OK ? lw_live_subscribe_world(live) : status;
}
