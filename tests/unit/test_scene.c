// SPDX-License-Identifier: BSD-3-Clause
// Tests of scenes: defaults of a robot, checks that concern several keys at once, and every file in scenarios/.
//
// Units    metres, radians, seconds, Hz.
// Frames   base frame.
// Arrays   one entry a joint.
// Memory   streams are freed here.
// Errors   cmocka's.
#define _GNU_SOURCE // open_memstream
#include "helpers.h"
#include "scene/scene.h"

#include <glob.h>   // glob
#include <unistd.h> // write, close, unlink

static const char smallest[] = "robot: ur5\nq0: [0, 0, 0, 0, 0, 0]\nrequest: {goal: [0.5, 0, 0.5]}\n";

static enum lw_status read_text(const char *text, const char *set, struct lw_scene *scene, struct lw_error *error)
{
    const struct lw_source source = {.name = "s.yaml", .text = text, .set = &set, .set_count = set != NULL};
    return lw_scene_read(&source, scene, error);
}

static struct lw_scene accept(const char *set)
{
    struct lw_scene scene;
    struct lw_error error = {""};
    if (read_text(smallest, set, &scene, &error) != LW_OK)
        fail_msg("refused: %s", error.text);
    return scene;
}

// Refused with these words behind the name of the source; the scene is as it was.
static void refuse(const char *set, const char *words)
{
    struct lw_scene scene, before;
    struct lw_error error = {""};
    memset(&scene, 0x5a, sizeof scene);
    memcpy(&before, &scene, sizeof scene);
    assert_int_equal(read_text(smallest, set, &scene, &error), LW_E_SCENE);
    assert_string_equal(error.text, words);
    assert_same_bits(&scene, &before, sizeof scene);
}

// All values, to the last bit; padding is not looked at.
static void check_same_law(const struct lw_law_params *a, const struct lw_law_params *b)
{
    const double a_gains[] = {a->apf.k_a,      a->apf.r0,           a->apf.eta,
                              a->apf.rho_rep,  a->apf.distance_min, a->apf.approach_s,
                              a->apf.eta_self, a->apf.rho_self,     a->remedy.circulation};
    const double b_gains[] = {b->apf.k_a,      b->apf.r0,           b->apf.eta,
                              b->apf.rho_rep,  b->apf.distance_min, b->apf.approach_s,
                              b->apf.eta_self, b->apf.rho_self,     b->remedy.circulation};
    assert_same_bits(a_gains, b_gains, sizeof a_gains);
    assert_true(a->name == b->name && a->control_points == b->control_points);
    assert_true(a->apf.attraction == b->apf.attraction && a->apf.gamma == b->apf.gamma);
    assert_int_equal(a->remedy.kind, b->remedy.kind);
    assert_same_bits(a->remedy.axis, b->remedy.axis, sizeof a->remedy.axis);
}

static void check_same_scene(const struct lw_scene *a, const struct lw_scene *b)
{
    assert_true(a->robot == b->robot && a->rate_hz == b->rate_hz && a->duration_s == b->duration_s);
    assert_same_bits(a->q0, b->q0, sizeof a->q0);
    assert_same_bits(&a->limits, &b->limits, sizeof a->limits);
    assert_same_bits(&a->plant, &b->plant, sizeof a->plant);
    assert_same_bits(a->goal, b->goal, sizeof a->goal);
    check_same_law(&a->law, &b->law);
    assert_int_equal(a->obstacle_count, b->obstacle_count);
    for (int i = 0; i < a->obstacle_count; i++) {
        assert_int_equal(a->obstacle[i].id, b->obstacle[i].id);
        assert_same_bits(a->obstacle[i].at, b->obstacle[i].at, sizeof a->obstacle[i].at);
        assert_true(a->obstacle[i].radius == b->obstacle[i].radius);
    }
}

// --- defaults ---

