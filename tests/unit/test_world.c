// SPDX-License-Identifier: BSD-3-Clause
// Tests of the world: what each operation of each source does to the set of obstacles, and that refused changes and
// changes that change nothing leave it as it was. test_world_full.c has its limits, test_world_random.c any sequence.
//
// Units    metres.
// Frames   base frame.
// Arrays   none.
// Memory   static where worlds are large.
// Errors   cmocka's.
#include "collision/world.h"
#include "helpers.h"
#include "world_changes.h" // ball, change, apply

// --- operations ---

static void upsert_adds_and_overwrites_by_id(void **state)
{
    (void)state;
    struct lw_world *world = empty_world();
    apply(world, MINE, LW_UPSERT, ball(3, 1), ball(5, 2));
    assert_int_equal(world->count, 2);
    apply(world, MINE, LW_UPSERT, ball(5, 9), none);
    assert_int_equal(world->count, 2);
    assert_near(get(world, 5).p[1], 18, 0);
    assert_near(get(world, 5).radius, 0.1, 0);
    assert_near(get(world, 3).p[0], 1, 0);
}

// Anyone may remove anything; what is not there cannot be removed.
static void remove_reaches_every_source(void **state)
{
    (void)state;
    struct lw_world *world = empty_world();
    apply(world, MINE, LW_UPSERT, ball(3, 1), ball(5, 2));
    apply(world, YOURS, LW_REMOVE, ball(3, 0), ball(99, 0));
    assert_int_equal(world->count, 1);
    assert_int_equal(get(world, 3).id, 0);
    assert_int_not_equal(get(world, 5).id, 0);
}

// Replace drops what its own sender sent before and leaves other sources alone.
static void replace_is_the_whole_set_of_one_source(void **state)
{
    (void)state;
    struct lw_world *world = empty_world();
    apply(world, MINE, LW_UPSERT, ball(1, 1), ball(2, 2));
    apply(world, YOURS, LW_UPSERT, ball(3, 3), none);
    apply(world, MINE, LW_REPLACE, ball(2, 7), ball(4, 4));
    assert_int_equal(world->count, 3);
    assert_int_equal(get(world, 1).id, 0);
    assert_near(get(world, 2).p[0], 7, 0);
    assert_near(get(world, 3).p[0], 3, 0);
    assert_int_not_equal(get(world, 4).id, 0);
    apply(world, MINE, LW_REPLACE, none, none);
    assert_int_equal(world->count, 1);
    assert_int_not_equal(get(world, 3).id, 0);
}

// Whoever sends an id last owns it: the old owner's replace no longer drops it, the new owner's does.
static void the_last_sender_owns_an_id(void **state)
{
    (void)state;
    struct lw_world *world = empty_world();
    apply(world, MINE, LW_UPSERT, ball(1, 1), none);
    apply(world, YOURS, LW_UPSERT, ball(1, 1), none); // same place, new owner
    assert_int_equal(owner_of(world, 1), YOURS);
    assert_int_equal(world->version, 2);
    apply(world, MINE, LW_REPLACE, ball(2, 2), none);
    assert_int_not_equal(get(world, 1).id, 0);
    apply(world, YOURS, LW_REPLACE, none, none);
    assert_int_equal(get(world, 1).id, 0);
    apply(world, YOURS, LW_REPLACE, ball(2, 2), none); // takes 2 over
    assert_int_equal(owner_of(world, 2), YOURS);
    assert_int_equal(world->count, 1);
}

static void clear_drops_everything_of_everyone(void **state)
{
    (void)state;
    struct lw_world *world = empty_world();
    apply(world, MINE, LW_UPSERT, ball(1, 1), none);
    apply(world, YOURS, LW_UPSERT, ball(2, 2), none);
    apply(world, 9, LW_CLEAR, ball(5, 5), none); // what it lists is ignored
    assert_int_equal(world->count, 0);
    assert_int_equal(lw_world_find(world, 1), -1);
}

// --- versions ---

