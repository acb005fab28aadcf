// SPDX-License-Identifier: BSD-3-Clause
// Merging obstacle messages into the world: what a change asks for is looked at first, then nothing can fail.
//
// Units    see world.h.
// Frames   base frame.
// Arrays   entries 0..count-1 are used; the last one takes the place of one that goes.
// Memory   the caller's.
// Errors   see world.h.
#include "collision/world.h"

#include "base/digest.h" // lw_digest_*

#include <stdbool.h> // bool
#include <stddef.h>  // offsetof
#include <string.h>  // memcpy

// --- ids ---

static unsigned home_of(int id)
{
    return ((uint32_t)id * UINT32_C(2654435769)) >> 17; // the upper 15 bits
}

static unsigned after(unsigned slot)
{
    return (slot + 1) & (LW_WORLD_SLOTS - 1);
}

// Slot of an id, or the free one where it would stand. There is always a free one.
static unsigned slot_of(const struct lw_world *world, int id)
{
    unsigned slot = home_of(id);
    while (world->slot[slot] != 0 && world->entry[world->slot[slot] - 1].obstacle.id != id)
        slot = after(slot);
    return slot;
}

int lw_world_find(const struct lw_world *world, int id)
{
    return world->slot[slot_of(world, id)] - 1;
}

// Frees the slot of an id; those behind it that could not stand there move up.
static void forget_id(struct lw_world *world, int id)
{
    unsigned gap = slot_of(world, id);
    for (unsigned at = after(gap); world->slot[at] != 0; at = after(at)) {
        const unsigned home = home_of(world->entry[world->slot[at] - 1].obstacle.id);
        const unsigned from_home = (at - home) & (LW_WORLD_SLOTS - 1), from_gap = (at - gap) & (LW_WORLD_SLOTS - 1);
        if (from_home >= from_gap) {
            world->slot[gap] = world->slot[at];
            gap = at;
        }
    }
    world->slot[gap] = 0;
}

// --- vertices ---

static int chunks_of(int vertices)
{
    return (vertices + LW_CHUNK - 1) / LW_CHUNK;
}

static void release_vertices(struct lw_world *world, struct lw_world_entry *entry)
{
    for (int number = entry->chunk; number != 0;) {
        struct lw_world_chunk *chunk = &world->chunk[number - 1];
        const int next = chunk->next;
        chunk->next = world->chunk_free;
        world->chunk_free = number;
        world->chunks_used--;
        number = next;
    }
    entry->chunk = entry->vertex_count = 0;
    entry->vertex_digest = 0;
    entry->generation = 0;
}

static int take_chunk(struct lw_world *world)
{
    int number = world->chunk_free;
    if (number != 0)
        world->chunk_free = world->chunk[number - 1].next;
    else
        number = ++world->chunks_touched;
    world->chunks_used++;
    return number;
}

// Gives an entry other vertices; there is room for them.
static void store_vertices(struct lw_world *world, struct lw_world_entry *entry, const double *vertex, int count)
{
    release_vertices(world, entry);
    int *link = &entry->chunk;
    for (int from = 0; from < count; from += LW_CHUNK) {
        const int n = count - from < LW_CHUNK ? count - from : LW_CHUNK, number = take_chunk(world);
        struct lw_world_chunk *chunk = &world->chunk[number - 1];
        memcpy(chunk->vertex, &vertex[3 * from], 3 * (size_t)n * sizeof vertex[0]);
        *link = number;
        link = &chunk->next;
    }
    *link = 0;
    entry->vertex_count = count;
    entry->generation = ++world->generation;
}

int lw_world_vertices(const struct lw_world *world, const struct lw_world_entry *entry, double vertex[3 * LW_HULL_MAX])
{
    int number = entry->chunk;
    for (int from = 0; from < entry->vertex_count; from += LW_CHUNK) {
        const int left = entry->vertex_count - from, n = left < LW_CHUNK ? left : LW_CHUNK;
        const struct lw_world_chunk *chunk = &world->chunk[number - 1];
        memcpy(&vertex[3 * from], chunk->vertex, 3 * (size_t)n * sizeof vertex[0]);
        number = chunk->next;
    }
    return entry->vertex_count;
}

// --- digests ---
// tools/leeway/replay/digest.py names these values in this order.

static uint64_t digest_vertices(const double *vertex, int count)
{
    return lw_digest_doubles(lw_digest_int(LW_DIGEST_START, count), vertex, 3 * count);
}

