// SPDX-License-Identifier: BSD-3-Clause
// Tests of the world: every operation against what a plain list would hold, ownership, versions, and the full world.
//
// Units    metres.
// Frames   base frame.
// Arrays   none.
// Memory   static where worlds are large.
// Errors   cmocka's.
#include "base/vec.h" // lw_vec_*
#include "collision/world.h"
#include "helpers.h"

enum { MINE = 7, YOURS = 8 };

static struct lw_obstacle ball(int id, double x)
{
    return (struct lw_obstacle){.id = id, .p = {x, 2 * x, 0.5}, .quat = {1}, .radius = 0.1};
}

// A change of one or two obstacles; id 0 = none.
static struct lw_obstacle_change change(int64_t session, int64_t seq, enum lw_change_op op, struct lw_obstacle a,
                                        struct lw_obstacle b)
{
    return (struct lw_obstacle_change){
        .stamp = {.session = session, .seq = seq}, .op = op, .count = (a.id != 0) + (b.id != 0), .obstacle = {a, b}};
}

static void apply(struct lw_world *world, int64_t session, enum lw_change_op op, struct lw_obstacle a,
                  struct lw_obstacle b)
{
    const struct lw_obstacle_change c = change(session, world->last.seq + 1, op, a, b);
    assert_int_equal(lw_world_apply(world, &c), LW_OK);
    assert_true(world->last.session == session && world->last.seq == c.stamp.seq);
}

static const struct lw_obstacle none = {0};

// The obstacle of an id; id 0 = the world has none.
static struct lw_obstacle get(const struct lw_world *world, int id)
{
    struct lw_obstacle found = none;
    for (int i = 0; i < world->count; i++)
        if (world->obstacle[i].id == id) {
            assert_int_equal(found.id, 0); // ids are unique
            found = world->obstacle[i];
        }
    return found;
}

static int64_t owner_of(const struct lw_world *world, int id)
{
    for (int i = 0; i < world->count; i++)
        if (world->obstacle[i].id == id)
            return world->owner[i];
    return 0;
}

// --- operations ---

static void upsert_adds_and_overwrites_by_id(void **state)
{
    (void)state;
    static struct lw_world world;
    memset(&world, 0, sizeof world);
    apply(&world, MINE, LW_UPSERT, ball(3, 1), ball(5, 2));
    assert_int_equal(world.count, 2);
    apply(&world, MINE, LW_UPSERT, ball(5, 9), none);
    assert_int_equal(world.count, 2);
    assert_near(get(&world, 5).p[1], 18, 0);
    assert_near(get(&world, 5).radius, 0.1, 0);
    assert_near(get(&world, 3).p[0], 1, 0);
}

// Anyone may remove anything; what is not there cannot be removed.
static void remove_reaches_every_source(void **state)
{
    (void)state;
    static struct lw_world world;
    memset(&world, 0, sizeof world);
    apply(&world, MINE, LW_UPSERT, ball(3, 1), ball(5, 2));
    apply(&world, YOURS, LW_REMOVE, ball(3, 0), ball(99, 0));
    assert_int_equal(world.count, 1);
    assert_int_equal(get(&world, 3).id, 0);
    assert_int_not_equal(get(&world, 5).id, 0);
}

// Replace drops what its own sender sent before and leaves other sources alone.
static void replace_is_the_whole_set_of_one_source(void **state)
{
    (void)state;
    static struct lw_world world;
    memset(&world, 0, sizeof world);
    apply(&world, MINE, LW_UPSERT, ball(1, 1), ball(2, 2));
    apply(&world, YOURS, LW_UPSERT, ball(3, 3), none);
    apply(&world, MINE, LW_REPLACE, ball(2, 7), ball(4, 4));
    assert_int_equal(world.count, 3);
    assert_int_equal(get(&world, 1).id, 0);
    assert_near(get(&world, 2).p[0], 7, 0);
    assert_near(get(&world, 3).p[0], 3, 0);
    assert_int_not_equal(get(&world, 4).id, 0);
    apply(&world, MINE, LW_REPLACE, none, none);
    assert_int_equal(world.count, 1);
    assert_int_not_equal(get(&world, 3).id, 0);
}

