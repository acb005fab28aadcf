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
#include "world_model.h"   // model_*

enum { SOURCES = 4 };

// A change of a few obstacles, most often of those with the next number.
static struct lw_obstacle_change any_change(struct random *random, int64_t now_ns)
{
    static int64_t seq = 0;
    const int kind = random_below(random, 40);
    const int64_t session = 1 + random_below(random, SOURCES);
    struct lw_obstacle_change c = hull(session, ++seq, model_id(random_below(random, MODEL_IDS)), 1 + kind);
    if (kind >= 8) {
        c.vertex_count = 0;
        c.op = kind == 39 ? LW_CLEAR : kind > 30 ? LW_REPLACE : kind > 22 ? LW_REMOVE : LW_UPSERT;
        c.count = random_below(random, 7);
        const int first = random_below(random, MODEL_IDS);
        for (int i = 0; i < c.count; i++) {
            c.obstacle[i] = any_solid(random, model_id((first + 7 * i) % MODEL_IDS));
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

static void compare(const struct lw_world *world, const struct record *records)
{
    struct model_sum sum;
    assert_true(model_matches(world, records, &sum));
    assert_int_equal(world->count, sum.count);
    assert_int_equal(world->chunks_used, sum.chunks);
    assert_int_equal(world->digest, (int64_t)sum.digest);
}

static void random_changes_match_a_plain_model(void **state)
{
    (void)state;
    struct random random = {42};
    static struct record records[MODEL_IDS], older[MODEL_IDS];
    struct lw_world *world = empty_world();
    int unknown = 0;
    for (int n = 1; n <= 20000; n++) {
        const struct lw_obstacle_change c = any_change(&random, INT64_C(1000000) * (1 + n / 4));
        const int64_t version = world->version, digest = world->digest;
        const bool refused = model_is_unknown(records, &c);
        assert_int_equal(lw_world_apply(world, &c), refused ? LW_E_UNKNOWN : LW_OK);
        unknown += refused;
        memcpy(older, records, sizeof older);
        if (!refused)
            model_apply(records, &c);
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
