// SPDX-License-Identifier: BSD-3-Clause
// Gathering: obstacles and requests of all senders, merged for the real-time thread; and telling everybody what was
// gathered.
//
// Units    see live.h.
// Frames   see tick.h.
// Arrays   none.
// Memory   see live.h.
// Errors   a message that is not taken is counted by reason.
#include "base/clock.h" // lw_clock_mono_ns
#include "controller/live.h"

enum { POLL_MS = 50, TELL_BURST = 16, BUILD_REST = 4 };
static const int64_t ns_per_ms = 1000 * 1000;
static const int64_t drain_ns = 2 * 1000 * 1000;         // what has arrived is taken in for so long before it is shown
static const int64_t tell_period_ns = 200 * 1000 * 1000; // from one telling of the whole set to the next
static const int64_t tell_step_ns = 10 * 1000 * 1000;    // between bursts of messages

struct gathering {
    struct lw_live *live;
    int64_t heard;    // messages so far
    bool changed;     // the snapshot is not the world
    bool telling;     // a part of the set has been told
    int64_t build_ns; // when the next snapshot may be built
    int64_t tell_ns;  // when to tell more
    int64_t cycle_ns; // when to begin anew
};

// --- messages ---

static void on_obstacles(void *user, enum lw_channel channel, const union lw_message *message)
{
    struct gathering *g = user;
    g->heard++;
    const enum lw_status status = lw_world_apply(&g->live->world, &message->obstacles);
    if (!lw_refusals_note(&g->live->control->program->refusals, lw_verdict_of(status)))
        return;
    lw_heard_note(&g->live->heard, channel, message);
    atomic_store(&g->live->world_heard_ns, lw_clock_mono_ns());
    g->changed = true;
}

static void on_request(void *user, enum lw_channel channel, const union lw_message *message)
{
    struct gathering *g = user;
    struct lw_live *live = g->live;
    g->heard++;
    // Repetitions stay out of the mailbox, where they could replace a newer request that no tick has taken yet.
    if (!lw_request_is_new(&live->requests, &message->request))
        return;
    lw_heard_note(&live->heard, channel, message);
    struct lw_request *slot = lw_mailbox_slot(&live->request_box);
    *slot = message->request;
    lw_mailbox_publish(&live->request_box);
}

// --- showing it to the real-time thread ---

// Builds a snapshot in the mailbox. Then this thread does other things for a few times as long, however much comes.
static void build(struct gathering *g)
{
    struct lw_live *live = g->live;
    const int64_t start_ns = lw_clock_mono_ns();
    const enum lw_status status = lw_world_build(&live->world, lw_mailbox_slot(&live->world_box));
    if (status != LW_OK) {
        // Every obstacle was checked when it came: this is no world to go on with.
        lw_program_fail(live->control->program, "obstacles: %s", lw_status_text(status));
        atomic_store(&live->bus_failed, true);
        return;
    }
    lw_mailbox_publish(&live->world_box);
    const int64_t end_ns = lw_clock_mono_ns(), rest_ns = BUILD_REST * (end_ns - start_ns);
    g->build_ns = end_ns + (rest_ns > drain_ns ? rest_ns : drain_ns);
    g->changed = false;
}

// --- telling ---

static bool publish(struct gathering *g, union lw_message *message)
{
    const bool hull = message->obstacles.vertex_count > 0;
    return lw_bus_publish(g->live->world_bus, hull ? LW_CHANNEL_WORLD_HULL : LW_CHANNEL_WORLD, message) == LW_OK;
}

// The next message of the whole set. The first one replaces. False when all is told, or the system refuses to send:
// nobody depends on it, and it comes again.
static bool tell_next(struct gathering *g)
{
    struct lw_live *live = g->live;
    union lw_message message;
    const bool first = !g->telling;
    bool more = lw_tell_next(&live->tell, &live->world, &message.obstacles);
    if (first && (!more || message.obstacles.vertex_count > 0)) {
        union lw_message nothing = {.obstacles = {.op = LW_REPLACE}};
        more &= publish(g, &nothing);
    } else if (first) {
        message.obstacles.op = LW_REPLACE;
    }
    g->telling = true;
    return more && publish(g, &message);
}

// Tells the whole set five times a second, if it is small; a large one in bursts, as fast as they allow.
static void tell(struct gathering *g, int64_t now_ns)
{
    struct lw_live *live = g->live;
    if (now_ns < g->tell_ns || live->world.version == 0)
        return;
    if (!g->telling) {
        lw_tell_begin(&live->tell, &live->world, now_ns);
        g->cycle_ns = now_ns + tell_period_ns;
    }
    bool more = true;
    for (int i = 0; more && i < TELL_BURST; i++)
        more = tell_next(g);
    g->telling = more;
    g->tell_ns = more || g->cycle_ns < now_ns ? now_ns + tell_step_ns : g->cycle_ns;
}

// --- the thread ---

static int64_t earlier(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

// How long to wait for a message: until something is due.
static int wait_ms(const struct gathering *g, int64_t now_ns)
{
    int64_t due_ns = now_ns + POLL_MS * ns_per_ms;
    if (g->live->world.version > 0)
        due_ns = earlier(due_ns, g->tell_ns);
    if (g->changed)
        due_ns = earlier(due_ns, g->build_ns);
    return due_ns > now_ns ? (int)((due_ns - now_ns + ns_per_ms - 1) / ns_per_ms) : 0;
}

// Waits for messages and takes in all that have arrived, for a while at most. False when the bus failed.
static bool take_in(struct gathering *g)
{
    int64_t before = g->heard;
    if (!lw_bus_handle(g->live->world_rx_bus, wait_ms(g, lw_clock_mono_ns())))
        return false;
    const int64_t end_ns = lw_clock_mono_ns() + drain_ns;
    while (g->heard != before && lw_clock_mono_ns() < end_ns) {
        before = g->heard;
        if (!lw_bus_handle(g->live->world_rx_bus, 0))
            return false;
    }
    return true;
}

static struct gathering gathering; // one process, one such thread

void *lw_live_world(void *user)
{
    struct gathering *g = &gathering;
    struct lw_live *live = user;
    while (!atomic_load(&live->rt_done) && !atomic_load(&live->bus_failed)) {
        if (!take_in(g))
            atomic_store(&live->bus_failed, true);
        const int64_t now_ns = lw_clock_mono_ns();
        if (g->changed && now_ns >= g->build_ns)
            build(g);
        tell(g, now_ns);
    }
    return NULL;
}

enum lw_status lw_live_subscribe_world(struct lw_live *live)
{
    static const struct {
        enum lw_channel channel;
        lw_bus_handler handler;
    } wanted[] = {{LW_CHANNEL_OBSTACLES, on_obstacles},
                  {LW_CHANNEL_HULL, on_obstacles},
                  {LW_CHANNEL_GOAL, on_request},
                  {LW_CHANNEL_STOP, on_request}};
    enum lw_status status = LW_OK;
    gathering.live = live;
    for (size_t i = 0; status == LW_OK && i < sizeof wanted / sizeof wanted[0]; i++)
        status = lw_program_subscribe(live->control->program, live->world_rx_bus, wanted[i].channel, wanted[i].handler,
                                      &gathering);
    return status;
}
