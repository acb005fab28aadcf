// SPDX-License-Identifier: BSD-3-Clause
// Tests of the kinematics: reference poses, then relations between poses, Jacobians and wrenches at random
// configurations.
//
// Units    metres, radians.
// Frames   base frame unless a name says link.
// Arrays   see arm/arm.h.
// Memory   stack.
// Errors   cmocka's.
#include "arm/arm.h"
#include "base/vec.h" // lw_vec_*
#include "helpers.h"

enum { ROUNDS = 200 };
static const double pi = 3.14159265358979323846;

static void fk(const struct lw_arm *arm, const double q[LW_NJ], struct lw_pose frame[LW_NJ])
{
    assert_int_equal(lw_arm_fk(arm, q, frame), LW_OK);
}

// Point fixed to a link (1..6), in the base frame.
static void place(const struct lw_pose frame[LW_NJ], int link, const double local[3], double point[3])
{
    const struct lw_pose *pose = &frame[link - 1];
    for (int i = 0; i < 3; i++)
        point[i] = pose->p[i] + lw_vec_dot(&pose->r[3 * i], local);
}

// Runs a check on both robots at random configurations, up to two turns away.
static void for_random_poses(void (*check)(const struct lw_arm *arm, const double q[LW_NJ], struct random *random))
{
    struct random random = {31};
    for (int i = 0; i < ROUNDS * LW_ROBOT_COUNT; i++) {
        double q[LW_NJ];
        random_fill(&random, -2 * pi, 2 * pi, q, LW_NJ);
        check(lw_arm_get((enum lw_robot)(i % LW_ROBOT_COUNT)), q, &random);
    }
}

// --- reference poses ---

// All joints zero: stretched along -x, wrist to -y. A mix-up of DH base and URDF base_link turns both signs.
static void zero_pose_of_the_ur5(void **state)
{
    (void)state;
    const double origin[LW_NJ][3] = {{0, 0, 0.089159},
                                     {-0.425, 0, 0.089159},
                                     {-0.81725, 0, 0.089159},
                                     {-0.81725, -0.10915, 0.089159},
                                     {-0.81725, -0.10915, -0.005491},
                                     {-0.81725, -0.19145, -0.005491}};
    const double q[LW_NJ] = {0};
    struct lw_pose frame[LW_NJ];
    fk(lw_arm_get(LW_UR5), q, frame);
    for (int i = 0; i < LW_NJ; i++)
        assert_all_near(frame[i].p, origin[i], 3, 1e-15);
    assert_true(frame[5].p[0] < -0.8 && frame[5].p[1] < -0.19);
}

static void zero_pose_of_the_ur10(void **state)
{
    (void)state;
    const double tip[3] = {-1.1843, -0.256141, 0.0116}, q[LW_NJ] = {0};
    struct lw_pose frame[LW_NJ];
    fk(lw_arm_get(LW_UR10), q, frame);
    assert_all_near(frame[5].p, tip, 3, 1e-15);
}

// Straight up: all lengths of the links add to the height.
static void upright_pose(void **state)
{
    (void)state;
    for (int robot = 0; robot < LW_ROBOT_COUNT; robot++) {
        const struct lw_arm *arm = lw_arm_get((enum lw_robot)robot);
        const double q[LW_NJ] = {0, -pi / 2, 0, -pi / 2, 0, 0};
        const double tip[3] = {0, -arm->d[3] - arm->d[5], arm->d[0] - arm->a[1] - arm->a[2] + arm->d[4]};
        struct lw_pose frame[LW_NJ];
        fk(arm, q, frame);
        assert_all_near(frame[5].p, tip, 3, 1e-15);
    }
}

// Reach of the UR5 from its shoulder, over many configurations: never beyond 0.94993 m, and it gets near.
static void the_ur5_reaches_as_far_as_the_paper_needs(void **state)
{
    (void)state;
    struct random random = {32};
    double farthest = 0;
    for (int i = 0; i < 20000; i++) {
        double q[LW_NJ], reach[3];
        struct lw_pose frame[LW_NJ];
        random_fill(&random, -pi, pi, q, LW_NJ);
        q[2] = random_in(&random, -0.1, 0.1);
        fk(lw_arm_get(LW_UR5), q, frame);
        lw_vec_sub(frame[5].p, frame[0].p, reach);
        farthest = fmax(farthest, lw_vec_norm(reach));
    }
    assert_true(farthest < 0.94994 && farthest > 0.94);
}

// --- poses ---