// Ranges and speeds come from the robot's own table, for the guard and for the plant.
static void the_robot_decides_the_defaults(void **state)
{
    (void)state;
    for (int robot = 0; robot < LW_ROBOT_COUNT; robot++) {
        const struct lw_arm *arm = lw_arm_get((enum lw_robot)robot);
        char set[32];
        snprintf(set, sizeof set, "robot=%s", arm->name);
        const struct lw_scene scene = accept(set);
        assert_int_equal(scene.robot, robot);
        for (int j = 0; j < LW_NJ; j++) {
            assert_near(scene.limits.position_min[j], -arm->position_max[j], 0);
            assert_near(scene.limits.position_max[j], arm->position_max[j], 0);
            assert_near(scene.limits.velocity[j], arm->velocity_max[j], 0);
            assert_near(scene.plant.velocity[j], arm->velocity_max[j], 0);
            assert_near(scene.limits.acceleration[j], 8, 0);
            assert_near(scene.plant.acceleration[j], 8, 0);
        }
    }
    assert_near(accept("robot=ur10").limits.velocity[0], 2 * 3.14159265358979323846 / 3, 1e-15);
    assert_near(accept("robot=ur5").limits.velocity[0], 3.14159265358979323846, 1e-15);
}

// The smallest scene is the defaults plus what it says.
static void what_is_left_out_is_the_default(void **state)
{
    (void)state;
    const struct lw_scene scene = accept(NULL), defaults = lw_scene_defaults(LW_UR5);
    assert_near(scene.rate_hz, defaults.rate_hz, 0);
    assert_near(scene.duration_s, defaults.duration_s, 0);
    assert_near(scene.plant.timeout_s, defaults.plant.timeout_s, 0);
    check_same_law(&scene.law, &defaults.law);
    assert_int_equal(scene.obstacle_count, 0);
    assert_near(scene.goal[0], 0.5, 0);
}

// Defaults pass the checks of a file: what is written reads back to the same scene.
static void a_written_scene_reads_back_to_the_same_bits(void **state)
{
    (void)state;
    const char *const sets[] = {"plant.velocity=off",
                                "plant.acceleration=[off, 8, 9, off, 10, 8.5]",
                                "obstacles=[{at: [1, 0.1, -3e-9], radius: 0.1}, {at: [0, 0, 0]}]",
                                "rate_hz=333",
                                "robot=ur10",
                                "q0=[0.1, 1e-17, 2, -3, 6.2, -0.7]"};
    for (size_t i = 0; i < sizeof sets / sizeof sets[0]; i++) {
        const struct lw_scene scene = accept(sets[i]);
        char *text = NULL;
        size_t size = 0;
        FILE *to = open_memstream(&text, &size);
        lw_scene_write(&scene, to);
        assert_int_equal(fclose(to), 0);
        struct lw_scene back;
        struct lw_error error = {""};
        assert_int_equal(read_text(text, NULL, &back, &error), LW_OK);
        check_same_scene(&back, &scene);
        free(text);
    }
}

// --- keys that depend on each other ---

static void the_plant_runs_at_the_controllers_rate_unless_told(void **state)
{
    (void)state;
    assert_near(accept("rate_hz=250").plant.rate_hz, 250, 0);
    assert_near(accept("plant.rate_hz=1500").plant.rate_hz, 1500, 0);
}

static void the_plants_rate_is_a_whole_multiple(void **state)
{
    (void)state;
    assert_int_equal(lw_scene_plant_ratio(&(const struct lw_scene){.rate_hz = 500, .plant = {.rate_hz = 500}}), 1);
    for (int ratio = 1; ratio <= 20; ratio++) {
        char set[48];
        snprintf(set, sizeof set, "plant.rate_hz=%d", 500 * ratio);
        const struct lw_scene scene = accept(set);
        assert_int_equal(lw_scene_plant_ratio(&scene), ratio);
    }
    refuse("plant.rate_hz=250", "s.yaml: plant.rate_hz: expected a whole multiple of rate_hz = 500, found 250");
    refuse("plant.rate_hz=750", "s.yaml: plant.rate_hz: expected a whole multiple of rate_hz = 500, found 750");
    refuse("plant.rate_hz=1e-8", "s.yaml: plant.rate_hz: expected a whole multiple of rate_hz = 500, found 1e-08");
    refuse("plant.rate_hz=1000.1", "s.yaml: plant.rate_hz: expected a whole multiple of rate_hz = 500, found 1000.1");
}

// What the guard brakes for, the plant can brake: weaker limits than the guard's are refused, joint by joint.
static void the_plant_is_as_strong_as_the_guard_believes(void **state)
{
    (void)state;
    assert_near(accept("plant.acceleration=8").plant.acceleration[3], 8, 0);
    refuse("plant.acceleration=[8, 8, 8, 7.5, 8, 8]",
           "s.yaml: plant.acceleration: joint 4: expected at least limits.acceleration = 8, found 7.5");
    refuse("limits.acceleration=off",
           "s.yaml: plant.acceleration: joint 1: expected at least limits.acceleration = inf, found 8");
    refuse("plant.velocity=3", "s.yaml: plant.velocity: joint 1: expected at least limits.velocity = 3.14159, found 3");
}