static uint64_t digest_entry(const struct lw_world_entry *entry, int64_t expires_ns)
{
    const struct lw_obstacle *o = &entry->obstacle;
    uint64_t digest = lw_digest_int(lw_digest_int(LW_DIGEST_START, o->id), (int64_t)o->shape);
    digest = lw_digest_doubles(lw_digest_doubles(digest, o->p, 3), o->quat, 4);
    digest = lw_digest_doubles(lw_digest_doubles(digest, &o->radius, 1), o->size, 3);
    digest = lw_digest_doubles(lw_digest_doubles(digest, o->v, 3), o->omega, 3);
    digest = lw_digest_int(lw_digest_int(digest, entry->time_ns), expires_ns);
    return lw_digest_word(digest, entry->vertex_digest);
}

static void add_digest(struct lw_world *world, uint64_t more, uint64_t less)
{
    world->digest = (int64_t)((uint64_t)world->digest + more - less);
}

// --- one entry ---

static void drop(struct lw_world *world, int at)
{
    const int last = world->count - 1;
    add_digest(world, 0, world->entry[at].digest);
    release_vertices(world, &world->entry[at]);
    forget_id(world, world->entry[at].obstacle.id);
    if (at < last) {
        // NOLINTNEXTLINE(clang-analyzer-security.ArrayBound): both are places of entries
        world->slot[slot_of(world, world->entry[last].obstacle.id)] = at + 1;
        world->entry[at] = world->entry[last];
        world->owner[at] = world->owner[last];
        world->expires_ns[at] = world->expires_ns[last];
    }
    world->count = last;
}

// An entry of an id that is not there yet, with nothing in it.
static int append(struct lw_world *world, int id)
{
    const int at = world->count;
    // NOLINTNEXTLINE(clang-analyzer-security.ArrayBound): only an entry is dropped, so the count is never negative
    world->entry[at] = (struct lw_world_entry){.obstacle = {.id = id}};
    world->owner[at] = 0;
    world->slot[slot_of(world, id)] = world->count = at + 1;
    return at;
}

// Vertices told by a change, those an entry has, or none.
static void put_vertices(struct lw_world *world, struct lw_world_entry *entry, const struct lw_obstacle_change *change,
                         enum lw_shape_kind shape)
{
    if (shape != LW_HULL) {
        release_vertices(world, entry);
    } else if (change->vertex_count > 0) {
        const uint64_t digest = digest_vertices(change->vertex, change->vertex_count);
        if (entry->vertex_count != change->vertex_count || entry->vertex_digest != digest)
            store_vertices(world, entry, change->vertex, change->vertex_count);
        entry->vertex_digest = digest;
    }
}

// Adds or overwrites one obstacle; there is room for it. Returns whether the world differs now.
static bool put(struct lw_world *world, const struct lw_obstacle_change *change, const struct lw_obstacle *obstacle)
{
    int at = lw_world_find(world, obstacle->id);
    if (at < 0)
        at = append(world, obstacle->id);
    struct lw_world_entry *entry = &world->entry[at];
    const uint64_t before = entry->digest;
    const int64_t owner = world->owner[at], expires_ns = lw_change_expires_ns(change);
    put_vertices(world, entry, change, obstacle->shape);
    entry->obstacle = *obstacle;
    entry->time_ns = change->time_ns;
    entry->digest = digest_entry(entry, expires_ns);
    world->expires_ns[at] = expires_ns;
    world->owner[at] = change->stamp.session;
    if (expires_ns != 0 && expires_ns < world->earliest_ns)
        world->earliest_ns = expires_ns;
    add_digest(world, entry->digest, before);
    return owner != change->stamp.session || before != entry->digest;
}

// --- what a change asks for ---

static bool adds(const struct lw_obstacle_change *change)
{
    return change->op == LW_UPSERT || change->op == LW_REPLACE;
}

static bool names(const struct lw_obstacle_change *change, int id)
{
    for (int i = 0; i < change->count; i++)
        if (change->obstacle[i].id == id)
            return true;
    return false;
}

// Whether the time of an entry is over when the change was told.
static bool is_over(const struct lw_world *world, const struct lw_obstacle_change *change, int at)
{
    return world->expires_ns[at] != 0 && change->time_ns != 0 && world->expires_ns[at] <= change->time_ns;
}

