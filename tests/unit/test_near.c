// SPDX-License-Identifier: BSD-3-Clause
// Range and nearest queries against every pair tried one by one.
//
// Units    metres, ns.
// Frames   base frame.
// Arrays   none.
// Memory   static.
// Errors   cmocka's.
#include "near_rig.h"

// --- every pair, one by one ---

// Distance of a part to obstacle i where it was told to be.
static struct lw_distance pair_distance(const struct near_rig *rig, int part, int i)
{
    const struct lw_shape shape = lw_snapshot_shape(&rig->world, i);
    struct lw_distance found;
    if (part == rig->body.tool_part && rig->body.tool.kind == LW_TOOL_HULL) {
        const struct lw_shape tool = lw_body_tool_shape(&rig->body, &rig->placed);
        assert_int_equal(lw_distance_shapes(&tool, &shape, &found), LW_OK);
    } else {
        lw_distance_link(&rig->placed.capsule[part], &shape, INFINITY, NULL, &found);
    }
    return found;
}

static void check_pair(const struct near_rig *rig, const struct lw_near *near, const struct lw_distance *expected)
{
    (void)rig;
    assert_near(near->distance.d, expected->d, 1e-12);
    assert_int_equal(near->other, -1);
    assert_int_equal(near->distance.flags & ~LW_DISTANCE_STALLED, expected->flags & ~LW_DISTANCE_STALLED);
}

// The list is the set of all pairs in range, in order of part and obstacle; the nearest ones are the least of all.
static void check_all(struct near_rig *rig, double d_max)
{
    static struct lw_near each[LW_BODY_MAX], smallest;
    const struct lw_near_query query = rig_query(rig, SECOND, d_max);
    lw_near_range(&query, &rig->list);
    lw_near_each(&query, each);
    lw_near_smallest(&query, &smallest);
    int at = 0, best_part = 0;
    for (int part = 0; part < rig->body.count; part++) {
        int nearest = 0;
        double least = d_max;
        for (int i = 0; i < rig->world.count; i++) {
            const struct lw_distance d = pair_distance(rig, part, i);
            if (d.d > d_max)
                continue;
            if (at < LW_NEAR_MAX) {
                assert_int_equal(rig->list.pair[at].part, part);
                assert_int_equal(rig->list.pair[at].obstacle, rig->world.item[i].shape.id);
                check_pair(rig, &rig->list.pair[at], &d);
            }
            at++;
            nearest = nearest == 0 || d.d < least ? (int)rig->world.item[i].shape.id : nearest;
            least = fmin(least, d.d);
        }
        assert_int_equal(each[part].part, part);
        assert_near(each[part].distance.d, least, 1e-12);
        assert_int_equal(each[part].obstacle == 0, nearest == 0);
        best_part = each[part].distance.d < each[best_part].distance.d ? part : best_part;
    }
    assert_int_equal(rig->list.needed, at);
    assert_int_equal(rig->list.count, at < LW_NEAR_MAX ? at : LW_NEAR_MAX);
    assert_near(smallest.distance.d, each[best_part].distance.d, 1e-12);
    assert_int_equal(smallest.obstacle, each[best_part].obstacle);
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
                check_all(rig, pose == 4 ? (double)INFINITY : random_in(&rig->random, 0, 0.3));
            }
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_number_of_obstacles),
    };
    return cmocka_run_group_tests_name("near", tests, NULL, NULL);
}