// A zero byte ends C's strings, not the file: what stands behind it may not be ignored.
static void a_file_with_a_zero_byte_is_refused(void **state)
{
    (void)state;
    char path[] = "scene-XXXXXX";
    static const char rest[] = "\0duration_s: -1\n";
    const int fd = mkstemp(path);
    assert_true(fd >= 0);
    assert_true(write(fd, smallest, strlen(smallest)) > 0);
    assert_true(write(fd, rest, sizeof rest) > 0);
    assert_int_equal(close(fd), 0);
    struct lw_scene scene;
    struct lw_error error = {""};
    assert_int_equal(lw_scene_load(path, NULL, 0, &scene, &error), LW_E_IO);
    assert_int_equal(unlink(path), 0);
}

// The plant must hear two commands in its timeout, or one late command stops it.
static void the_timeout_spans_two_controller_periods(void **state)
{
    (void)state;
    assert_near(accept("plant.timeout_s=0.004").plant.timeout_s, 0.004, 0);
    refuse("plant.timeout_s=0.00399",
           "s.yaml: plant.timeout_s: expected at least two controller periods, 0.004 s, found 0.00399");
    refuse("rate_hz=99", "s.yaml: plant.timeout_s: expected at least two controller periods, 0.020202 s, found 0.02");
}

static void the_start_lies_in_ranges_that_are_not_empty(void **state)
{
    (void)state;
    refuse("limits={position_min: [-1, -1, 1, -1, -1, -1], position_max: [1, 1, 1, 1, 1, 1]}",
           "s.yaml: limits: joint 3: expected position_min < position_max, found 1 and 1");
    refuse("limits.position_max=[1, 1, 1, 1, -0.5, 1]",
           "s.yaml: q0: joint 5: expected -6.28319 to -0.5 (rad, its range), found 0");
    refuse("limits.position_min=[-1, -1, -1, -1, -1, 0.25]",
           "s.yaml: q0: joint 6: expected 0.25 to 6.28319 (rad, its range), found 0");
    assert_near(accept("limits.position_max=[0, 0, 0, 0, 0, 0]").limits.position_max[5], 0, 0); // q0 at the end
}

// An id left out is the place in the list; no two obstacles share one, whether written or counted.
static void obstacles_have_ids_of_their_own(void **state)
{
    (void)state;
    const struct lw_scene scene =
        accept("obstacles=[{at: [1, 0, 0]}, {id: 9, at: [0, 2, 0]}, {at: [0, 0, 3], radius: 0.5}]");
    assert_int_equal(scene.obstacle[0].id, 1);
    assert_int_equal(scene.obstacle[1].id, 9);
    assert_int_equal(scene.obstacle[2].id, 3);
    refuse("obstacles=[{id: 2, at: [1, 0, 0]}, {at: [0, 1, 0]}]",
           "s.yaml: obstacles.1.id: expected a number of its own, found 2 again");
    refuse("obstacles=[{id: 5, at: [1, 0, 0]}, {id: 6, at: [0, 1, 0]}, {id: 5, at: [0, 1, 0]}]",
           "s.yaml: obstacles.2.id: expected a number of its own, found 5 again");
}

// --- numbers of a run ---

static void steps_and_periods_are_rounded(void **state)
{
    (void)state;
    assert_int_equal(lw_scene_steps(&(const struct lw_scene){.duration_s = 8, .rate_hz = 125}), 1000);
    assert_int_equal(lw_scene_steps(&(const struct lw_scene){.duration_s = 0.3, .rate_hz = 10}), 3);
    assert_int_equal(lw_scene_steps(&(const struct lw_scene){.duration_s = 1, .rate_hz = 2.5}), 3);
    assert_int_equal(lw_scene_steps(&(const struct lw_scene){.duration_s = 86400, .rate_hz = 10000}), 864000000);
    assert_int_equal(lw_scene_period_ns(125), 8000000);
    assert_int_equal(lw_scene_period_ns(3), 333333333);
    assert_int_equal(lw_scene_period_ns(1.5), 666666667);
}

