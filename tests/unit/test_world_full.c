// SPDX-License-Identifier: BSD-3-Clause
// Tests of the world's limits: the last place can be used, and what needs one more is refused whole.
//
// Units    metres.
// Frames   base frame.
// Arrays   none.
// Memory   static: a world is large.
// Errors   cmocka's.
#include "collision/world.h"
#include "helpers.h"
#include "world_changes.h" // ball, change, apply

static struct lw_world before;

// A refusal leaves every byte as it was, padding too.
static void refuse(struct lw_world *world, const struct lw_obstacle_change *change, enum lw_status expected)
{
    memcpy(&before, world, sizeof before);
    assert_int_equal(lw_world_apply(world, change), expected);
    assert_same_bits(world, &before, sizeof before);
}

// Obstacles 1..count in messages as large as they can be.
static void fill(struct lw_world *world, int64_t session, int count)
{
    for (int id = 1; id <= count;) {
        struct lw_obstacle_change c = change(session, world->last.seq + 1, LW_UPSERT, none, none);
        while (c.count < LW_CHANGE_MAX && id <= count) {
            c.obstacle[c.count++] = ball(id, id % 100);
            id++;
        }
        assert_int_equal(lw_world_apply(world, &c), LW_OK);
    }
    assert_int_equal(world->count, count);
}

static void the_ten_thousand_and_first_is_refused(void **state)
{
    (void)state;
    static struct lw_snapshot snapshot;
    struct lw_world *world = empty_world();
    fill(world, MINE, LW_WORLD_MAX - 1);
    struct lw_obstacle_change c = change(YOURS, 1, LW_UPSERT, ball(90001, 1), ball(90002, 2));
    refuse(world, &c, LW_E_FULL);
    apply(world, YOURS, LW_UPSERT, ball(90001, 1), none);
    assert_int_equal(world->count, LW_WORLD_MAX);
    apply(world, YOURS, LW_UPSERT, ball(90001, 5), ball(1, 5)); // overwriting needs no room
    assert_near(get(world, 1).p[0], 5, 0);
    c = change(MINE, INT64_MAX, LW_UPSERT, ball(2, 8), ball(90003, 2));
    refuse(world, &c, LW_E_FULL);
    for (int id = 1; id < LW_WORLD_MAX; id++)
        assert_int_equal(get(world, id).id, id);
    assert_int_equal(lw_world_build(world, &snapshot), LW_OK);
    assert_int_equal(snapshot.count, LW_WORLD_MAX);
}

// A replacement frees its sender's places before it takes new ones, and so does a message of a later time.
static void what_goes_makes_room_first(void **state)
{
    (void)state;
    struct lw_world *world = empty_world();
    fill(world, MINE, LW_WORLD_MAX);
    struct lw_obstacle_change c = change(YOURS, 1, LW_REPLACE, ball(90001, 1), ball(90002, 1));
    refuse(world, &c, LW_E_FULL); // these are not yours
    apply(world, MINE, LW_REPLACE, ball(90001, 1), ball(2, 1));
    assert_int_equal(world->count, 2);

    fill(empty_world(), MINE, LW_WORLD_MAX - 1);
    struct lw_obstacle_change first = change(YOURS, 1, LW_UPSERT, ball(90001, 1), none);
    first.time_ns = first.valid_for_ms = 1;
    assert_int_equal(lw_world_apply(world, &first), LW_OK);
    struct lw_obstacle_change second = change(YOURS, 2, LW_UPSERT, ball(90002, 1), none);
    second.time_ns = 1000000;
    refuse(world, &second, LW_E_FULL);
    second.time_ns++;
    assert_int_equal(lw_world_apply(world, &second), LW_OK);
    assert_int_equal(get(world, 90001).id, 0);
    struct lw_obstacle_change third = change(YOURS, 3, LW_UPSERT, ball(90002, 1), ball(90003, 1));
    third.time_ns = second.time_ns;
    refuse(world, &third, LW_E_FULL);
}

