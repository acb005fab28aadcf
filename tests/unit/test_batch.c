// SPDX-License-Identifier: BSD-3-Clause
// Tests of batch runs: how many rows, what they hold, and that a run depends on its scene alone.
//
// Units    metres, radians, seconds.
// Frames   base frame.
// Arrays   see simulator/batch.h.
// Memory   static.
// Errors   cmocka's; threads only compute.
#include "arm/joint.h" // enum lw_flag
#include "helpers.h"
#include "simulator/batch.h"

#include <pthread.h> // pthread_create

enum { ROWS = 1001, GUARD_ROWS = 2, THREADS = 2 };

struct run {
    double t[ROWS + GUARD_ROWS], q[ROWS + GUARD_ROWS][LW_NJ], qd[ROWS + GUARD_ROWS][LW_NJ], tip[ROWS + GUARD_ROWS][3];
    double deviation[ROWS + GUARD_ROWS], clearance[ROWS + GUARD_ROWS], self_clearance[ROWS + GUARD_ROWS];
    int flags[ROWS + GUARD_ROWS], outcome[ROWS + GUARD_ROWS];
};

static struct lw_scene load(const char *name, const char *const *set, int set_count)
{
    char path[512];
    struct lw_scene scene;
    struct lw_error error = {""};
    snprintf(path, sizeof path, "%s/%s", LEEWAY_SCENARIOS, name);
    if (lw_scene_load(path, set, set_count, &scene, &error) != LW_OK)
        fail_msg("%s", error.text);
    return scene;
}

// A run over memory of a known pattern.
static enum lw_status run_scene(const struct lw_scene *scene, struct run *run)
{
    memset(run, 0x5a, sizeof *run);
    const struct lw_batch_result result = {run->t,         &run->q[0][0],  &run->qd[0][0],      &run->tip[0][0],
                                           run->deviation, run->clearance, run->self_clearance, run->flags,
                                           run->outcome};
    return lw_batch_run(scene, &result);
}

// rows = steps + 1: the last row is written, the one behind it is not.
static void there_is_one_row_a_step_and_one_more(void **state)
{
    (void)state;
    static const char *const durations[] = {"duration_s=8", "duration_s=0.008", "duration_s=0.012", "duration_s=1.5"};
    for (int i = 0; i < 4; i++) {
        const struct lw_scene scene = load("c1.yaml", &durations[i], 1);
        static struct run run, pattern;
        memset(&pattern, 0x5a, sizeof pattern);
        assert_int_equal(run_scene(&scene, &run), LW_OK);
        const int64_t rows = lw_scene_steps(&scene) + 1;
        for (int64_t k = 0; k < rows; k++)
            assert_near(run.t[k], 0.008 * (double)k, 1e-12);
        assert_same_bits(&run.t[rows], &pattern.t[rows], sizeof run.t[0]);
        assert_same_bits(run.q[rows], pattern.q[rows], sizeof run.q[0]);
        assert_same_bits(run.qd[rows], pattern.qd[rows], sizeof run.qd[0]);
        assert_same_bits(run.tip[rows], pattern.tip[rows], sizeof run.tip[0]);
        assert_same_bits(&run.deviation[rows], &pattern.deviation[rows], sizeof run.deviation[0]);
        assert_same_bits(&run.clearance[rows], &pattern.clearance[rows], sizeof run.clearance[0]);
        assert_same_bits(&run.flags[rows], &pattern.flags[rows], sizeof run.flags[0]);
    }
}

// Each row is one explicit Euler step from the one before it, and tip and deviation are those of its q.
static void rows_are_euler_steps_of_their_own_numbers(void **state)
{
    (void)state;
    const struct lw_scene scene = load("c4.yaml", NULL, 0);
    static struct run run;
    assert_int_equal(run_scene(&scene, &run), LW_OK);
    assert_all_near(run.q[0], scene.q0, LW_NJ, 0);
    for (int k = 0; k < ROWS; k++) {
        struct lw_pose frame[LW_NJ];
        assert_int_equal(lw_arm_fk(lw_arm_get(LW_UR5), run.q[k], frame), LW_OK);
        assert_all_near(run.tip[k], frame[5].p, 3, 0);
        const double gap[3] = {scene.goal[0] - run.tip[k][0], scene.goal[1] - run.tip[k][1],
                               scene.goal[2] - run.tip[k][2]};
        assert_near(run.deviation[k], sqrt(gap[0] * gap[0] + gap[1] * gap[1] + gap[2] * gap[2]), 1e-15);
        for (int j = 0; k > 0 && j < LW_NJ; j++)
            assert_near(run.q[k][j], run.q[k - 1][j] + 0.008 * run.qd[k - 1][j], 0);
    }
}