// Whoever sends an id last owns it: the old owner's replace no longer drops it, the new owner's does.
static void the_last_sender_owns_an_id(void **state)
{
    (void)state;
    static struct lw_world world;
    memset(&world, 0, sizeof world);
    apply(&world, MINE, LW_UPSERT, ball(1, 1), none);
    apply(&world, YOURS, LW_UPSERT, ball(1, 1), none); // same place, new owner
    assert_int_equal(owner_of(&world, 1), YOURS);
    assert_int_equal(world.version, 2);
    apply(&world, MINE, LW_REPLACE, ball(2, 2), none);
    assert_int_not_equal(get(&world, 1).id, 0);
    apply(&world, YOURS, LW_REPLACE, none, none);
    assert_int_equal(get(&world, 1).id, 0);
    apply(&world, YOURS, LW_REPLACE, ball(2, 2), none); // takes 2 over
    assert_int_equal(owner_of(&world, 2), YOURS);
    assert_int_equal(world.count, 1);
}

static void clear_drops_everything_of_everyone(void **state)
{
    (void)state;
    static struct lw_world world;
    memset(&world, 0, sizeof world);
    apply(&world, MINE, LW_UPSERT, ball(1, 1), none);
    apply(&world, YOURS, LW_UPSERT, ball(2, 2), none);
    apply(&world, 9, LW_CLEAR, ball(5, 5), none); // what it lists is ignored
    assert_int_equal(world.count, 0);
}

// --- versions ---

// Hearing anything makes version 1, even when nothing is there; after that only a real difference counts.
static void the_version_counts_real_changes(void **state)
{
    (void)state;
    static struct lw_world world;
    memset(&world, 0, sizeof world);
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
        apply(&world, MINE, steps[i].op, steps[i].a, none);
        assert_int_equal(world.version, steps[i].version);
    }
}

// One difference in a message is enough, wherever it stands, and a message counts once however many it brings.
static void one_difference_makes_one_version(void **state)
{
    (void)state;
    static struct lw_world world;
    memset(&world, 0, sizeof world);
    apply(&world, MINE, LW_UPSERT, ball(1, 1), ball(2, 2));
    assert_int_equal(world.version, 1);
    apply(&world, MINE, LW_UPSERT, ball(1, 9), ball(2, 2)); // the first alone
    assert_int_equal(world.version, 2);
    apply(&world, MINE, LW_UPSERT, ball(1, 9), ball(2, 9)); // the second alone
    assert_int_equal(world.version, 3);
    apply(&world, MINE, LW_REPLACE, ball(2, 9), none); // only drops
    assert_int_equal(world.version, 4);
}

// Each number of an obstacle makes a difference.
static void every_number_is_compared(void **state)
{
    (void)state;
    for (int field = 0; field < 4; field++) {
        static struct lw_world world;
        memset(&world, 0, sizeof world);
        struct lw_obstacle o = ball(1, 1);
        apply(&world, MINE, LW_UPSERT, o, none);
        *(field < 3 ? &o.p[field] : &o.radius) += 1e-9;
        apply(&world, MINE, LW_UPSERT, o, none);
        assert_int_equal(world.version, 2);
        assert_near(field < 3 ? get(&world, 1).p[field] : get(&world, 1).radius, field < 3 ? o.p[field] : o.radius, 0);
    }
}

// --- order ---

// What a sender has overtaken changes nothing; what it repeats changes nothing but is heard again, so that it ends
// waiting.
static void messages_of_a_sender_count_once_and_in_order(void **state)
{
    (void)state;
    static struct lw_world world;
    memset(&world, 0, sizeof world);
    const struct lw_obstacle_change first = change(MINE, 4, LW_UPSERT, ball(1, 1), none);
    const struct lw_obstacle_change second = change(MINE, 5, LW_UPSERT, ball(1, 2), none);
    const struct lw_obstacle_change other = change(YOURS, 1, LW_UPSERT, ball(2, 7), none);
    assert_int_equal(lw_world_apply(&world, &second), LW_OK);
    assert_int_equal(lw_world_apply(&world, &first), LW_E_OLD);
    assert_int_equal(lw_world_apply(&world, &other), LW_OK);
    const int64_t version = world.version;
    assert_int_equal(lw_world_apply(&world, &second), LW_OK);
    assert_true(world.last.session == MINE && world.last.seq == 5 && world.version == version);
    assert_near(get(&world, 1).p[0], 2, 0);
    assert_int_equal(world.count, 2);
}

