// SPDX-License-Identifier: BSD-3-Clause
// Listening: joint states for the real-time thread, obstacles and requests for its snapshot.
//
// Units    see live.h.
// Frames   see tick.h.
// Arrays   none.
// Memory   see live.h.
// Errors   a message that is not taken is counted by reason.
#include "base/clock.h" // lw_clock_mono_ns
#include "controller/live.h"

enum { POLL_MS = 50 };
static const int64_t world_period_ns = LW_NS_PER_S / 5;

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

// --- obstacles and requests ---

static void on_obstacles(void *user, enum lw_channel channel, const union lw_message *message)
{
    struct lw_live *live = user;
    const enum lw_status status = lw_world_apply(&live->world, &message->obstacles);
    if (!lw_refusals_note(&live->control->program->refusals, lw_verdict_of(status)))
        return;
    lw_heard_note(&live->heard, channel, message);
    atomic_store(&live->world_heard_ns, lw_clock_mono_ns());
    lw_world_build(&live->world, lw_mailbox_slot(&live->world_box));
    lw_mailbox_publish(&live->world_box);
}

static void on_request(void *user, enum lw_channel channel, const union lw_message *message)
{
    struct lw_live *live = user;
    // Repetitions stay out of the mailbox, where they could replace a newer request that no tick has taken yet.
    if (!lw_request_is_new(&live->requests, &message->request))
        return;
    lw_heard_note(&live->heard, channel, message);
    struct lw_request *slot = lw_mailbox_slot(&live->request_box);
    *slot = message->request;
    lw_mailbox_publish(&live->request_box);
}

// The whole set, for viewers and logs: what fits into one message replaces, the rest is added.
static void publish_world(struct lw_live *live)
{
    union lw_message message;
    int sent = 0;
    do {
        struct lw_obstacle_change *change = &message.obstacles;
        *change = (struct lw_obstacle_change){.op = sent == 0 ? LW_REPLACE : LW_UPSERT};
        while (change->count < LW_CHANGE_MAX && sent < live->world.count)
            change->obstacle[change->count++] = live->world.obstacle[sent++];
        if (lw_bus_publish(live->world_bus, LW_CHANNEL_WORLD, &message) != LW_OK)
            return; // nobody depends on it, and it comes again
    } while (sent < live->world.count);
}

void *lw_live_world(void *user)
{
    struct lw_live *live = user;
    int64_t due_ns = lw_clock_mono_ns();
    while (!atomic_load(&live->rt_done) && !atomic_load(&live->bus_failed)) {
        if (!lw_bus_handle(live->world_rx_bus, POLL_MS))
            atomic_store(&live->bus_failed, true);
        if (lw_clock_mono_ns() < due_ns || live->world.version == 0)
            continue;
        publish_world(live);
        due_ns = lw_clock_mono_ns() + world_period_ns;
    }
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
    if (status == LW_OK)
        status = lw_program_subscribe(program, live->world_rx_bus, LW_CHANNEL_OBSTACLES, on_obstacles, live);
    if (status == LW_OK)
        status = lw_program_subscribe(program, live->world_rx_bus, LW_CHANNEL_HULL, on_obstacles, live);
    if (status == LW_OK)
        status = lw_program_subscribe(program, live->world_rx_bus, LW_CHANNEL_GOAL, on_request, live);
    if (status == LW_OK)
        status = lw_program_subscribe(program, live->world_rx_bus, LW_CHANNEL_STOP, on_request, live);
    return status;
}
