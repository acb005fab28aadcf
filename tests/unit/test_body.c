// SPDX-License-Identifier: BSD-3-Clause
// Bodies: parts, pairs, tools, placing. The tables themselves are held to tests/data/capsules.json by
// tests/golden/test_capsules.py.
//
// Units    metres.
// Frames   base frame.
// Arrays   none.
// Memory   static.
// Errors   cmocka's.
#include "near_rig.h"

static void the_parts_of_each_model(void **state)
{
    (void)state;
    static const int links[3][11] = {{2, 3, 4, 5, 6}, {1, 2, 3, 4, 5, 6}, {1, 2, 2, 2, 3, 3, 3, 4, 5, 6}};
    static const int counts[3] = {5, 6, 10}, pairs[3] = {0, 8, 18}, tool_pairs[3] = {0, 11, 25};
    struct random random = {91};
    for (int n = 0; n < 18; n++) {
        const int model = n % 3;
        const struct lw_tool tool = rig_tool(&random, (enum lw_tool_kind)(n / 3 % 3));
        const bool has_tool = tool.kind != LW_TOOL_NONE;
        struct lw_body body;
        lw_body_make((enum lw_robot)(n / 9), (enum lw_body_model)model, &tool, &body);
        assert_int_equal(body.count, counts[model] + has_tool);
        assert_int_equal(body.pair_count, (has_tool ? tool_pairs : pairs)[model]);
        assert_int_equal(body.tool_part, has_tool ? counts[model] : -1);
        for (int i = 0; i < counts[model]; i++)
            assert_int_equal(body.part[i].link, links[model][i]);
        if (has_tool)
            assert_int_equal(body.part[body.tool_part].link, 6);
    }
}

// Links 1-3 1-4 1-5 1-6 2-4 2-5 2-6 3-6, every part of the one with every part of the other, each once.
static void the_pairs_that_may_meet(void **state)
{
    (void)state;
    static const bool meet[7][7] = {[1] = {[3] = true, [4] = true, [5] = true, [6] = true},
                                    [2] = {[4] = true, [5] = true, [6] = true},
                                    [3] = {[6] = true}};
    struct random random = {92};
    for (int n = 0; n < 4; n++) {
        const struct lw_tool tool = rig_tool(&random, n % 2 ? LW_TOOL_HULL : LW_TOOL_NONE);
        struct lw_body body;
        bool listed[LW_BODY_MAX][LW_BODY_MAX] = {{false}};
        lw_body_make(LW_UR10, n / 2 ? LW_BODY_CAPSULES : LW_BODY_CAPSULES_FINE, &tool, &body);
        for (int i = 0; i < body.pair_count; i++) {
            assert_false(listed[body.pair[i].part][body.pair[i].other]);
            listed[body.pair[i].part][body.pair[i].other] = true;
        }
        for (int i = 0; i < body.count; i++)
            for (int j = 0; j < body.count; j++)
                assert_int_equal(listed[i][j], meet[body.part[i].link][body.part[j].link]);
    }
}

// The path of the paper's method: distance |o - c| - r and direction (o - c) / |o - c|, bit for bit.
static void joints_are_points(void **state)
{
    (void)state;
    struct near_rig *rig = near_rig(93);
    lw_body_make(LW_UR5, LW_BODY_JOINTS, NULL, &rig->body);
    for (int i = 0; i < 100; i++)
        rig_tell(rig, LW_SPHERE, 0.8)->solid.radius *= i % 2;
    rig_build(rig, &rig->world);
    int found = 0;
    for (int n = 0; n < 200; n++) {
        double q[LW_NJ], away[3];
        struct lw_pose frame[LW_NJ];
        random_fill(&rig->random, -3, 3, q, LW_NJ);
        assert_int_equal(lw_arm_fk(lw_arm_get(LW_UR5), q, frame), LW_OK);
        rig_pose(rig, LW_UR5, q);
        const struct lw_near_query query = rig_query(rig, SECOND, 0.5);
        lw_near_range(&query, &rig->list);
        for (int i = 0; i < rig->list.count; i++) {
            const struct lw_near *near = &rig->list.pair[i];
            const struct told *told = &rig->told[near->obstacle - 1];
            const int link = rig->body.part[near->part].link;
            assert_int_equal(link, near->part + 2);
            lw_vec_sub(frame[link - 1].p, told->pose.p, away);
            const double length = lw_vec_norm(away), d = length - told->solid.radius;
            for (int k = 0; k < 3; k++)
                away[k] /= length;
            assert_same_bits(&near->distance.d, &d, sizeof d);
            assert_same_bits(near->distance.n, away, sizeof away);
            found++;
        }
    }
    assert_true(found > 10000);
}

