// SPDX-License-Identifier: BSD-3-Clause
// Tests of the motion of obstacles: where they are, and that the velocity is the derivative of that.
//
// Units    metres, radians, seconds.
// Frames   base frame.
// Arrays   points [3] x y z.
// Memory   static scenes.
// Errors   cmocka's.
#include "scene/motion.h"

#include "base/vec.h" // lw_vec_*
#include "helpers.h"
#include "scene_text.h" // accept_scene

#define PI 3.14159265358979323846

static const char *const ways[] = {
    "{at: [1, 0, 0.5], velocity: [0.3, -0.2, 0.1]}",
    "{at: [1, 0, 0.5], start_s: 1.5, motion: {kind: waypoints, waypoints: [[0, 1, 0.5], [-1, 0, 0.2]], speed: 0.4}}",
    "{at: [1, 0, 0.5], motion: {kind: waypoints, waypoints: [[0, 1, 0.5], [-1, 0, 0]], times_s: [1, 3.5], "
    "repeat: back_and_forth}}",
    "{at: [1, 0, 0.5], motion: {kind: waypoints, waypoints: [[0, 1, 0.5], [-1, 0, 0]], times_s: [1, 3, 4.5], "
    "repeat: loop}}",
    "{at: [1, 0, 0.5], motion: {kind: circle, centre: [0.5, 0, 0], axis: [1, 2, -3], period_s: 4}}",
    "{at: [1, 0, 0.5], motion: {kind: random, reach: [0.5, 0.25, 0], speed: 0.7}, velocity: [0, 0, 0.125]}",
    "{at: [1, 0, 0.5], shape: box, half_extents: [1, 1, 1], rpy_deg: [20, 30, 40], spin: [0.3, -2, 1], start_s: 2}",
};
enum { WAYS = sizeof ways / sizeof ways[0] };

static const struct lw_scene *scene_of(const char *way)
{
    char more[512];
    snprintf(more, sizeof more, "seed: 7\nobstacles:\n  - %s\n", way);
    return accept_scene(more, NULL);
}

static struct lw_moving at(const struct lw_scene *scene, double t)
{
    struct lw_moving out;
    memset(&out, 0x5a, sizeof out);
    lw_motion_at(scene, &scene->obstacle[0], t, &out);
    return out;
}

// --- velocity ---

// Of p, and of what is fixed to the body: d/dt R x = omega x R x.
static void check_derivative(const struct lw_scene *scene, double t)
{
    static const double h = 1e-5;
    static const double x[3] = {0.3, -0.5, 0.7};
    const struct lw_moving before = at(scene, t - h), now = at(scene, t), after = at(scene, t + h);
    struct lw_pose pose[3];
    double turned[3][3], expected[3];
    assert_int_equal(lw_pose_make(before.p, before.quat, &pose[0]), LW_OK);
    assert_int_equal(lw_pose_make(now.p, now.quat, &pose[1]), LW_OK);
    assert_int_equal(lw_pose_make(after.p, after.quat, &pose[2]), LW_OK);
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++)
            turned[k][i] = lw_vec_dot(&pose[k].r[3 * i], x);
    lw_vec_cross(now.omega, turned[1], expected);
    for (int i = 0; i < 3; i++) {
        assert_near((after.p[i] - before.p[i]) / (2 * h), now.v[i], 1e-8);
        assert_near((turned[2][i] - turned[0][i]) / (2 * h), expected[i], 1e-8);
    }
}

// Corners and starts, where there is no derivative, are not looked at.
static bool is_smooth(const struct lw_scene *scene, double t)
{
    const struct lw_moving before = at(scene, t - 2e-5), after = at(scene, t + 2e-5);
    double change[3], turn[3];
    lw_vec_sub(after.v, before.v, change);
    lw_vec_sub(after.omega, before.omega, turn);
    return lw_vec_norm(change) < 1e-3 && lw_vec_norm(turn) < 1e-3;
}