// Whether an entry that is not named goes: its own source replaces all it has, or says that its time is over.
static bool goes(const struct lw_world *world, const struct lw_obstacle_change *change, int at)
{
    return world->owner[at] == change->stamp.session && (change->op == LW_REPLACE || is_over(world, change, at)) &&
           !names(change, world->entry[at].obstacle.id);
}

// Whether an entry that is not named may lose its place: its source may have fallen silent. Whoever says that
// it was over a year ago goes by another clock, as that of the calendar.
static bool yields(const struct lw_world *world, const struct lw_obstacle_change *change, int at)
{
    return is_over(world, change, at) && change->time_ns - world->expires_ns[at] < INT64_C(31536000000000000) &&
           !names(change, world->entry[at].obstacle.id);
}

struct need {
    int obstacles, chunks;
};

// What a change adds, and what it gives back of the entries that it names.
static enum lw_status need_of(const struct lw_world *world, const struct lw_obstacle_change *change, struct need *out)
{
    struct need need = {.chunks = chunks_of(change->vertex_count)};
    for (int i = 0; i < change->count; i++) {
        const int at = lw_world_find(world, change->obstacle[i].id);
        const int vertices = at >= 0 ? world->entry[at].vertex_count : 0;
        if (change->obstacle[i].shape == LW_HULL && change->vertex_count == 0 && vertices == 0)
            return LW_E_UNKNOWN;
        need.obstacles += at < 0;
        need.chunks -= chunks_of(vertices); // only a hull told anew needs any
    }
    *out = need;
    return LW_OK;
}

static bool fits(const struct lw_world *world, struct need need)
{
    return world->count + need.obstacles <= LW_WORLD_MAX && world->chunks_used + need.chunks <= LW_WORLD_CHUNKS;
}

// Whether everything can be done. Only a world that is nearly full is looked at for what goes.
static enum lw_status check(const struct lw_world *world, const struct lw_obstacle_change *change)
{
    struct need need;
    if (!adds(change))
        return LW_OK;
    const enum lw_status status = need_of(world, change, &need);
    if (status != LW_OK || fits(world, need))
        return status;
    for (int at = 0; at < world->count; at++)
        if (goes(world, change, at) || yields(world, change, at)) {
            need.obstacles--;
            need.chunks -= chunks_of(world->entry[at].vertex_count);
        }
    return fits(world, need) ? LW_OK : LW_E_FULL;
}

// --- doing it ---

// Drops what goes; learns anew what expires first. Returns whether anything went.
static bool drop_those_that_go(struct lw_world *world, const struct lw_obstacle_change *change)
{
    const int before = world->count;
    int64_t earliest_ns = INT64_MAX;
    for (int at = world->count - 1; at >= 0; at--) {
        if (goes(world, change, at))
            drop(world, at);
        else if (world->expires_ns[at] != 0 && world->expires_ns[at] < earliest_ns)
            earliest_ns = world->expires_ns[at];
    }
    world->earliest_ns = earliest_ns;
    return world->count < before;
}

// The entry that yields first: what has been over for longest, then by id. -1 = none does.
static int find_oldest(const struct lw_world *world, const struct lw_obstacle_change *change)
{
    int found = -1;
    for (int at = 0; at < world->count; at++)
        if ((found < 0 || world->expires_ns[at] < world->expires_ns[found] ||
             (world->expires_ns[at] == world->expires_ns[found] &&
              world->entry[at].obstacle.id < world->entry[found].obstacle.id)) &&
            yields(world, change, at))
            found = at;
    return found;
}

// Takes the places that a change found possible still needs, no more.
static void make_room(struct lw_world *world, const struct lw_obstacle_change *change)
{
    struct need need = {0};
    bool is_short = need_of(world, change, &need) == LW_OK && !fits(world, need);
    for (int at = 0; is_short && (at = find_oldest(world, change)) >= 0; is_short = !fits(world, need))
        drop(world, at);
}

static void clear(struct lw_world *world)
{
    memset(world->slot, 0, sizeof world->slot);
    world->count = world->chunks_used = world->chunks_touched = world->chunk_free = 0;
    world->digest = 0;
    world->earliest_ns = INT64_MAX;
}

static bool remove_named(struct lw_world *world, const struct lw_obstacle_change *change)
{
    const int before = world->count;
    for (int i = 0; i < change->count; i++) {
        const int at = lw_world_find(world, change->obstacle[i].id);
        if (at >= 0)
            drop(world, at);
    }
    return world->count < before;
}

static bool put_named(struct lw_world *world, const struct lw_obstacle_change *change)
{
    bool changed = false;
    make_room(world, change);
    for (int i = 0; i < change->count; i++)
        changed |= put(world, change, &change->obstacle[i]);
    return changed;
}