static void parts_move_with_their_links(void **state)
{
    (void)state;
    struct near_rig *rig = near_rig(94);
    for (int n = 0; n < 200; n++) {
        double q[LW_NJ];
        struct lw_pose frame[LW_NJ];
        const struct lw_tool tool = rig_tool(&rig->random, LW_TOOL_HULL);
        lw_body_make(LW_UR10, LW_BODY_CAPSULES_FINE, &tool, &rig->body);
        random_fill(&rig->random, -3, 3, q, LW_NJ);
        assert_int_equal(lw_arm_fk(lw_arm_get(LW_UR10), q, frame), LW_OK);
        lw_body_place(&rig->body, frame, &rig->placed);
        for (int i = 0; i < rig->body.count; i++) {
            const struct lw_body_part *part = &rig->body.part[i];
            const struct lw_pose *at = &frame[part->link - 1];
            for (int k = 0; k < 3; k++) {
                assert_near(rig->placed.capsule[i].a[k], at->p[k] + lw_vec_dot(&at->r[3 * k], part->capsule.a), 1e-15);
                assert_near(rig->placed.capsule[i].b[k], at->p[k] + lw_vec_dot(&at->r[3 * k], part->capsule.b), 1e-15);
            }
            assert_near(rig->placed.capsule[i].r, part->capsule.r, 0);
        }
        // The hull is the tool's vertices where the flange is, and the part's capsule holds them, radius and all.
        const struct lw_shape hull = lw_body_tool_shape(&rig->body, &rig->placed);
        struct lw_capsule vertex = {.r = tool.radius};
        struct lw_distance found;
        assert_int_equal(hull.hull.count, tool.count);
        for (int i = 0; i < tool.count; i++) {
            for (int k = 0; k < 3; k++) {
                const double there = frame[5].p[k] + lw_vec_dot(&frame[5].r[3 * k], &tool.vertex[3 * i]);
                assert_near(hull.c[k] + hull.hull.vertex[k * hull.hull.padded + i], there, 1e-14);
                vertex.a[k] = vertex.b[k] = there;
            }
            lw_distance_capsules(&vertex, &rig->placed.capsule[rig->body.tool_part], &found);
            assert_true(found.d <= -2 * tool.radius + 1e-12);
        }
    }
}

// Clearances do not change when the arm and the world turn about the base together.
static void turning_base_and_world_together(void **state)
{
    (void)state;
    struct near_rig *rig = near_rig(95);
    lw_body_make(LW_UR5, LW_BODY_CAPSULES, NULL, &rig->body);
    for (int n = 0; n < 200; n++) {
        double q[LW_NJ], turned[LW_NJ];
        struct lw_near here, there;
        const double angle = random_in(&rig->random, -3, 3);
        rig->count = 0;
        struct told *told = rig_tell(rig, LW_BOX, 1);
        random_fill(&rig->random, -3, 3, q, LW_NJ);
        memcpy(turned, q, sizeof q);
        turned[0] += angle;
        for (int turn = 0; turn < 2; turn++) {
            struct lw_near_query query = rig_query(rig, SECOND, HUGE_VAL);
            rig_build(rig, &rig->world);
            rig_pose(rig, LW_UR5, turn ? turned : q);
            lw_near_smallest(&query, turn ? &there : &here);
            const struct lw_pose before = told->pose;
            const double c = cos(angle), s = sin(angle);
            for (int k = 0; k < 4; k++) {
                const double *x = k < 3 ? &before.r[k] : before.p;
                double *to = k < 3 ? &told->pose.r[k] : told->pose.p;
                const int row = k < 3 ? 3 : 1;
                to[0] = c * x[0] - s * x[row];
                to[row] = s * x[0] + c * x[row];
            }
        }
        assert_near(there.distance.d, here.distance.d, 1e-12);
        assert_int_equal(there.part, here.part);
    }
}