static void velocity_is_the_derivative(void **state)
{
    (void)state;
    struct random random = {11};
    for (int w = 0; w < WAYS; w++) {
        const struct lw_scene *scene = scene_of(ways[w]);
        int looked_at = 0;
        for (int i = 0; i < 2000; i++) {
            const double t = random_in(&random, -1, 30);
            if (!is_smooth(scene, t))
                continue;
            check_derivative(scene, t);
            looked_at++;
        }
        assert_true(looked_at > 1900);
        assert_true(lw_motion_moves(&scene->obstacle[0]));
    }
}

// No jump anywhere: within a step nothing gets farther than its fastest part could.
static void motion_is_continuous(void **state)
{
    (void)state;
    for (int w = 0; w < WAYS; w++) {
        const struct lw_scene *scene = scene_of(ways[w]);
        struct lw_moving before = at(scene, -1);
        for (int i = 1; i < 16000; i++) {
            const struct lw_moving now = at(scene, -1 + i * 1e-3);
            double step[3], turn = 0;
            lw_vec_sub(now.p, before.p, step);
            for (int k = 0; k < 4; k++)
                turn += (now.quat[k] - before.quat[k]) * (now.quat[k] - before.quat[k]);
            assert_true(lw_vec_norm(step) <= 2e-3 && turn <= 2e-3 * 2e-3);
            before = now;
        }
    }
}

// Until its start it stands where it is, and says so.
static void it_stands_still_until_it_starts(void **state)
{
    (void)state;
    const double home[3] = {1, 0, 0.5}, none[3] = {0, 0, 0};
    for (int w = 0; w < WAYS; w++) {
        const struct lw_scene *scene = scene_of(ways[w]);
        for (int i = 0; i < 3; i++) {
            const struct lw_moving still = at(scene, scene->obstacle[0].start_s * i / 2);
            assert_all_near(still.p, home, 3, 0);
            assert_all_near(still.v, none, 3, 0);
            assert_all_near(still.omega, none, 3, 0);
        }
        const struct lw_moving later = at(scene, scene->obstacle[0].start_s + 0.1);
        assert_true(lw_vec_norm(later.v) + lw_vec_norm(later.omega) > 0);
    }
    assert_false(lw_motion_moves(&scene_of("{at: [1, 0, 0]}")->obstacle[0]));
}

// --- waypoints ---

struct stop {
    double t, p[3];
};

static void check_stops(const char *way, const struct stop *stops, int count)
{
    const struct lw_scene *scene = scene_of(way);
    for (int i = 0; i < count; i++) {
        const struct lw_moving there = at(scene, stops[i].t);
        assert_all_near(there.p, stops[i].p, 3, 1e-12);
    }
}

static void waypoints_are_reached_in_time(void **state)
{
    (void)state;
    const struct stop once[] = {{0, {1, 0, 0}}, {0.5, {1, 0.5, 0}}, {1, {1, 1, 0}},
                                {2, {2, 1, 0}}, {3, {3, 1, 0}},     {99, {3, 1, 0}}};
    check_stops("{at: [1, 0, 0], motion: {kind: waypoints, waypoints: [[1, 1, 0], [3, 1, 0]], times_s: [1, 3]}}", once,
                6);
    // At 2 m/s the legs take 0.5 s and 1 s.
    const struct stop by_speed[] = {{0.5, {1, 1, 0}}, {1, {2, 1, 0}}, {1.5, {3, 1, 0}}, {2, {3, 1, 0}}};
    check_stops("{at: [1, 0, 0], motion: {kind: waypoints, waypoints: [[1, 1, 0], [3, 1, 0]], speed: 2}}", by_speed, 4);
    const struct stop loop[] = {{2, {2, 1, 0}}, {3, {3, 1, 0}}, {5, {1, 0, 0}}, {6, {1, 1, 0}}, {13, {3, 1, 0}}};
    check_stops("{at: [1, 0, 0], motion: {kind: waypoints, waypoints: [[1, 1, 0], [3, 1, 0]], times_s: [1, 3, 5], "
                "repeat: loop}}",
                loop, 5);
    const struct stop back[] = {{3, {3, 1, 0}}, {4, {2, 1, 0}}, {5, {1, 1, 0}},
                                {6, {1, 0, 0}}, {7, {1, 1, 0}}, {15, {3, 1, 0}}};
    check_stops("{at: [1, 0, 0], motion: {kind: waypoints, waypoints: [[1, 1, 0], [3, 1, 0]], times_s: [1, 3], "
                "repeat: back_and_forth}}",
                back, 6);
}