// Each frame is the one before it times Rz(q) Tz(d) Tx(a) Rx(alpha), multiplied out.
static void check_dh_product(const struct lw_arm *arm, const double q[LW_NJ], struct random *random)
{
    (void)random;
    struct lw_pose frame[LW_NJ], from = {.r = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
    fk(arm, q, frame);
    for (int j = 0; j < LW_NJ; j++) {
        const double c = cos(q[j]), s = sin(q[j]), ca = arm->cos_alpha[j], sa = arm->sin_alpha[j];
        const double turn[3][3] = {{c, -s * ca, s * sa}, {s, c * ca, -c * sa}, {0, sa, ca}};
        const double shift[3] = {arm->a[j] * c, arm->a[j] * s, arm->d[j]};
        for (int i = 0; i < 3; i++) {
            const double *row = &from.r[3 * i];
            assert_near(frame[j].p[i], from.p[i] + lw_vec_dot(row, shift), 1e-15);
            for (int k = 0; k < 3; k++)
                assert_near(frame[j].r[3 * i + k], row[0] * turn[0][k] + row[1] * turn[1][k] + row[2] * turn[2][k],
                            2e-15);
        }
        from = frame[j];
    }
}

static void frames_are_products_of_dh_matrices(void **state)
{
    (void)state;
    for_random_poses(check_dh_product);
}

// Rotations are orthonormal and right-handed.
static void check_rotations(const struct lw_arm *arm, const double q[LW_NJ], struct random *random)
{
    (void)random;
    struct lw_pose frame[LW_NJ];
    fk(arm, q, frame);
    for (int f = 0; f < LW_NJ; f++) {
        const double *r = frame[f].r;
        double third[3];
        lw_vec_cross(&r[0], &r[3], third);
        assert_all_near(third, &r[6], 3, 1e-14);
        for (int i = 0; i < 3; i++)
            for (int k = 0; k < 3; k++)
                assert_near(lw_vec_dot(&r[3 * i], &r[3 * k]), i == k, 1e-14);
    }
}

static void rotations_are_orthonormal(void **state)
{
    (void)state;
    for_random_poses(check_rotations);
}

// A configuration with a value that is no number is refused and the frames stay as they were.
static void no_number_is_refused(void **state)
{
    (void)state;
    const double bad[] = {NO_NUMBER, HUGE_VAL, -HUGE_VAL};
    for (int i = 0; i < 3 * LW_NJ; i++) {
        double q[LW_NJ] = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6};
        struct lw_pose frame[LW_NJ], before[LW_NJ];
        memset(frame, 0x5a, sizeof frame);
        memcpy(before, frame, sizeof frame);
        q[i / 3] = bad[i % 3];
        assert_int_equal(lw_arm_fk(lw_arm_get(LW_UR5), q, frame), LW_E_NOT_FINITE);
        assert_same_bits(frame, before, sizeof frame);
    }
}

// --- Jacobians ---

// Velocity of a point of a link when joint j turns, by central differences.
static void point_difference(const struct lw_arm *arm, const double q[LW_NJ], int joint, int link,
                             const double local[3], double velocity[3])
{
    const double h = 1e-5;
    double ahead[3], behind[3], moved[LW_NJ];
    struct lw_pose frame[LW_NJ];
    memcpy(moved, q, sizeof moved);
    moved[joint] = q[joint] + h;
    fk(arm, moved, frame);
    place(frame, link, local, ahead);
    moved[joint] = q[joint] - h;
    fk(arm, moved, frame);
    place(frame, link, local, behind);
    for (int i = 0; i < 3; i++)
        velocity[i] = (ahead[i] - behind[i]) / (2 * h);
}

static void check_point_jacobian(const struct lw_arm *arm, const double q[LW_NJ], struct random *random)
{
    struct lw_pose frame[LW_NJ];
    fk(arm, q, frame);
    for (int link = 1; link <= LW_NJ; link++) {
        double local[3], point[3], jacobian[18];
        random_fill(random, -0.5, 0.5, local, 3);
        place(frame, link, local, point);
        memset(jacobian, 0x5a, sizeof jacobian);
        lw_arm_point_jacobian(frame, link, point, jacobian);
        for (int j = 0; j < LW_NJ; j++) {
            double velocity[3];
            point_difference(arm, q, j, link, local, velocity);
            for (int i = 0; i < 3; i++)
                assert_near(jacobian[LW_NJ * i + j], j < link ? velocity[i] : 0, j < link ? 1e-9 : 0);
        }
    }
}

static void point_jacobians_are_derivatives_on_every_link(void **state)
{
    (void)state;
    for_random_poses(check_point_jacobian);
}