// Wrist 3 of the UR10 has no length; it answers like a ball.
static void a_part_without_length(void **state)
{
    (void)state;
    struct near_rig *rig = near_rig(96);
    lw_body_make(LW_UR10, LW_BODY_CAPSULES, NULL, &rig->body);
    const struct lw_capsule *wrist = &rig->body.part[5].capsule;
    assert_same_bits(wrist->a, wrist->b, sizeof wrist->a);
    for (int i = 0; i < 200; i++)
        rig_tell(rig, rig_kind(&rig->random), 1);
    rig_build(rig, &rig->world);
    for (int n = 0; n < 50; n++) {
        struct lw_near each[LW_BODY_MAX];
        struct lw_distance ball;
        rig_random_pose(rig, LW_UR10);
        const struct lw_near_query query = rig_query(rig, SECOND, HUGE_VAL);
        lw_near_each(&query, each);
        const struct lw_shape sphere = {
            .kind = LW_SPHERE, .r = wrist->r, .segment = lw_shape_of_capsule(&rig->placed.capsule[5]).segment};
        struct lw_shape at_centre = sphere;
        memcpy(at_centre.c, rig->placed.capsule[5].a, sizeof at_centre.c);
        for (int i = 0; i < rig->world.count; i++)
            if ((int)rig->world.item[i].shape.id == each[5].obstacle) {
                const struct lw_shape shape = lw_snapshot_shape(&rig->world, i);
                assert_int_equal(lw_distance_shapes(&at_centre, &shape, &ball), LW_OK);
                assert_near(each[5].distance.d, ball.d, 1e-12);
                assert_near(lw_vec_norm(each[5].distance.n), 1, 1e-12);
            }
    }
}

static void tools_are_checked(void **state)
{
    (void)state;
    struct random random = {97};
    struct lw_tool tool = rig_tool(&random, LW_TOOL_NONE);
    const char *reason = NULL;
    tool.count = -5; // of no hull: not read
    assert_int_equal(lw_tool_check(&tool, &reason), LW_OK);
    tool = rig_tool(&random, LW_TOOL_CAPSULE);
    assert_int_equal(lw_tool_check(&tool, &reason), LW_OK);
    tool.capsule.b[1] = NO_NUMBER;
    assert_int_equal(lw_tool_check(&tool, &reason), LW_E_NOT_FINITE);
    tool = rig_tool(&random, LW_TOOL_CAPSULE);
    tool.capsule.r = 0;
    assert_int_equal(lw_tool_check(&tool, NULL), LW_E_ARGUMENT);
    tool.capsule.r = HUGE_VAL;
    assert_int_equal(lw_tool_check(&tool, NULL), LW_E_NOT_FINITE);
    tool = rig_tool(&random, LW_TOOL_HULL);
    assert_int_equal(lw_tool_check(&tool, &reason), LW_OK);
    tool.vertex[7] = HUGE_VAL;
    assert_int_equal(lw_tool_check(&tool, &reason), LW_E_NOT_FINITE);
    for (int count = 0; count < 2; count++) {
        tool = rig_tool(&random, LW_TOOL_HULL);
        tool.count = count ? LW_HULL_MAX + 1 : 0;
        assert_int_equal(lw_tool_check(&tool, &reason), LW_E_ARGUMENT);
    }
    tool = rig_tool(&random, LW_TOOL_HULL);
    tool.radius = -0.01;
    assert_int_equal(lw_tool_check(&tool, &reason), LW_E_ARGUMENT);
    tool.kind = (enum lw_tool_kind)9; // NOLINT(clang-analyzer-optin.core.EnumCastOutOfRange): that is the test
    reason = NULL;
    assert_int_equal(lw_tool_check(&tool, &reason), LW_E_ARGUMENT);
    assert_non_null(reason);
}

// A hull that nobody checked: its distances are no numbers, which a caller notices.
static void an_unchecked_tool_shows(void **state)
{
    (void)state;
    struct near_rig *rig = near_rig(98);
    struct lw_tool tool = rig_tool(&rig->random, LW_TOOL_HULL);
    tool.vertex[4] = NO_NUMBER;
    lw_body_make(LW_UR5, LW_BODY_CAPSULES, &tool, &rig->body);
    rig_random_pose(rig, LW_UR5);
    for (int i = 0; i < 20; i++)
        rig_tell(rig, rig_kind(&rig->random), 1);
    rig_build(rig, &rig->world);
    struct lw_near each[LW_BODY_MAX];
    const struct lw_near_query query = rig_query(rig, SECOND, 0.1);
    lw_near_each(&query, each);
    assert_true(isnan(each[rig->body.tool_part].distance.d));
    lw_near_range(&query, &rig->list);
    assert_true(isnan(rig->list.pair[rig->list.count - 1].distance.d));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_parts_of_each_model),
        cmocka_unit_test(the_pairs_that_may_meet),
        cmocka_unit_test(joints_are_points),
        cmocka_unit_test(parts_move_with_their_links),
        cmocka_unit_test(turning_base_and_world_together),
        cmocka_unit_test(a_part_without_length),
        cmocka_unit_test(tools_are_checked),
        cmocka_unit_test(an_unchecked_tool_shows),
    };
    return cmocka_run_group_tests_name("body", tests, NULL, NULL);
}