// A change of one ball that expires after 1 ms.
static struct lw_obstacle_change brief(int64_t session, int64_t seq, int id, int64_t time_ns)
{
    struct lw_obstacle_change c = change(session, seq, LW_UPSERT, ball(id, 1), none);
    c.time_ns = time_ns;
    c.valid_for_ms = 1;
    return c;
}

// A source that died leaves 10,000 obstacles that are over: they make room, oldest first, as far as it is needed.
static void what_is_over_makes_room_for_others(void **state)
{
    (void)state;
    struct lw_world *world = empty_world();
    const int64_t ms = 1000000;
    for (int id = 1; id <= LW_WORLD_MAX; id++) { // 1 and 2 are over last of those that are, 3 and 4 first
        const struct lw_obstacle_change c = brief(MINE + 2 + id, 1, id, id <= 2 ? 3 * ms : id > 4 ? 9 * ms : ms);
        assert_int_equal(lw_world_apply(world, &c), LW_OK);
    }
    struct lw_obstacle_change c = brief(YOURS, 1, 90001, 2 * ms - 1); // nothing is over yet
    refuse(world, &c, LW_E_FULL);
    c = change(YOURS, 2, LW_UPSERT, ball(90001, 1), none); // tells no time
    refuse(world, &c, LW_E_FULL);
    c = brief(YOURS, 3, 90001, INT64_C(1800000000) * 1000 * ms); // goes by the calendar
    refuse(world, &c, LW_E_FULL);
    c = change(YOURS, 4, LW_UPSERT, ball(90001, 1), ball(4, 1)); // one place is short, and 4 is named itself
    c.time_ns = 4 * ms;
    assert_int_equal(lw_world_apply(world, &c), LW_OK);
    assert_int_equal(world->count, LW_WORLD_MAX);
    assert_int_equal(get(world, 3).id, 0);
    c = brief(YOURS, 5, 90002, 4 * ms);
    assert_int_equal(lw_world_apply(world, &c), LW_OK);
    assert_int_equal(get(world, 1).id, 0); // of two alike that with the lower id
    assert_int_equal(get(world, 2).id, 2);
    c = change(YOURS, 6, LW_UPSERT, ball(90003, 1), ball(90004, 1)); // there is one place only
    c.time_ns = 4 * ms;
    refuse(world, &c, LW_E_FULL);
    for (int id = 4; id <= LW_WORLD_MAX; id++)
        assert_int_equal(get(world, id).id, id);
}

// The vertices of what is over make room, too.
static void vertices_that_are_over_make_room(void **state)
{
    (void)state;
    enum { FULL_HULLS = LW_WORLD_VERTICES / LW_HULL_MAX };
    struct lw_world *world = empty_world();
    for (int id = 1; id <= FULL_HULLS; id++) {
        struct lw_obstacle_change c = hull(MINE, id, id, LW_HULL_MAX);
        c.time_ns = c.valid_for_ms = id == 9 ? 1 : 0;
        assert_int_equal(lw_world_apply(world, &c), LW_OK);
    }
    struct lw_obstacle_change c = hull(YOURS, 1, 90001, LW_HULL_MAX);
    refuse(world, &c, LW_E_FULL);
    c.time_ns = 2000000;
    assert_int_equal(lw_world_apply(world, &c), LW_OK);
    assert_int_equal(world->chunks_used, LW_WORLD_CHUNKS);
    assert_int_equal(get(world, 9).id, 0);
    c = hull(YOURS, 2, 90002, 1);
    c.time_ns = 2000000;
    refuse(world, &c, LW_E_FULL);
}

