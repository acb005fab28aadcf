// SPDX-License-Identifier: BSD-3-Clause
// Tests of the world: any sequence of changes against the plainest model of its rules, one record for each id.
//
// Units    metres.
// Frames   base frame.
// Arrays   none.
// Memory   static: a world is large.
// Errors   cmocka's.
#include "collision/world.h"
#include "helpers.h"
#include "world_changes.h" // ball, change, apply

enum { IDS = 40, SOURCES = 4 };

// What is known of an id; owner 0 = it is not there.
struct record {
    struct lw_obstacle obstacle;
    int64_t owner, time_ns, expires_ns;
    int64_t vertex_count;
};

static int spread_id(int i)
{
    return 1 + 32768 * (i % 5) + i / 5; // many ids that want to stand in one another's place
}

// A change of a few obstacles, most often of those with the next number.
static struct lw_obstacle_change any_change(struct random *random, int64_t now_ns)
{
    static int64_t seq = 0;
    const int kind = random_below(random, 40);
    const int64_t session = 1 + random_below(random, SOURCES);
    struct lw_obstacle_change c = hull(session, ++seq, spread_id(random_below(random, IDS)), 1 + kind);
    if (kind >= 8) {
        c.vertex_count = 0;
        c.op = kind == 39 ? LW_CLEAR : kind > 30 ? LW_REPLACE : kind > 22 ? LW_REMOVE : LW_UPSERT;
        c.count = random_below(random, 7);
        const int first = random_below(random, IDS);
        for (int i = 0; i < c.count; i++) {
            c.obstacle[i] = any_solid(random, spread_id((first + 7 * i) % IDS));
            if (random_below(random, 4) == 0)
                c.obstacle[i].shape = LW_HULL;
        }
    }
    if (random_below(random, 3)) {
        c.time_ns = now_ns - random_below(random, 3);
        c.valid_for_ms = random_below(random, 4);
    }
    return c;
}

static struct record *named(struct record *records, const struct lw_obstacle_change *change, int i)
{
    int id = 0;
    while (spread_id(id) != change->obstacle[i].id)
        id++;
    assert_true(id < IDS);
    return &records[id];
}

static bool is_unknown(struct record *records, const struct lw_obstacle_change *change)
{
    const bool adds = change->op == LW_UPSERT || change->op == LW_REPLACE;
    for (int i = 0; adds && i < change->count; i++)
        if (change->obstacle[i].shape == LW_HULL && change->vertex_count == 0 &&
            named(records, change, i)->vertex_count == 0)
            return true;
    return false;
}

// Whether what stands under an id outlives a change.
static bool is_kept(const struct record *r, const struct lw_obstacle_change *change, bool listed)
{
    const bool own = r->owner == change->stamp.session;
    const bool over = own && r->expires_ns != 0 && change->time_ns != 0 && r->expires_ns <= change->time_ns;
    if (change->op == LW_CLEAR)
        return false;
    if (listed)
        return change->op != LW_REMOVE;
    return !over && !(change->op == LW_REPLACE && own);
}

// What a change does by the rules.
static void model(struct record *records, const struct lw_obstacle_change *change)
{
    bool listed[IDS] = {false};
    const bool adds = change->op == LW_UPSERT || change->op == LW_REPLACE;
    for (int i = 0; i < change->count; i++)
        listed[named(records, change, i) - records] = true;
    for (int id = 0; id < IDS; id++)
        if (!is_kept(&records[id], change, listed[id]))
            records[id] = (struct record){.owner = 0};
    for (int i = 0; adds && i < change->count; i++) {
        struct record *r = named(records, change, i);
        const bool hull = change->obstacle[i].shape == LW_HULL;
        const int64_t vertices = !hull ? 0 : change->vertex_count > 0 ? change->vertex_count : r->vertex_count;
        *r = (struct record){change->obstacle[i], change->stamp.session, change->time_ns, lw_change_expires_ns(change),
                             vertices};
    }
}

static void compare(const struct lw_world *world, const struct record *records)
{
    int count = 0, chunks = 0;
    uint64_t sum = 0;
    for (int id = 0; id < IDS; id++) {
        const struct record *r = &records[id];
        const int at = lw_world_find(world, spread_id(id));
        assert_int_equal(at >= 0, r->owner != 0);
        if (at < 0)
            continue;
        const struct lw_world_entry *entry = &world->entry[at];
        assert_same_bits(&entry->obstacle, &r->obstacle, sizeof r->obstacle);
        assert_true(world->owner[at] == r->owner && world->expires_ns[at] == r->expires_ns);
        assert_true(entry->time_ns == r->time_ns && entry->vertex_count == r->vertex_count);
        count++;
        chunks += (int)(r->vertex_count + LW_CHUNK - 1) / LW_CHUNK;
        sum += entry->digest;
    }
    assert_int_equal(world->count, count);
    assert_int_equal(world->chunks_used, chunks);
    assert_int_equal(world->digest, (int64_t)sum);
}

static void random_changes_match_a_plain_model(void **state)
{
    (void)state;
    struct random random = {42};
    static struct record records[IDS], older[IDS];
    struct lw_world *world = empty_world();
    int unknown = 0;
    for (int n = 1; n <= 20000; n++) {
        const struct lw_obstacle_change c = any_change(&random, INT64_C(1000000) * (1 + n / 4));
        const int64_t version = world->version, digest = world->digest;
        const bool refused = is_unknown(records, &c);
        assert_int_equal(lw_world_apply(world, &c), refused ? LW_E_UNKNOWN : LW_OK);
        unknown += refused;
        memcpy(older, records, sizeof older);
        if (!refused)
            model(records, &c);
        compare(world, records);
        // As bytes: vertices go with the id and their number.
        const bool same = memcmp((const void *)older, (const void *)records, sizeof older) == 0;
        if (!same || refused)
            assert_int_equal(world->version, version + !refused);
        if (same && world->version == version)
            assert_int_equal(world->digest, digest);
    }
    assert_true(unknown > 100 && world->version > 1000);
}

// The digest is that of the set, whatever way led to it.
static void every_way_to_a_set_has_its_digest(void **state)
{
    (void)state;
    struct random random = {47};
    static struct lw_world other;
    struct lw_world *world = empty_world();
    for (int round = 0; round < 200; round++) {
        int64_t seq = 1000 * (round + 1);
        memset(&other, 0, sizeof other);
        for (int n = 0; n < 30; n++) {
            const struct lw_obstacle_change c = any_change(&random, 1000000);
            (void)(lw_world_apply(world, &c) == LW_OK);
        }
        // The same obstacles, told to an empty world from the last to the first.
        for (int at = world->count - 1; at >= 0; at--) {
            const struct lw_world_entry *entry = &world->entry[at];
            struct lw_obstacle_change c = change(99, ++seq, LW_UPSERT, entry->obstacle, none);
            c.time_ns = entry->time_ns;
            c.valid_for_ms = (int)((world->expires_ns[at] - (world->expires_ns[at] ? entry->time_ns : 0)) / 1000000);
            c.vertex_count = lw_world_vertices(world, entry, c.vertex);
            assert_int_equal(lw_world_apply(&other, &c), LW_OK);
        }
        assert_int_equal(other.count, world->count);
        assert_int_equal(other.digest, world->digest);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(random_changes_match_a_plain_model),
        cmocka_unit_test(every_way_to_a_set_has_its_digest),
    };
    return cmocka_run_group_tests_name("world_random", tests, NULL, NULL);
}
