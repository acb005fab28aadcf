// SPDX-License-Identifier: BSD-3-Clause
// Fuzz target: obstacle messages of several senders merged into one world, which is empty, or nearly full of obstacles
// or of vertices. After each message the world holds what the rules of collision/world.h say, worked out by the model
// of the unit tests; and what is told of it rebuilds it.
//
// Units    metres, ns.
// Frames   base frame.
// Arrays   see collision/world.h.
// Memory   static: a world is large.
// Errors   see fuzz.h.
#include "collision/world.h"
#include "controller/tell.h"
#include "fuzz.h"
#include "tests/unit/world_model.h" // model_*

#include <string.h> // memcmp

// Obstacles that are there from the start: ids from here on, of a sender of their own.
enum { OLD_ID = 1 << 20, OLD_SESSION = 1000, SESSIONS = 5, FULL_HULLS = LW_WORLD_VERTICES / LW_HULL_MAX };
static struct lw_world world, rebuilt, full_of_balls, full_of_hulls;

// --- worlds to begin with ---

static void add_old(struct lw_world *to, int id, int vertices)
{
    struct lw_obstacle_change c = {.stamp = {.session = OLD_SESSION, .seq = id}, .count = 1, .vertex_count = vertices};
    c.obstacle[0] = (struct lw_obstacle){.id = OLD_ID + id, .quat = {1}, .shape = vertices > 0 ? LW_HULL : LW_SPHERE};
    c.vertex[0] = id;
    CHECK(lw_world_apply(to, &c) == LW_OK);
}

static void begin(int kind)
{
    if (full_of_balls.count == 0) {
        for (int id = 1; id <= LW_WORLD_MAX - 12; id++)
            add_old(&full_of_balls, id, 0);
        for (int id = 1; id < FULL_HULLS; id++)
            add_old(&full_of_hulls, id, LW_HULL_MAX);
    }
    static const struct lw_world empty;
    lw_world_copy(kind == 0 ? &full_of_balls : kind == 1 ? &full_of_hulls : &empty, &world);
}

// --- messages ---

static int64_t newest_of(int64_t session, int channel)
{
    for (int i = 0; i < LW_SENDERS_MAX; i++)
        if (world.sender[i].session == session && world.sender[i].channel == channel)
            return world.sender[i].seq;
    return 0;
}

// One entry out of a byte; only what its shape has is not 0.
static struct lw_obstacle next_obstacle(struct bytes *in, int id)
{
    const int kind = next_byte(in);
    struct lw_obstacle o = {.id = id, .shape = (enum lw_shape_kind)(kind % 5), .p = {kind / 5}, .quat = {1}};
    if (o.shape != LW_HALFSPACE)
        o.radius = 0.125;
    for (int i = 0; i < (o.shape == LW_BOX ? 3 : o.shape == LW_CAPSULE ? 1 : 0); i++)
        o.size[i] = 0.25;
    return o;
}

// A valid message out of a few bytes, most often the next one of its sender. Ids step through all of them, so that none
// stands twice.
static struct lw_obstacle_change next_change(struct bytes *in)
{
    static const enum lw_change_op ops[] = {LW_UPSERT, LW_UPSERT,  LW_UPSERT, LW_UPSERT,
                                            LW_UPSERT, LW_REPLACE, LW_REMOVE, LW_CLEAR};
    struct lw_obstacle_change c = {.stamp = {.session = 1 + next_byte(in) % SESSIONS}};
    const int op = next_byte(in), seq = next_byte(in), first = next_byte(in), time = next_byte(in);
    const bool hull = op % 16 == 1;
    c.op = hull ? LW_UPSERT : ops[op % 8];
    c.count = hull ? 1 : op / 16;
    for (int i = 0; i < c.count; i++)
        c.obstacle[i] = next_obstacle(in, model_id((first + 7 * i) % MODEL_IDS));
    if (hull) {
        c.obstacle[0].shape = LW_HULL;
        c.obstacle[0].radius = 0;
        memset(c.obstacle[0].size, 0, sizeof c.obstacle[0].size);
        c.vertex_count = 1 + op / 16 * 4 + seq % 4;
        c.vertex[0] = first;
    }
    c.time_ns = time % 16;
    c.valid_for_ms = c.time_ns > 0 && time / 128 ? 1 : 0;
    c.time_ns += c.time_ns > 0 ? time / 16 % 8 * INT64_C(1000000) : 0;
    const int64_t newest = newest_of(c.stamp.session, (int)lw_change_channel(&c));
    c.stamp.seq = seq % 8 != 0 ? newest + 1 : 1 + seq / 8;
    return c;
}

// --- rules ---

// What the world holds beside what the records say.
struct old {
    int count, chunks;
    uint64_t digest;
};