// Hearing anything makes version 1, even when nothing is there; after that only a real difference counts.
static void the_version_counts_real_changes(void **state)
{
    (void)state;
    struct lw_world *world = empty_world();
    const struct {
        enum lw_change_op op;
        struct lw_obstacle a;
        int64_t version;
    } steps[] = {{LW_REPLACE, none, 1},        {LW_REPLACE, none, 1},       {LW_CLEAR, none, 1},
                 {LW_UPSERT, ball(1, 1), 2},   {LW_UPSERT, ball(1, 1), 2},  {LW_REPLACE, ball(1, 1), 2},
                 {LW_UPSERT, ball(1, 1.5), 3}, {LW_REMOVE, ball(2, 0), 3},  {LW_REMOVE, ball(1, 0), 4},
                 {LW_CLEAR, none, 4},          {LW_REPLACE, ball(4, 1), 5}, {LW_REPLACE, ball(5, 1), 6},
                 {LW_CLEAR, none, 7},          {LW_UPSERT, ball(1, 1), 8}};
    for (size_t i = 0; i < sizeof steps / sizeof steps[0]; i++) {
        apply(world, MINE, steps[i].op, steps[i].a, none);
        assert_int_equal(world->version, steps[i].version);
    }
}

// One difference in a message is enough, wherever it stands, and a message counts once however many it brings.
static void one_difference_makes_one_version(void **state)
{
    (void)state;
    struct lw_world *world = empty_world();
    apply(world, MINE, LW_UPSERT, ball(1, 1), ball(2, 2));
    assert_int_equal(world->version, 1);
    apply(world, MINE, LW_UPSERT, ball(1, 9), ball(2, 2)); // the first alone
    assert_int_equal(world->version, 2);
    apply(world, MINE, LW_UPSERT, ball(1, 9), ball(2, 9)); // the second alone
    assert_int_equal(world->version, 3);
    apply(world, MINE, LW_REPLACE, ball(2, 9), none); // only drops
    assert_int_equal(world->version, 4);
}

// Every number of an obstacle makes a difference, and so do the times of its message.
static void every_number_is_compared(void **state)
{
    (void)state;
    struct random random = {44};
    struct lw_obstacle o = ball(1, 1);
    double *const fields[] = {&o.p[0],    &o.p[1],   &o.p[2],     &o.quat[0],  &o.quat[1], &o.quat[2],
                              &o.quat[3], &o.radius, &o.size[0],  &o.size[1],  &o.size[2], &o.v[0],
                              &o.v[1],    &o.v[2],   &o.omega[0], &o.omega[1], &o.omega[2]};
    struct lw_world *world = empty_world();
    apply(world, MINE, LW_UPSERT, o, none);
    for (size_t f = 0; f < sizeof fields / sizeof fields[0]; f++) {
        *fields[f] += 1e-9 * (1 + random_in(&random, 0, 1));
        apply(world, MINE, LW_UPSERT, o, none);
        assert_int_equal(world->version, 2 + (int)f);
        const struct lw_obstacle found = get(world, 1);
        assert_same_bits(&found, &o, sizeof o);
    }
    const int64_t version = world->version;
    struct lw_obstacle_change c = change(MINE, world->last.seq + 1, LW_UPSERT, o, none);
    c.time_ns = 5;
    assert_int_equal(lw_world_apply(world, &c), LW_OK);
    c.stamp.seq++;
    c.valid_for_ms = 1;
    assert_int_equal(lw_world_apply(world, &c), LW_OK);
    c.stamp.seq++;
    assert_int_equal(lw_world_apply(world, &c), LW_OK); // nothing new
    assert_int_equal(world->version, version + 2);
    assert_int_equal(world->expires_ns[lw_world_find(world, 1)], 1000005);
}

// --- order ---

// What a sender has overtaken changes nothing; what it repeats changes nothing but is heard again, so that it ends
// waiting.
static void messages_of_a_sender_count_once_and_in_order(void **state)
{
    (void)state;
    struct lw_world *world = empty_world();
    const struct lw_obstacle_change first = change(MINE, 4, LW_UPSERT, ball(1, 1), none);
    const struct lw_obstacle_change second = change(MINE, 5, LW_UPSERT, ball(1, 2), none);
    const struct lw_obstacle_change other = change(YOURS, 1, LW_UPSERT, ball(2, 7), none);
    assert_int_equal(lw_world_apply(world, &second), LW_OK);
    assert_int_equal(lw_world_apply(world, &first), LW_E_OLD);
    assert_int_equal(lw_world_apply(world, &other), LW_OK);
    const int64_t version = world->version;
    assert_int_equal(lw_world_apply(world, &second), LW_OK);
    assert_true(world->last.session == MINE && world->last.seq == 5 && world->version == version);
    assert_near(get(world, 1).p[0], 2, 0);
    assert_int_equal(world->count, 2);
}

