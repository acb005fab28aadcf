// SPDX-License-Identifier: BSD-3-Clause
// Range and nearest queries in a world at rest, against every pair tried one by one.
//
// Units    metres, ns.
// Frames   base frame.
// Arrays   none.
// Memory   static.
// Errors   cmocka's.
#include "near_rig.h"

// --- every pair, one by one ---

static void check_pair(const struct lw_near *near, int part, uint32_t id, const struct lw_distance *expected)
{
    static const double still[3];
    assert_int_equal(near->part, part);
    assert_int_equal(near->obstacle, id);
    assert_int_equal(near->other, -1);
    assert_near(near->distance.d, expected->d, 1e-12);
    assert_int_equal(near->distance.flags & ~LW_DISTANCE_STALLED, expected->flags & ~LW_DISTANCE_STALLED);
    assert_same_bits(near->velocity, still, sizeof still);
}

// The list is the set of all pairs in range, in order of part and obstacle.
static void check_range(struct near_rig *rig, double d_max)
{
    int at = 0;
    for (int part = 0; part < rig->body.count; part++)
        for (int i = 0; i < rig->world.count; i++) {
            const struct lw_distance d = rig_distance(rig, &rig->world, part, i);
            if (d.d <= d_max && at++ < LW_NEAR_MAX)
                check_pair(&rig->list.pair[at - 1], part, rig->world.item[i].shape.id, &d);
        }
    assert_int_equal(rig->list.needed, at);
    assert_int_equal(rig->list.count, at < LW_NEAR_MAX ? at : LW_NEAR_MAX);
}

// The least of all pairs of a part; of equal ones the lowest id.
static void check_nearest(const struct near_rig *rig, int part, double d_max, const struct lw_near *near)
{
    struct lw_distance least = {.d = d_max};
    uint32_t nearest = 0;
    for (int i = 0; i < rig->world.count; i++) {
        const struct lw_distance d = rig_distance(rig, &rig->world, part, i);
        const uint32_t id = rig->world.item[i].shape.id;
        if (d.d < least.d || (d.d == least.d && (nearest == 0 || id < nearest))) {
            least = d;
            nearest = id;
        }
    }
    if (nearest != 0) {
        check_pair(near, part, nearest, &least);
        return;
    }
    assert_int_equal(near->part, part);
    assert_int_equal(near->obstacle, 0);
    assert_int_equal(near->other, -1);
    assert_near(near->distance.d, d_max, 0);
}

static void check_all(struct near_rig *rig, double d_max)
{
    static struct lw_near each[LW_BODY_MAX], smallest;
    const struct lw_near_query query = rig_query(rig, SECOND, d_max);
    int first = 0;
    lw_near_range(&query, &rig->list);
    lw_near_each(&query, each);
    lw_near_smallest(&query, &smallest);
    check_range(rig, d_max);
    for (int part = 0; part < rig->body.count; part++) {
        check_nearest(rig, part, d_max, &each[part]);
        first = each[part].distance.d < each[first].distance.d ? part : first;
    }
    check_pair(&smallest, each[first].obstacle == 0 ? 0 : first, (uint32_t)each[first].obstacle, &each[first].distance);
}

// --- tests ---

static void every_number_of_obstacles(void **state)
{
    (void)state;
    static const int counts[] = {0, 1, 2, 15, 16, 17, 33, 255, 256, 257, 1000, 3000};
    for (size_t c = 0; c < sizeof counts / sizeof counts[0]; c++)
        for (int tool = LW_TOOL_NONE; tool <= LW_TOOL_HULL; tool++) {
            struct near_rig *rig = near_rig(7 + c);
            const struct lw_tool with = rig_tool(&rig->random, (enum lw_tool_kind)tool);
            lw_body_make(LW_UR10, LW_BODY_CAPSULES, &with, &rig->body);
            for (int i = 0; i < counts[c]; i++)
                rig_tell(rig, rig_kind(&rig->random), 1.5);
            rig_build(rig, &rig->world);
            for (int pose = 0; pose < 5; pose++) {
                rig_random_pose(rig, LW_UR10);
                check_all(rig, pose == 4 ? HUGE_VAL : random_in(&rig->random, 0, 0.3));
            }
        }
}

static void every_model_of_the_body(void **state)
{
    (void)state;
    struct near_rig *rig = near_rig(21);
    for (int i = 0; i < 300; i++)
        rig_tell(rig, rig_kind(&rig->random), 1);
    rig_build(rig, &rig->world);
    for (int n = 0; n < 30; n++) {
        const enum lw_robot robot = n % 2 ? LW_UR5 : LW_UR10;
        const struct lw_tool tool = rig_tool(&rig->random, (enum lw_tool_kind)(n % 5 % 3));
        lw_body_make(robot, (enum lw_body_model)(n % 3), &tool, &rig->body);
        rig_random_pose(rig, robot);
        check_all(rig, 0.2);
    }
}