// --- circle ---

static void a_circle_keeps_its_distance_and_its_period(void **state)
{
    (void)state;
    const struct lw_scene *scene =
        scene_of("{at: [2, 1, 3], motion: {kind: circle, centre: [1, 1, 0], axis: [0, 0, 5], period_s: 8}}");
    const double quarter[3] = {1, 2, 3}, half[3] = {0, 1, 3}, home[3] = {2, 1, 3};
    assert_all_near(at(scene, 2).p, quarter, 3, 1e-15); // right-handed about z
    assert_all_near(at(scene, 4).p, half, 3, 1e-15);
    assert_all_near(at(scene, 8e4).p, home, 3, 1e-9);
    for (int i = 0; i < 100; i++)
        assert_near(lw_vec_norm(at(scene, 0.01 + 0.3 * i).v), 2 * PI / 8, 1e-12);
}

// --- random ---

static void a_random_way_keeps_its_reach_and_its_speed(void **state)
{
    (void)state;
    const struct lw_scene *scene =
        scene_of("{at: [1, 0, 0.5], motion: {kind: random, reach: [0.5, 0.25, 0], speed: 0.7}}");
    double farthest[3] = {0, 0, 0}, fastest = 0;
    for (int i = 0; i < 100000; i++) {
        const struct lw_moving now = at(scene, 0.013 * i);
        for (int k = 0; k < 3; k++)
            farthest[k] = fmax(farthest[k], fabs(now.p[k] - scene->obstacle[0].at[k]));
        fastest = fmax(fastest, lw_vec_norm(now.v));
    }
    // It uses what it may: a way that hardly moves would pass the limits too.
    assert_true(farthest[0] <= 0.5 && farthest[0] > 0.25 && farthest[1] <= 0.25 && farthest[1] > 0.125);
    assert_near(farthest[2], 0, 0);
    assert_true(fastest <= 0.7 && fastest > 0.35);
}

// The seed and the id draw the way: the same ones the same bits, others another way.
static void the_seed_draws_the_way(void **state)
{
    (void)state;
    static const char way[] = "seed: %d\nobstacles: [{id: %d, at: [0, 0, 0], motion: {kind: random, reach: [1, 1, 1], "
                              "speed: 1}}]\n";
    struct lw_moving drawn[4];
    static const int labels[4][2] = {{3, 1}, {3, 1}, {4, 1}, {3, 2}};
    for (int i = 0; i < 4; i++) {
        char more[160];
        snprintf(more, sizeof more, way, labels[i][0], labels[i][1]);
        drawn[i] = at(accept_scene(more, NULL), 2.5);
    }
    assert_same_bits(&drawn[0], &drawn[1], sizeof drawn[0]);
    for (int k = 0; k < 3; k++) {
        assert_true(fabs(drawn[2].p[k] - drawn[0].p[k]) > 1e-3);
        assert_true(fabs(drawn[3].p[k] - drawn[0].p[k]) > 1e-3);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(velocity_is_the_derivative),
        cmocka_unit_test(motion_is_continuous),
        cmocka_unit_test(it_stands_still_until_it_starts),
        cmocka_unit_test(waypoints_are_reached_in_time),
        cmocka_unit_test(a_circle_keeps_its_distance_and_its_period),
        cmocka_unit_test(a_random_way_keeps_its_reach_and_its_speed),
        cmocka_unit_test(the_seed_draws_the_way),
    };
    return cmocka_run_group_tests_name("motion", tests, NULL, NULL);
}