// Numbers count by channel: a sender's first hull comes after its hundredth message on OBSTACLES.
static void each_channel_has_its_own_order(void **state)
{
    (void)state;
    struct lw_world *world = empty_world();
    const struct lw_obstacle_change solid = change(MINE, 100, LW_UPSERT, ball(1, 1), none);
    const struct lw_obstacle_change first = hull(MINE, 1, 2, 8), second = hull(MINE, 2, 2, 9);
    assert_int_equal(lw_world_apply(world, &solid), LW_OK);
    assert_int_equal(world->last_channel, LW_WORLD_OBSTACLES);
    assert_int_equal(lw_world_apply(world, &second), LW_OK);
    assert_int_equal(world->last_channel, LW_WORLD_HULL);
    assert_int_equal(lw_world_apply(world, &first), LW_E_OLD);
    const struct lw_obstacle_change late = change(MINE, 99, LW_UPSERT, ball(1, 2), none);
    assert_int_equal(lw_world_apply(world, &late), LW_E_OLD);
    assert_int_equal(world->count, 2);
}

// More senders than are remembered: the one unheard for longest is forgotten, nothing else is lost.
static void quiet_senders_make_room_for_new_ones(void **state)
{
    (void)state;
    struct lw_world *world = empty_world();
    for (int k = 1; k <= LW_SENDERS_MAX + 1; k++) {
        const struct lw_obstacle_change c = change(1000 + k, 9, LW_UPSERT, ball(k, k), none);
        const struct lw_obstacle_change first = change(1001, 9 + k, LW_UPSERT, ball(1, k), none);
        assert_int_equal(lw_world_apply(world, &c), LW_OK);
        assert_int_equal(lw_world_apply(world, &first), LW_OK);
    }
    const struct lw_obstacle_change known = change(1001, 9, LW_UPSERT, ball(1, 50), none);
    const struct lw_obstacle_change forgotten = change(1002, 8, LW_UPSERT, ball(2, 50), none);
    const struct lw_obstacle_change third = change(1003, 8, LW_UPSERT, ball(3, 50), none);
    assert_int_equal(lw_world_apply(world, &known), LW_E_OLD);
    assert_int_equal(lw_world_apply(world, &third), LW_E_OLD);
    assert_int_equal(lw_world_apply(world, &forgotten), LW_OK);
    assert_int_equal(world->count, LW_SENDERS_MAX + 1);
}

// --- expiry ---

static struct lw_obstacle_change timed(int64_t session, int64_t seq, int64_t time_ns, int valid_for_ms,
                                       struct lw_obstacle a)
{
    struct lw_obstacle_change c = change(session, seq, LW_UPSERT, a, none);
    c.time_ns = time_ns;
    c.valid_for_ms = valid_for_ms;
    return c;
}

// A source's own clock ends what it sent; the clocks of others, and messages without a time, do not.
static void a_clock_judges_its_own_obstacles(void **state)
{
    (void)state;
    struct lw_world *world = empty_world();
    const struct lw_obstacle_change changes[] = {
        timed(MINE, 1, 1000, 1, ball(1, 1)),        // until 1 001 000
        timed(YOURS, 1, 2000, 1, ball(2, 1)),       // until 1 002 000
        timed(MINE, 2, 1001000 - 1, 0, ball(3, 1)), // a moment too early for 1
        timed(YOURS, 2, 1001999, 0, ball(4, 1)),    // not mine to judge
        timed(MINE, 3, 0, 0, ball(5, 1)),           // tells no time
    };
    for (size_t i = 0; i < sizeof changes / sizeof changes[0]; i++)
        assert_int_equal(lw_world_apply(world, &changes[i]), LW_OK);
    assert_int_equal(world->count, 5);
    const int64_t version = world->version;
    const struct lw_obstacle_change mine = timed(MINE, 4, 1001000, 0, ball(3, 1));
    assert_int_equal(lw_world_apply(world, &mine), LW_OK);
    assert_int_equal(get(world, 1).id, 0);
    assert_int_equal(world->count, 4);
    assert_int_equal(world->version, version + 1);
    const struct lw_obstacle_change yours = timed(YOURS, 3, 1002000, 0, none);
    assert_int_equal(lw_world_apply(world, &yours), LW_OK); // names nothing, and still tells the time
    assert_int_equal(get(world, 2).id, 0);
}