static bool is_named(const struct lw_obstacle_change *c, int id)
{
    for (int i = 0; i < c->count; i++)
        if (c->obstacle[i].id == id)
            return true;
    return false;
}

// Whether there is room for what a change leads to.
static bool has_room(const struct record *after, int old_count, int old_chunks)
{
    int count = old_count, chunks = old_chunks;
    for (int id = 0; id < MODEL_IDS; id++) {
        count += after[id].owner != 0;
        chunks += (int)(after[id].vertex_count + LW_CHUNK - 1) / LW_CHUNK;
    }
    return count <= LW_WORLD_MAX && chunks <= LW_WORLD_CHUNKS;
}

// The record that has to make room first: over by the time that the change tells, for longest, then by id.
static struct record *oldest(struct record *after, const struct lw_obstacle_change *c)
{
    struct record *found = NULL;
    for (int id = 0; id < MODEL_IDS; id++) {
        struct record *r = &after[id];
        const bool over = r->owner != 0 && r->expires_ns != 0 && c->time_ns != 0 && r->expires_ns <= c->time_ns;
        if (over && !is_named(c, r->obstacle.id) &&
            (found == NULL || r->expires_ns < found->expires_ns ||
             (r->expires_ns == found->expires_ns && r->obstacle.id < found->obstacle.id)))
            found = r;
    }
    return found;
}

// Drops such records until there is room. Returns whether there is.
static bool make_room(struct record *after, const struct old *left, const struct lw_obstacle_change *c)
{
    while (!has_room(after, left->count, left->chunks)) {
        struct record *r = model_adds(c) ? oldest(after, c) : NULL;
        if (r == NULL)
            return false;
        *r = (struct record){.owner = 0};
    }
    return true;
}

// --- telling ---

// What is told rebuilds the set: from an empty world, one message after the other.
static void check_telling(void)
{
    static struct lw_tell tell;
    struct lw_obstacle_change c;
    static const struct lw_world empty;
    int64_t seq = 0;
    lw_world_copy(&empty, &rebuilt);
    lw_tell_begin(&tell, &world, 0);
    while (lw_tell_next(&tell, &world, &c)) {
        c.stamp = (struct lw_stamp){.session = 77, .seq = ++seq}; // one clock judges all: earlier ones first
        c.valid_for_ms = 0;
        CHECK(lw_world_apply(&rebuilt, &c) == LW_OK);
    }
    CHECK(rebuilt.count == world.count && rebuilt.chunks_used == world.chunks_used);
}

// --- entry ---

static void check_world(const struct record *records, const struct old *old)
{
    struct model_sum sum;
    CHECK(model_matches(&world, records, &sum));
    CHECK(world.count == old->count + sum.count && world.chunks_used == old->chunks + sum.chunks);
    CHECK((uint64_t)world.digest == old->digest + sum.digest);
}

// What has to come of a change; `after` is what it would lead to, and loses what makes room for
// it; `left` is what it would leave of the old.
static enum lw_status expect(struct record *records, struct record *after, const struct old *left,
                             const struct lw_obstacle_change *c)
{
    const int64_t newest = newest_of(c->stamp.session, (int)lw_change_channel(c));
    if (c->stamp.seq <= newest)
        return c->stamp.seq < newest ? LW_E_OLD : LW_OK;
    if (model_is_unknown(records, c))
        return LW_E_UNKNOWN;
    return make_room(after, left, c) ? LW_OK : LW_E_FULL;
}

// Applies a change to world and records, and compares them.
static void apply(struct record *records, struct old *old, const struct lw_obstacle_change *c)
{
    static struct record after[MODEL_IDS];
    const struct old left = c->op == LW_CLEAR ? (struct old){0} : *old;
    const bool is_new = c->stamp.seq > newest_of(c->stamp.session, (int)lw_change_channel(c));
    const int64_t version = world.version;
    memcpy(after, records, sizeof after);
    model_apply(after, c);
    const enum lw_status expected = expect(records, after, &left, c);
    CHECK(lw_world_apply(&world, c) == expected);
    if (expected == LW_OK && is_new) {
        memcpy(records, after, sizeof after);
        *old = left;
        CHECK(world.last.seq == c->stamp.seq && world.version >= version);
    } else {
        CHECK(world.version == version);
    }
    check_world(records, old);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct bytes in = {data, size};
    static struct record records[MODEL_IDS];
    memset(records, 0, sizeof records);
    begin(next_byte(&in) % 16);
    struct old old = {world.count, world.chunks_used, (uint64_t)world.digest};
    while (in.size > 0) {
        const struct lw_obstacle_change c = next_change(&in);
        apply(records, &old, &c);
    }
    if (old.count == 0)
        check_telling();
    return 0;
}
