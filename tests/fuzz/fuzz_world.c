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
            return world->sender[i].seq[LW_WORLD_OBSTACLES];
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
            .id = 1 + (first + i * step) % IDS, .p = {variant, i, 0}, .quat = {1}, .radius = variant % 3};
    return change;
}

// --- rules ---

// Obstacles and their owners by id, NULL = none.
struct table {
    const struct lw_obstacle *at[IDS + 1];
    int64_t owner[IDS + 1];
};

//   owner   in  [count] NULL = session
static struct table by_id(const struct lw_obstacle *obstacle, const int64_t *owner, int64_t session, int count)
{
    struct table table = {0};
    for (int i = 0; i < count; i++) {
        CHECK(obstacle[i].id > 0 && obstacle[i].id <= IDS && table.at[obstacle[i].id] == NULL);
        table.at[obstacle[i].id] = &obstacle[i];
        table.owner[obstacle[i].id] = owner != NULL ? owner[i] : session;
    }
    return table;
}

static struct table set_of(const struct lw_world *world)
{
    return by_id(world->obstacle, world->owner, 0, world->count);
}

static bool same(const struct lw_obstacle *a, const struct lw_obstacle *b)
{
    return a->p[0] == b->p[0] && a->p[1] == b->p[1] && a->p[2] == b->p[2] && a->radius == b->radius;
}

// Whether what stood under an id before stays there when a change is taken that does not overwrite it.
static bool stays(const struct lw_obstacle_change *change, int64_t owner, bool is_listed)
{
    switch (change->op) {
    case LW_UPSERT: return true;
    case LW_REPLACE: return owner != change->stamp.session;
    case LW_REMOVE: return !is_listed;
    case LW_CLEAR: break;
    }
    return false;
}

// Works out the set that a change leaves, perhaps more than there is room for. Returns the number of obstacles.
static int expect_all(const struct lw_world *before, const struct lw_obstacle_change *change, struct table *out)
{
    const struct table old = set_of(before);
    const struct table listed = by_id(change->obstacle, NULL, change->stamp.session, change->count);
    const bool puts = change->op == LW_UPSERT || change->op == LW_REPLACE;
    int count = 0;
    for (int id = 1; id <= IDS; id++) {
        const bool new = puts && listed.at[id] != NULL;
        const bool kept = !new && old.at[id] != NULL && stays(change, old.owner[id], listed.at[id] != NULL);
        out->at[id] = new ? listed.at[id] : kept ? old.at[id] : NULL;
        out->owner[id] = new ? listed.owner[id] : old.owner[id];
        count += new || kept;
    }
    return count;
}

static void check_set(const struct lw_world *after, const struct table *expected)
{
    const struct table found = set_of(after);
    for (int id = 1; id <= IDS; id++) {
        CHECK((found.at[id] != NULL) == (expected->at[id] != NULL));
        if (found.at[id] == NULL)
            continue;
        CHECK(same(found.at[id], expected->at[id]));
        CHECK(found.owner[id] == expected->owner[id]);
    }
}

// Whether what is expected is what stood there before.
static bool is_same_set(const struct lw_world *before, const struct table *expected)
{
    const struct table old = set_of(before);
    for (int id = 1; id <= IDS; id++) {
        const struct lw_obstacle *a = old.at[id], *b = expected->at[id];
        if ((a == NULL) != (b == NULL) || (a != NULL && (!same(a, b) || old.owner[id] != expected->owner[id])))
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
    struct table expected = {0};
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
        check_set(world, &expected);
        check_taken(&before, world, change, is_same_set(&before, &expected));
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