// What is named again lives on, also when its time was over: a hull keeps its vertices.
static void what_is_named_again_lives_on(void **state)
{
    (void)state;
    struct lw_world *world = empty_world();
    struct lw_obstacle_change first = hull(MINE, 1, 7, 8);
    first.time_ns = 1000;
    first.valid_for_ms = 1;
    assert_int_equal(lw_world_apply(world, &first), LW_OK);
    const struct lw_obstacle_change later = timed(MINE, 1, INT64_C(5000000000), 1, first.obstacle[0]);
    assert_int_equal(lw_world_apply(world, &later), LW_OK);
    double vertex[3 * LW_HULL_MAX];
    assert_int_equal(vertices_of(world, 7, vertex), 8);
    assert_same_bits(vertex, first.vertex, 24 * sizeof vertex[0]);
    // An expiry that was put off counts as the new one.
    const struct lw_obstacle_change end = timed(MINE, 2, INT64_C(5001000000), 0, none);
    assert_int_equal(lw_world_apply(world, &end), LW_OK);
    assert_int_equal(world->count, 0);
}

// --- hulls ---

// A hull may be moved, kept and taken over by its id; without vertices it is refused whole.
static void hulls_are_named_by_their_ids(void **state)
{
    (void)state;
    struct lw_world *world = empty_world();
    const struct lw_obstacle_change told = hull(MINE, 1, 7, 8);
    struct lw_obstacle moved = told.obstacle[0], unknown = told.obstacle[0];
    double vertex[3 * LW_HULL_MAX];
    unknown.id = 8;
    moved.p[0] += 1;
    const struct lw_obstacle_change bad = change(MINE, 1, LW_UPSERT, ball(1, 1), unknown);
    assert_int_equal(lw_world_apply(world, &bad), LW_E_UNKNOWN);
    assert_true(world->version == 0 && world->count == 0); // the ball neither
    assert_int_equal(lw_world_apply(world, &told), LW_OK);
    const uint32_t generation = world->entry[lw_world_find(world, 7)].generation;

    apply(world, YOURS, LW_UPSERT, moved, none);
    assert_near(get(world, 7).p[0], moved.p[0], 0);
    assert_int_equal(owner_of(world, 7), YOURS);
    assert_int_equal(vertices_of(world, 7, vertex), 8);
    assert_same_bits(vertex, told.vertex, 24 * sizeof vertex[0]);
    assert_int_equal(world->entry[lw_world_find(world, 7)].generation, generation);
    apply(world, YOURS, LW_REPLACE, moved, none); // kept
    assert_int_equal(vertices_of(world, 7, vertex), 8);

    // Another shape under the same id has no vertices, and they do not come back.
    apply(world, MINE, LW_UPSERT, ball(7, 1), none);
    assert_int_equal(vertices_of(world, 7, vertex), 0);
    assert_int_equal(world->chunks_used, 0);
    const struct lw_obstacle_change gone = change(MINE, world->last.seq + 1, LW_UPSERT, moved, none);
    assert_int_equal(lw_world_apply(world, &gone), LW_E_UNKNOWN);
}

// Other vertices are another generation, the same ones told again are not; a new hull under an old id is another too.
static void the_generation_tells_vertices_apart(void **state)
{
    (void)state;
    struct lw_world *world = empty_world();
    struct lw_obstacle_change c = hull(MINE, 1, 7, 9);
    uint32_t seen = 0;
    for (int step = 0; step < 6; step++) {
        const bool same = step == 1 || step == 3;
        c.stamp.seq++;
        c.obstacle[0].p[1] += 0.1; // it moves all the time
        if (step == 2)
            c.vertex[26] += 1e-9; // the last number
        if (step == 4)
            c.vertex_count = 8; // one less
        if (step == 5)
            apply(world, YOURS, LW_REMOVE, ball(7, 0), none);
        assert_int_equal(lw_world_apply(world, &c), LW_OK);
        const uint32_t generation = world->entry[lw_world_find(world, 7)].generation;
        assert_true(same ? generation == seen : generation > seen);
        seen = generation;
    }
}

// --- snapshot ---