// A plant at four times the rate, without limits of its own, moves the arm along the same path: only rounding differs.
static void a_faster_plant_follows_the_same_path(void **state)
{
    (void)state;
    static const char *const fast[] = {"plant.rate_hz=500"};
    const struct lw_scene one = load("c4.yaml", NULL, 0), four = load("c4.yaml", fast, 1);
    static struct run a, b;
    assert_int_equal(lw_scene_plant_ratio(&four), 4);
    assert_int_equal(run_scene(&one, &a), LW_OK);
    assert_int_equal(run_scene(&four, &b), LW_OK);
    assert_all_near(b.t, a.t, ROWS, 1e-12);
    assert_all_near(&b.q[0][0], &a.q[0][0], ROWS * LW_NJ, 1e-10);
}

// With all limits on, no row breaks one, also when the plant runs four times as fast, and the arm arrives.
static void limits_hold_in_every_row(void **state)
{
    (void)state;
    static const char *const sets[] = {"rate_hz=125", "duration_s=8", "plant.timeout_s=0.04", "plant.rate_hz=500"};
    for (int set_count = 3; set_count <= 4; set_count++) {
        const struct lw_scene scene = load("reach.yaml", sets, set_count);
        static struct run run;
        assert_int_equal(run_scene(&scene, &run), LW_OK);
        assert_true(run.flags[1] & LW_LIMIT_ACCELERATION);
        for (int k = 1; k < ROWS; k++)
            for (int j = 0; j < LW_NJ; j++) {
                assert_true(fabs(run.qd[k][j]) <= scene.limits.velocity[j] + 1e-9);
                assert_true(fabs(run.qd[k][j] - run.qd[k - 1][j]) <= scene.limits.acceleration[j] * 0.008 + 1e-9);
                assert_true(run.q[k][j] <= scene.limits.position_max[j] && run.q[k][j] >= scene.limits.position_min[j]);
            }
        assert_true(run.deviation[ROWS - 1] < run.deviation[0] / 2);
    }
}

static void a_scene_without_obstacles_runs(void **state)
{
    (void)state;
    static const char *const none[] = {"obstacles=[]"};
    const struct lw_scene scene = load("c1.yaml", none, 1);
    static struct run run;
    assert_int_equal(run_scene(&scene, &run), LW_OK);
    for (int k = 0; k < ROWS; k++)
        assert_true(run.clearance[k] == HUGE_VAL && run.flags[k] == 0);
}

static void a_scene_of_no_robot_is_refused(void **state)
{
    (void)state;
    struct lw_scene scene = load("c1.yaml", NULL, 0);
    scene.robot = LW_ROBOT_COUNT;
    static struct run run;
    assert_int_equal(run_scene(&scene, &run), LW_E_ARGUMENT);
}

// --- a run depends on its scene alone ---

static const char *const names[] = {"c1.yaml", "c2.yaml", "c3.yaml", "c4.yaml"};
enum { CASES = 4 };
static struct lw_scene scenes[CASES];
static struct run serial[CASES], again[CASES], parallel[THREADS][CASES];

static void *run_all(void *user)
{
    struct run *runs = user;
    for (int c = 0; c < CASES; c++)
        (void)run_scene(&scenes[c], &runs[c]);
    return NULL;
}

// The same bits a second time, and from two threads at once.
static void runs_are_the_same_twice_and_in_threads(void **state)
{
    (void)state;
    pthread_t thread[THREADS];
    for (int c = 0; c < CASES; c++)
        scenes[c] = load(names[c], NULL, 0);
    (void)run_all(serial);
    (void)run_all(again);
    for (int i = 0; i < THREADS; i++)
        assert_int_equal(pthread_create(&thread[i], NULL, run_all, parallel[i]), 0);
    for (int i = 0; i < THREADS; i++)
        assert_int_equal(pthread_join(thread[i], NULL), 0);
    assert_same_bits(again, serial, sizeof serial);
    for (int i = 0; i < THREADS; i++)
        assert_same_bits(parallel[i], serial, sizeof serial);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(there_is_one_row_a_step_and_one_more),
        cmocka_unit_test(rows_are_euler_steps_of_their_own_numbers),
        cmocka_unit_test(a_faster_plant_follows_the_same_path),
        cmocka_unit_test(limits_hold_in_every_row),
        cmocka_unit_test(a_scene_without_obstacles_runs),
        cmocka_unit_test(a_scene_of_no_robot_is_refused),
        cmocka_unit_test(runs_are_the_same_twice_and_in_threads),
    };
    return cmocka_run_group_tests_name("batch", tests, NULL, NULL);
}