// --- files ---

static void every_scenario_loads(void **state)
{
    (void)state;
    glob_t files;
    // NOLINTNEXTLINE(concurrency-mt-unsafe): one thread
    assert_int_equal(glob(LEEWAY_SCENARIOS "/*.yaml", 0, NULL, &files), 0);
    assert_true(files.gl_pathc >= 4);
    for (size_t i = 0; i < files.gl_pathc; i++) {
        struct lw_scene scene;
        struct lw_error error = {""};
        if (lw_scene_load(files.gl_pathv[i], NULL, 0, &scene, &error) != LW_OK)
            fail_msg("%s", error.text);
        assert_true(lw_scene_steps(&scene) > 0);
    }
    globfree(&files);
}

// C1..C4 are one scene but for the reach of the repulsion, with all limits off.
static void the_papers_cases_differ_in_rho_alone(void **state)
{
    (void)state;
    const double rho[] = {0.5, 1.5, 1.9, 2.5};
    struct lw_scene scene[4];
    for (int c = 0; c < 4; c++) {
        char path[512];
        struct lw_error error = {""};
        snprintf(path, sizeof path, "%s/c%d.yaml", LEEWAY_SCENARIOS, c + 1);
        assert_int_equal(lw_scene_load(path, NULL, 0, &scene[c], &error), LW_OK);
        assert_near(scene[c].law.apf.rho_rep, rho[c], 0);
        scene[c].law.apf.rho_rep = 0;
        check_same_scene(&scene[c], &scene[0]);
        assert_true(isinf(scene[c].limits.acceleration[5]) && isinf(scene[c].plant.velocity[0]));
    }
}

// A file that cannot be read, or is no scene by its size, is an I/O error with the system's words.
static void unreadable_files_are_refused(void **state)
{
    (void)state;
    static const struct {
        const char *path, *words;
    } bad[] = {{"no/such/scene.yaml", "no/such/scene.yaml: cannot read the scene: No such file or directory"},
               {LEEWAY_SCENARIOS, LEEWAY_SCENARIOS ": cannot read the scene: Is a directory"},
               {"/dev/zero", "/dev/zero: cannot read the scene: File too large"}};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct lw_scene scene;
        struct lw_error error = {""};
        assert_int_equal(lw_scene_load(bad[i].path, NULL, 0, &scene, &error), LW_E_IO);
        assert_string_equal(error.text, bad[i].words);
    }
}

// The reference of all keys names each of them, however deep it stands.
static void the_reference_names_every_key(void **state)
{
    (void)state;
    char *text = NULL;
    size_t size = 0;
    FILE *to = open_memstream(&text, &size);
    lw_scene_describe(to);
    assert_int_equal(fclose(to), 0);
    for (const struct lw_key *key = lw_scene_keys(); key->name != NULL; key++) {
        assert_non_null(strstr(text, key->name));
        assert_non_null(strstr(text, key->help));
        for (const struct lw_key *inner = key->keys; inner != NULL && inner->name != NULL; inner++) {
            assert_non_null(strstr(text, inner->name));
            assert_non_null(strstr(text, inner->help));
        }
    }
    free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_robot_decides_the_defaults),
        cmocka_unit_test(what_is_left_out_is_the_default),
        cmocka_unit_test(a_written_scene_reads_back_to_the_same_bits),
        cmocka_unit_test(the_plant_runs_at_the_controllers_rate_unless_told),
        cmocka_unit_test(the_plants_rate_is_a_whole_multiple),
        cmocka_unit_test(the_plant_is_as_strong_as_the_guard_believes),
        cmocka_unit_test(a_file_with_a_zero_byte_is_refused),
        cmocka_unit_test(the_timeout_spans_two_controller_periods),
        cmocka_unit_test(the_start_lies_in_ranges_that_are_not_empty),
        cmocka_unit_test(obstacles_have_ids_of_their_own),
        cmocka_unit_test(steps_and_periods_are_rounded),
        cmocka_unit_test(every_scenario_loads),
        cmocka_unit_test(the_papers_cases_differ_in_rho_alone),
        cmocka_unit_test(unreadable_files_are_refused),
        cmocka_unit_test(the_reference_names_every_key),
    };
    return cmocka_run_group_tests_name("scene", tests, NULL, NULL);
}