// More senders than are remembered: the one heard first is forgotten, nothing else is lost.
static void old_senders_make_room_for_new_ones(void **state)
{
    (void)state;
    static struct lw_world world;
    memset(&world, 0, sizeof world);
    for (int k = 1; k <= LW_SENDERS_MAX + 1; k++) {
        const struct lw_obstacle_change c = change(1000 + k, 9, LW_UPSERT, ball(k, k), none);
        assert_int_equal(lw_world_apply(&world, &c), LW_OK);
    }
    const struct lw_obstacle_change forgotten = change(1001, 8, LW_UPSERT, ball(1, 50), none);
    const struct lw_obstacle_change known = change(1003, 8, LW_UPSERT, ball(3, 50), none);
    assert_int_equal(lw_world_apply(&world, &known), LW_E_OLD);
    assert_int_equal(lw_world_apply(&world, &forgotten), LW_OK);
    assert_int_equal(world.count, LW_SENDERS_MAX + 1);
}

// --- full ---

static void fill(struct lw_world *world, int count)
{
    for (int id = 1; id <= count; id += 2)
        apply(world, MINE, LW_UPSERT, ball(id, id), id + 1 <= count ? ball(id + 1, 1) : none);
}

// The last place can be used; a change that needs one more is refused whole, the world stays byte for byte.
static void a_full_world_refuses_whole_changes(void **state)
{
    (void)state;
    static struct lw_world world, before;
    memset(&world, 0, sizeof world);
    fill(&world, LW_REGISTRY_MAX - 1);
    struct lw_obstacle_change c = change(YOURS, 1, LW_UPSERT, ball(901, 1), ball(902, 2));
    memcpy(&before, &world, sizeof world); // padding too
    assert_int_equal(lw_world_apply(&world, &c), LW_E_FULL);
    assert_same_bits(&world, &before, sizeof world);

    apply(&world, YOURS, LW_UPSERT, ball(901, 1), none);
    assert_int_equal(world.count, LW_REGISTRY_MAX);
    apply(&world, YOURS, LW_UPSERT, ball(901, 5), ball(1, 5)); // overwriting needs no room
    assert_near(get(&world, 1).p[0], 5, 0);
    memcpy(&before, &world, sizeof world); // padding too
    c = change(MINE, INT64_MAX, LW_UPSERT, ball(2, 8), ball(903, 2));
    assert_int_equal(lw_world_apply(&world, &c), LW_E_FULL);
    assert_same_bits(&world, &before, sizeof world);
}

// A replacement frees its sender's places before it takes new ones.
static void replace_makes_room_first(void **state)
{
    (void)state;
    static struct lw_world world;
    memset(&world, 0, sizeof world);
    fill(&world, LW_REGISTRY_MAX);
    apply(&world, MINE, LW_REPLACE, ball(901, 1), ball(902, 1));
    assert_int_equal(world.count, 2);
}

// --- any sequence ---

// Random changes of three sources against the plainest model: one owner and one place for each of 12 ids.
static void random_changes_match_a_plain_model(void **state)
{
    (void)state;
    enum { IDS = 12 };
    struct random random = {42};
    int64_t owner[IDS + 1] = {0};
    double place[IDS + 1] = {0};
    static struct lw_world world;
    memset(&world, 0, sizeof world);
    for (int n = 0; n < 5000; n++) {
        const int64_t session = 1 + random_below(&random, 3);
        const int op = random_below(&random, 30) ? random_below(&random, 3) : LW_CLEAR;
        const int a = 1 + random_below(&random, IDS), b = 1 + (a + random_below(&random, IDS - 1)) % IDS;
        const double x = random_below(&random, 3);
        apply(&world, session, (enum lw_change_op)op, ball(a, x), ball(b, x));
        for (int id = 1; id <= IDS; id++) {
            const bool listed = id == a || id == b;
            if (op == LW_CLEAR || (op == LW_REMOVE && listed) || (op == LW_REPLACE && owner[id] == session))
                owner[id] = 0;
            if (listed && (op == LW_UPSERT || op == LW_REPLACE)) {
                owner[id] = session;
                place[id] = x;
            }
            const struct lw_obstacle o = get(&world, id);
            assert_int_equal(owner_of(&world, id), owner[id]);
            assert_true(o.id == 0 || o.p[0] == place[id]);
        }
    }
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
        cmocka_unit_test(old_senders_make_room_for_new_ones),
        cmocka_unit_test(a_full_world_refuses_whole_changes),
        cmocka_unit_test(replace_makes_room_first),
        cmocka_unit_test(random_changes_match_a_plain_model),
    };
    return cmocka_run_group_tests_name("world", tests, NULL, NULL);
}