// Everything is handed on, with its motion and the vertices in their places, and the echo of the world.
static void the_snapshot_holds_everything(void **state)
{
    (void)state;
    static struct lw_snapshot snapshot;
    struct random random = {45};
    struct lw_world *world = empty_world();
    for (int id = 1; id <= 40; id++) {
        struct lw_obstacle_change c = hull(MINE, id, id, 1 + id);
        if (id % 2)
            c = change(YOURS, id, LW_UPSERT, any_solid(&random, id), none);
        c.time_ns = 1000 + id;
        c.valid_for_ms = id % 3;
        assert_int_equal(lw_world_apply(world, &c), LW_OK);
    }
    assert_int_equal(lw_world_build(world, &snapshot), LW_OK);
    assert_int_equal(snapshot.count, 40);
    assert_true(snapshot.version == world->version && snapshot.digest == world->digest);
    assert_true(snapshot.last.session == MINE && snapshot.last.seq == 40 && snapshot.last_channel == LW_WORLD_HULL);
    for (int i = 0; i < snapshot.count; i++) {
        const struct lw_shape shape = lw_snapshot_shape(&snapshot, i);
        const int at = lw_world_find(world, (int)shape.id);
        const struct lw_world_entry *entry = &world->entry[at];
        const struct lw_motion *motion = &snapshot.item[i].motion;
        double vertex[3 * LW_HULL_MAX], room[LW_HULL_ROOM];
        const struct lw_solid solid =
            lw_obstacle_solid(&entry->obstacle, vertex, lw_world_vertices(world, entry, vertex));
        struct lw_pose pose;
        struct lw_shape expected;
        assert_int_equal(lw_pose_make(entry->obstacle.p, entry->obstacle.quat, &pose), LW_OK);
        assert_int_equal(lw_shape_make(&solid, &pose, room, &expected, NULL), LW_OK);
        assert_true(shape.kind == expected.kind && shape.generation == entry->generation);
        assert_true(shape.bound == expected.bound && motion->time_ns == entry->time_ns);
        assert_int_equal(motion->expires_ns, world->expires_ns[at]);
        assert_same_bits(motion->v, entry->obstacle.v, sizeof motion->v);
        assert_same_bits(motion->omega, entry->obstacle.omega, sizeof motion->omega);
        if (shape.kind == LW_HULL)
            assert_same_bits(shape.hull.vertex, room, 3 * (size_t)expected.hull.padded * sizeof room[0]);
    }
}

// A copy goes on as the original would.
static void a_copy_is_a_world_of_its_own(void **state)
{
    (void)state;
    static struct lw_world copy;
    struct lw_world *world = empty_world();
    struct lw_obstacle_change c = hull(MINE, 1, 7, 64);
    apply(&copy, MINE, LW_UPSERT, ball(98, 1), ball(99, 2)); // what was there before is gone
    assert_int_equal(lw_world_apply(world, &c), LW_OK);
    apply(world, MINE, LW_UPSERT, ball(1, 1), ball(2, 2));
    lw_world_copy(world, &copy);
    apply(world, MINE, LW_CLEAR, none, none);
    double vertex[3 * LW_HULL_MAX];
    assert_int_equal(vertices_of(&copy, 7, vertex), 64);
    assert_same_bits(vertex, c.vertex, sizeof c.vertex);
    assert_true(get(&copy, 98).id == 0 && get(&copy, 99).id == 0);
    apply(&copy, YOURS, LW_UPSERT, ball(3, 3), none);
    assert_true(copy.count == 4 && get(&copy, 2).p[0] == 2 && world->count == 0);
    c.stamp.seq = 1;
    assert_int_equal(lw_world_apply(&copy, &c), LW_OK);
    c.stamp.seq = 0;
    assert_int_equal(lw_world_apply(&copy, &c), LW_E_OLD);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(upsert_adds_and_overwrites_by_id),
        cmocka_unit_test(remove_reaches_every_source),
        cmocka_unit_test(replace_is_the_whole_set_of_one_source),
        cmocka_unit_test(the_last_sender_owns_an_id),
        cmocka_unit_test(clear_drops_everything_of_everyone),
        cmocka_unit_test(the_version_counts_real_changes),
        cmocka_unit_test(one_difference_makes_one_version),
        cmocka_unit_test(every_number_is_compared),
        cmocka_unit_test(messages_of_a_sender_count_once_and_in_order),
        cmocka_unit_test(each_channel_has_its_own_order),
        cmocka_unit_test(quiet_senders_make_room_for_new_ones),
        cmocka_unit_test(a_clock_judges_its_own_obstacles),
        cmocka_unit_test(what_is_named_again_lives_on),
        cmocka_unit_test(hulls_are_named_by_their_ids),
        cmocka_unit_test(the_generation_tells_vertices_apart),
        cmocka_unit_test(the_snapshot_holds_everything),
        cmocka_unit_test(a_copy_is_a_world_of_its_own),
    };
    return cmocka_run_group_tests_name("world", tests, NULL, NULL);
}