// Vertices count in fours. Those that a hull had are there for its new ones.
static void vertices_have_their_own_limit(void **state)
{
    (void)state;
    enum { FULL_HULLS = LW_WORLD_VERTICES / LW_HULL_MAX };
    static struct lw_snapshot snapshot;
    struct lw_world *world = empty_world();
    for (int id = 1; id <= FULL_HULLS; id++) {
        const struct lw_obstacle_change c = hull(MINE, id, id, id == FULL_HULLS ? 60 : 61 + id % 4);
        assert_int_equal(lw_world_apply(world, &c), LW_OK);
    }
    assert_int_equal(world->chunks_used, LW_WORLD_CHUNKS - 1);
    struct lw_obstacle_change c = hull(YOURS, 1, 90001, 5);
    refuse(world, &c, LW_E_FULL);
    c = hull(YOURS, 2, 90001, 4);
    assert_int_equal(lw_world_apply(world, &c), LW_OK);
    c = hull(MINE, FULL_HULLS + 1, FULL_HULLS, 61);
    refuse(world, &c, LW_E_FULL);
    apply(world, MINE, LW_UPSERT, ball(5, 1), none); // a ball has none
    c = hull(YOURS, 3, 90001, 64);
    assert_int_equal(lw_world_apply(world, &c), LW_OK);
    c = hull(YOURS, 4, 90001, 63); // its own make room
    assert_int_equal(lw_world_apply(world, &c), LW_OK);
    assert_int_equal(lw_world_build(world, &snapshot), LW_OK);
    assert_int_equal(snapshot.count, FULL_HULLS + 1);
    double vertex[3 * LW_HULL_MAX];
    for (int id = 6; id < FULL_HULLS; id++) {
        const struct lw_obstacle_change told = hull(MINE, 1, id, 61 + id % 4);
        assert_int_equal(vertices_of(world, id, vertex), told.vertex_count);
        assert_same_bits(vertex, told.vertex, 3 * (size_t)told.vertex_count * sizeof vertex[0]);
    }
    apply(world, MINE, LW_CLEAR, none, none);
    assert_int_equal(world->chunks_used, 0);
}

// Ten thousand hulls come and go, each time of another size: no vertex gets lost, and none is another's.
static void vertices_are_given_back(void **state)
{
    (void)state;
    struct random random = {46};
    struct lw_world *world = empty_world();
    int count[200] = {0};
    for (int n = 1; n <= 10000; n++) {
        const int id = 1 + random_below(&random, 200);
        struct lw_obstacle_change c = hull(MINE, n, id, 1 + random_below(&random, LW_HULL_MAX));
        if (count[id - 1] != 0 && random_below(&random, 3) == 0) {
            c = change(YOURS, n, LW_REMOVE, ball(id, 0), none);
            c.vertex_count = 0;
        }
        assert_int_equal(lw_world_apply(world, &c), LW_OK);
        count[id - 1] = c.vertex_count;
        int chunks = 0;
        for (int i = 0; i < 200; i++)
            chunks += (count[i] + LW_CHUNK - 1) / LW_CHUNK;
        assert_int_equal(world->chunks_used, chunks);
        assert_true(world->chunks_touched <= 200 * LW_HULL_MAX / LW_CHUNK);
    }
    double vertex[3 * LW_HULL_MAX];
    for (int id = 1; id <= 200; id++) {
        const struct lw_obstacle_change told = hull(MINE, 1, id, count[id - 1]);
        assert_int_equal(vertices_of(world, id, vertex), count[id - 1]);
        assert_same_bits(vertex, told.vertex, 3 * (size_t)count[id - 1] * sizeof vertex[0]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_ten_thousand_and_first_is_refused), cmocka_unit_test(what_goes_makes_room_first),
        cmocka_unit_test(what_is_over_makes_room_for_others),    cmocka_unit_test(vertices_that_are_over_make_room),
        cmocka_unit_test(vertices_have_their_own_limit),         cmocka_unit_test(vertices_are_given_back),
    };
    return cmocka_run_group_tests_name("world_full", tests, NULL, NULL);
}