// Makes a change that was found possible. Returns whether the world differs now.
static bool make(struct lw_world *world, const struct lw_obstacle_change *change)
{
    bool changed = change->op == LW_CLEAR && world->count > 0;
    if (change->op == LW_CLEAR) {
        clear(world);
        return changed;
    }
    if (change->op == LW_REPLACE || (change->time_ns != 0 && change->time_ns >= world->earliest_ns))
        changed |= drop_those_that_go(world, change);
    return changed | (adds(change) ? put_named(world, change) : remove_named(world, change));
}

// --- senders ---

// A sender, or who makes room for it: the one unheard for longest.
static struct lw_sender *place_of_sender(struct lw_world *world, int64_t session, int channel)
{
    struct lw_sender *oldest = &world->sender[0];
    for (int i = 0; i < LW_SENDERS_MAX; i++) {
        struct lw_sender *sender = &world->sender[i];
        if (sender->session == session && sender->channel == channel)
            return sender;
        oldest = sender->heard < oldest->heard ? sender : oldest;
    }
    return oldest;
}

// --- the whole ---

enum lw_status lw_world_apply(struct lw_world *world, const struct lw_obstacle_change *change)
{
    const int channel = (int)lw_change_channel(change);
    const struct lw_stamp *stamp = &change->stamp;
    struct lw_sender *sender = place_of_sender(world, stamp->session, channel);
    const bool known = sender->session == stamp->session && sender->channel == channel;
    if (known && stamp->seq < sender->seq)
        return LW_E_OLD;
    if (!known || stamp->seq > sender->seq) {
        const enum lw_status status = check(world, change);
        if (status != LW_OK)
            return status;
        *sender = (struct lw_sender){.session = stamp->session, .seq = stamp->seq, .channel = channel};
        const bool changed = make(world, change);
        // Hearing anything at all is version 1: an empty world is known, not unheard of.
        world->version += changed || world->version == 0;
    }
    sender->heard = ++world->heard;
    world->last = *stamp;
    world->last_channel = channel;
    return LW_OK;
}

static enum lw_status add(const struct lw_world *world, int at, struct lw_snapshot *snapshot)
{
    const struct lw_world_entry *entry = &world->entry[at];
    const struct lw_obstacle *o = &entry->obstacle;
    double vertex[3 * LW_HULL_MAX];
    const int count = lw_world_vertices(world, entry, vertex);
    const struct lw_solid solid = lw_obstacle_solid(o, vertex, count);
    struct lw_motion motion = {.time_ns = entry->time_ns, .expires_ns = world->expires_ns[at]};
    struct lw_pose pose;
    memcpy(motion.v, o->v, sizeof motion.v);
    memcpy(motion.omega, o->omega, sizeof motion.omega);
    const enum lw_status status = lw_pose_make(o->p, o->quat, &pose);
    return status == LW_OK ? lw_snapshot_add(snapshot, o->id, entry->generation, &solid, &pose, &motion) : status;
}

enum lw_status lw_world_build(const struct lw_world *world, struct lw_snapshot *snapshot)
{
    enum lw_status status = LW_OK;
    lw_snapshot_begin(snapshot);
    for (int at = 0; status == LW_OK && at < world->count; at++)
        status = add(world, at, snapshot);
    lw_snapshot_end(snapshot);
    snapshot->version = world->version;
    snapshot->last = world->last;
    snapshot->last_channel = world->last_channel;
    snapshot->digest = world->digest;
    return status;
}

void lw_world_copy(const struct lw_world *from, struct lw_world *to)
{
    // Few ids use few places of their table, here and there.
    for (int at = to->count - 1; at >= 0; at--)
        forget_id(to, to->entry[at].obstacle.id);
    memcpy(to, from, offsetof(struct lw_world, slot));
    memcpy(to->owner, from->owner, (size_t)from->count * sizeof from->owner[0]);
    memcpy(to->expires_ns, from->expires_ns, (size_t)from->count * sizeof from->expires_ns[0]);
    memcpy(to->entry, from->entry, (size_t)from->count * sizeof from->entry[0]);
    memcpy(to->chunk, from->chunk, (size_t)from->chunks_touched * sizeof from->chunk[0]);
    for (int at = 0; at < to->count; at++)
        to->slot[slot_of(to, to->entry[at].obstacle.id)] = at + 1;
}
