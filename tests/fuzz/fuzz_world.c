// SPDX-License-Identifier: BSD-3-Clause
// Fuzz target: obstacle messages of several senders merged into one world. After each message the world holds what
// the rules of collision/world.h say, worked out here obstacle by obstacle from the world before.
//
// Units    metres.
// Frames   base frame.
// Arrays   see collision/world.h.
// Memory   static: a world is large.
// Errors   see fuzz.h.
#include "collision/world.h"
#include "fuzz.h"
#include "tests/unit/wire_ranges.h" // within

#include <string.h> // memcmp

// More ids and senders than a world has room for.
enum { IDS = 307, SESSIONS = 40 };

// --- messages ---

static int64_t newest_of(const struct lw_world *world, int64_t session)
{
    for (int i = 0; i < LW_SENDERS_MAX; i++)
        if (world->sender[i].session == session)
            return world->sender[i].seq;
    return 0;
}

// A valid message out of six bytes, most often the next one of its sender. Ids step through a prime number of them, so
// that none stands twice. Obstacles come more often than they go, or the world would never be full.
static struct lw_obstacle_change next_change(struct bytes *in, const struct lw_world *world)
{
    static const enum lw_change_op ops[] = {LW_UPSERT, LW_UPSERT,  LW_UPSERT, LW_UPSERT,
                                            LW_UPSERT, LW_REPLACE, LW_REMOVE, LW_CLEAR};
    struct lw_obstacle_change change = {.stamp = {.session = 1 + next_byte(in) % SESSIONS}};
    const int op = next_byte(in), seq = next_byte(in), variant = op / 8;
    change.op = ops[op % 8];
    change.stamp.seq = seq % 4 != 0 ? newest_of(world, change.stamp.session) + 1 : 1 + seq / 4;
    change.count = next_byte(in) % (LW_CHANGE_MAX + 1);
    const int first = next_byte(in), step = 1 + next_byte(in);
    for (int i = 0; i < change.count; i++)
        change.obstacle[i] = (struct lw_obstacle){
            .id = 1 + (first + i * step) % IDS, .p = {variant, i, 0}, .radius = variant % 3, .session = -1};
    return change;
}

// --- rules ---

// Obstacles by id, NULL = none.
struct table {
    const struct lw_obstacle *at[IDS + 1];
};

static struct table by_id(const struct lw_obstacle *obstacle, int count)
{
    struct table table = {{NULL}};
    for (int i = 0; i < count; i++) {
        CHECK(obstacle[i].id > 0 && obstacle[i].id <= IDS && table.at[obstacle[i].id] == NULL);
        table.at[obstacle[i].id] = &obstacle[i];
    }
    return table;
}

static bool same(const struct lw_obstacle *a, const struct lw_obstacle *b)
{
    return a->p[0] == b->p[0] && a->p[1] == b->p[1] && a->p[2] == b->p[2] && a->radius == b->radius;
}

// What must stand under an id when a change was taken, NULL = nothing.
//   old     what stood there before
//   listed  what the change says of this id
static const struct lw_obstacle *expect(const struct lw_obstacle_change *change, const struct lw_obstacle *old,
                                        const struct lw_obstacle *listed)
{
    switch (change->op) {
    case LW_UPSERT: return listed != NULL ? listed : old;
    case LW_REPLACE: return listed != NULL ? listed : old != NULL && old->session == change->stamp.session ? NULL : old;
    case LW_REMOVE: return listed != NULL ? NULL : old;
    case LW_CLEAR: break;
    }
    return NULL;
}

// Works out the set that a change leaves, perhaps more than there is room for. Returns the number of obstacles.
static int expect_all(const struct lw_world *before, const struct lw_obstacle_change *change, struct table *out)
{
    const struct table old = by_id(before->obstacle, before->count);
    const struct table listed = by_id(change->obstacle, change->count);
    int count = 0;
    for (int id = 1; id <= IDS; id++) {
        out->at[id] = expect(change, old.at[id], listed.at[id]);
        count += out->at[id] != NULL;
    }
    return count;
}

// The messages of this target name session -1: whoever sends an obstacle owns it.
static int64_t owner_of(const struct lw_obstacle *obstacle, const struct lw_obstacle_change *change)
{
    return obstacle->session == -1 ? change->stamp.session : obstacle->session;
}

static void check_set(const struct lw_world *after, const struct lw_obstacle_change *change,
                      const struct table *expected)
{
    const struct table found = by_id(after->obstacle, after->count);
    for (int id = 1; id <= IDS; id++) {
        CHECK((found.at[id] != NULL) == (expected->at[id] != NULL));
        if (found.at[id] == NULL)
            continue;
        CHECK(same(found.at[id], expected->at[id]));
        CHECK(found.at[id]->session == owner_of(expected->at[id], change));
    }
}

// Whether what is expected is what stood there before.
static bool is_same_set(const struct lw_world *before, const struct lw_obstacle_change *change,
                        const struct table *expected)
{
    const struct table old = by_id(before->obstacle, before->count);
    for (int id = 1; id <= IDS; id++) {
        const struct lw_obstacle *a = old.at[id], *b = expected->at[id];
        if ((a == NULL) != (b == NULL) || (a != NULL && (!same(a, b) || a->session != owner_of(b, change))))
            return false;
    }
    return true;
}

// The version counts changes of the set; hearing anything at all is version 1.
static void check_taken(const struct lw_world *before, const struct lw_world *after,
                        const struct lw_obstacle_change *change, bool is_same)
{
    CHECK(newest_of(after, change->stamp.session) == change->stamp.seq);
    CHECK(after->last.session == change->stamp.session && after->last.seq == change->stamp.seq);
    CHECK(after->version == before->version + (!is_same || before->version == 0));
    CHECK(!is_same || before->version == 0 || after->digest == before->digest);
}

// --- entry ---

static void apply(struct lw_world *world, const struct lw_obstacle_change *change)
{
    static struct lw_world before;
    struct table expected = {{NULL}};
    memcpy(&before, world, sizeof before);
    const int64_t newest = newest_of(&before, change->stamp.session);
    const int count = expect_all(&before, change, &expected);
    const bool is_old = change->stamp.seq<newest, is_new = change->stamp.seq> newest;
    const bool is_full = is_new && count > LW_WORLD_MAX;
    const enum lw_status status = lw_world_apply(world, change);
    CHECK(status == (is_old ? LW_E_OLD : is_full ? LW_E_FULL : LW_OK));
    if (status != LW_OK) {
        // Bytes, because nothing at all may have been touched.
        CHECK(memcmp((const void *)world, (const void *)&before, sizeof before) == 0);
    } else if (is_new) {
        check_set(world, change, &expected);
        check_taken(&before, world, change, is_same_set(&before, change, &expected));
    } else {
        CHECK(world->version == before.version && world->count == before.count && world->digest == before.digest);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct bytes in = {data, size};
    static struct lw_world world;
    memset(&world, 0, sizeof world);
    while (in.size > 0) {
        const struct lw_obstacle_change change = next_change(&in, &world);
        apply(&world, &change);
    }
    for (int i = 0; i < world.count; i++) {
        double away[3];
        const double distance = lw_obstacle_distance(&world.obstacle[i], world.obstacle[0].p, away);
        CHECK(isfinite(distance) && distance >= -world.obstacle[i].radius && within(away, 3, 1));
    }
    return 0;
}