// Sizes and places that stretch single precision.
static void shapes_large_and_far_away(void **state)
{
    (void)state;
    struct near_rig *rig = near_rig(22);
    lw_body_make(LW_UR5, LW_BODY_CAPSULES_FINE, NULL, &rig->body);
    for (int i = 0; i < 400; i++) {
        struct told *told = rig_tell(rig, i % 2 ? LW_SPHERE : LW_BOX, i % 4 ? 2 : 100);
        told->solid.radius = i % 5 ? told->solid.radius : lw_vec_norm(told->pose.p) - 0.6; // reaches up to the arm
        told->solid.radius = fmax(told->solid.radius, 0);
    }
    struct told *giant = rig_tell(rig, LW_SPHERE, 1);
    giant->pose.p[0] = 1e6;
    giant->solid.radius = 1e6 - 0.8;
    giant = rig_tell(rig, LW_SPHERE, 1);
    giant->pose.p[0] = -1e60;
    rig_build(rig, &rig->world);
    for (int n = 0; n < 20; n++) {
        rig_random_pose(rig, LW_UR5);
        check_all(rig, n % 2 ? 0.3 : 50);
    }
}

// Half-spaces have no bounding sphere: they are always looked at.
static void half_spaces(void **state)
{
    (void)state;
    struct near_rig *rig = near_rig(23);
    for (int n = 0; n < 20; n++) {
        rig->count = 0;
        for (int i = 0; i < n; i++) {
            struct told *told = rig_tell(rig, i % 3 ? rig_kind(&rig->random) : LW_HALFSPACE, 1.2);
            if (told->solid.kind == LW_HALFSPACE)
                for (int k = 0; k < 3; k++) // below its own distance from the base
                    told->pose.p[k] = -(1 + 0.3 * i) * told->pose.r[3 * k + 2];
        }
        const struct lw_tool tool = rig_tool(&rig->random, LW_TOOL_HULL);
        lw_body_make(LW_UR10, LW_BODY_CAPSULES, &tool, &rig->body);
        rig_build(rig, &rig->world);
        rig_random_pose(rig, LW_UR10);
        check_all(rig, 0.5);
        check_all(rig, HUGE_VAL);
    }
}

// One thousand obstacles at one point: equal keys, equal distances, more pairs than the list holds.
static void many_at_one_point(void **state)
{
    (void)state;
    struct near_rig *rig = near_rig(24);
    lw_body_make(LW_UR5, LW_BODY_CAPSULES, NULL, &rig->body);
    for (int i = 0; i < 1000; i++) {
        struct told *told = rig_tell(rig, LW_SPHERE, 0);
        told->id = 1000 - i;
        told->pose.p[2] = 0.9;
        told->solid.radius = 0.05;
    }
    rig_build(rig, &rig->world);
    for (int i = 0; i < 1000; i++)
        assert_int_equal(rig->world.item[i].shape.id, i + 1);
    rig_random_pose(rig, LW_UR5);
    check_all(rig, 0.1);
    check_all(rig, 3);
    assert_int_equal(rig->list.needed, 6000);
    // It ends where it is full: what stands after it is untouched.
    const struct lw_near_query query = rig_query(rig, SECOND, 3);
    struct lw_near *last = &rig->list.pair[LW_NEAR_MAX - 1];
    lw_near_range(&query, &rig->list);
    assert_int_equal(last->part, (LW_NEAR_MAX - 1) / 1000);
    lw_near_self(&rig->body, &rig->placed, 10, &rig->list);
    assert_int_equal(rig->list.needed, 6000 + rig->body.pair_count);
    assert_int_equal(rig->list.count, LW_NEAR_MAX);
}

// Of equally near obstacles the lowest id, of equally near parts the first: with any seed of the search.
static void ties(void **state)
{
    (void)state;
    struct near_rig *rig = near_rig(25);
    int twins = 0, other_parts = 0;
    for (int n = 0; n < 400; n++) {
        struct lw_near smallest;
        const struct lw_near_query query = rig_query(rig, SECOND, 1);
        lw_body_make(LW_UR5, LW_BODY_CAPSULES, NULL, &rig->body);
        rig->count = 0;
        for (int i = 0; i < 40; i++) {
            struct told *told = rig_tell(rig, LW_SPHERE, 1); // of which a distance has the same bits every time
            if (i % 2 == 0)
                continue;
            const int id = told->id;
            *told = rig->told[i - 1];
            told->solid.vertex = told->vertex;
            told->id = id;
        }
        rig_random_pose(rig, LW_UR5);
        rig->placed.capsule[4] = rig->placed.capsule[5] = rig->placed.capsule[2];
        rig_build(rig, &rig->world);
        rig->warm.smallest.id = 0;
        lw_near_smallest(&query, &smallest);
        const struct lw_near first = smallest;
        if (first.obstacle == 0)
            continue;
        assert_true(first.obstacle % 2 == 1 && first.part != 4 && first.part != 5);
        // The search starts from its equal, of the other obstacle or of another part.
        for (int i = 0; i < rig->world.count; i++) {
            const int id = (int)rig->world.item[i].shape.id, part = first.part == 2 ? 2 + n % 4 : first.part;
            if ((id != first.obstacle && id != first.obstacle + 1) || part == 3)
                continue;
            rig->warm.smallest = (struct lw_warm_pair){part, i, id};
            lw_near_smallest(&query, &smallest);
            assert_int_equal(smallest.obstacle, first.obstacle);
            assert_int_equal(smallest.part, first.part);
            other_parts += part != first.part;
            twins += id != first.obstacle;
        }
    }
    assert_true(twins > 100 && other_parts > 20);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_number_of_obstacles), cmocka_unit_test(every_model_of_the_body),
        cmocka_unit_test(shapes_large_and_far_away), cmocka_unit_test(half_spaces),
        cmocka_unit_test(many_at_one_point),         cmocka_unit_test(ties),
    };
    return cmocka_run_group_tests_name("near", tests, NULL, NULL);
}