// The tip's linear rows are the point Jacobian of the last origin; the angular rows are the joint axes, whose turn rate
// differences of the rotation confirm.
static void check_tip_jacobian(const struct lw_arm *arm, const double q[LW_NJ], struct random *random)
{
    (void)random;
    const double h = 1e-5, tip[3] = {0};
    struct lw_pose frame[LW_NJ], ahead[LW_NJ], behind[LW_NJ];
    double jacobian[36], point[18];
    fk(arm, q, frame);
    lw_arm_jacobian(frame, jacobian);
    lw_arm_point_jacobian(frame, LW_NJ, frame[LW_NJ - 1].p, point);
    assert_all_near(jacobian, point, 18, 1e-15);
    for (int j = 0; j < LW_NJ; j++) {
        double velocity[3], moved[LW_NJ];
        point_difference(arm, q, j, LW_NJ, tip, velocity);
        for (int i = 0; i < 3; i++)
            assert_near(jacobian[LW_NJ * i + j], velocity[i], 1e-9);
        memcpy(moved, q, sizeof moved);
        moved[j] = q[j] + h;
        fk(arm, moved, ahead);
        moved[j] = q[j] - h;
        fk(arm, moved, behind);
        // dR/dq = [w]x R: column by column.
        for (int column = 0; column < 3; column++) {
            const double w[3] = {jacobian[18 + j], jacobian[24 + j], jacobian[30 + j]};
            const double axis[3] = {frame[5].r[column], frame[5].r[3 + column], frame[5].r[6 + column]};
            double turned[3];
            lw_vec_cross(w, axis, turned);
            for (int i = 0; i < 3; i++)
                assert_near((ahead[5].r[3 * i + column] - behind[5].r[3 * i + column]) / (2 * h), turned[i], 1e-9);
        }
    }
}

static void the_tip_jacobian_is_the_derivative_of_the_pose(void **state)
{
    (void)state;
    for_random_poses(check_tip_jacobian);
}

// The first origin lies on axis 1: nothing moves it.
static void check_first_origin(const struct lw_arm *arm, const double q[LW_NJ], struct random *random)
{
    (void)random;
    const double zero[18] = {0};
    struct lw_pose frame[LW_NJ];
    double jacobian[18];
    fk(arm, q, frame);
    lw_arm_point_jacobian(frame, 1, frame[0].p, jacobian);
    assert_all_near(jacobian, zero, 18, 0);
}

static void the_first_origin_never_moves(void **state)
{
    (void)state;
    for_random_poses(check_first_origin);
}

// --- wrenches ---

// Any number of forces at any points of any links: the recursion gives the sum of J_x^T F.
static void check_wrench(const struct lw_arm *arm, const double q[LW_NJ], struct random *random)
{
    struct lw_pose frame[LW_NJ];
    struct lw_wrench wrench = {0};
    double expected[LW_NJ] = {0}, effect[LW_NJ];
    fk(arm, q, frame);
    for (int n = random_below(random, 10); n > 0; n--) {
        const int link = 1 + random_below(random, LW_NJ);
        double local[3], point[3], force[3], jacobian[18];
        random_fill(random, -0.5, 0.5, local, 3);
        random_fill(random, -3, 3, force, 3);
        place(frame, link, local, point);
        lw_wrench_add(&wrench, link, point, force);
        lw_arm_point_jacobian(frame, link, point, jacobian);
        for (int j = 0; j < LW_NJ; j++)
            for (int i = 0; i < 3; i++)
                expected[j] += jacobian[LW_NJ * i + j] * force[i];
    }
    lw_arm_joint_effect(frame, &wrench, effect);
    assert_all_near(effect, expected, LW_NJ, 1e-12);
}

static void the_wrench_recursion_equals_explicit_jacobians(void **state)
{
    (void)state;
    for_random_poses(check_wrench);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(zero_pose_of_the_ur5),
        cmocka_unit_test(zero_pose_of_the_ur10),
        cmocka_unit_test(upright_pose),
        cmocka_unit_test(the_ur5_reaches_as_far_as_the_paper_needs),
        cmocka_unit_test(frames_are_products_of_dh_matrices),
        cmocka_unit_test(rotations_are_orthonormal),
        cmocka_unit_test(no_number_is_refused),
        cmocka_unit_test(point_jacobians_are_derivatives_on_every_link),
        cmocka_unit_test(the_tip_jacobian_is_the_derivative_of_the_pose),
        cmocka_unit_test(the_first_origin_never_moves),
        cmocka_unit_test(the_wrench_recursion_equals_explicit_jacobians),
    };
    return cmocka_run_group_tests_name("kinematics", tests, NULL, NULL);
}
