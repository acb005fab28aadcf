// SPDX-License-Identifier: BSD-3-Clause
// Tests of what a scene says about obstacles, sensor and tool: what is read, what is refused and in which words.
//
// Units    metres, seconds, Hz; degrees where a name says so.
// Frames   base frame; the tool in frame 6.
// Arrays   points [3] x y z.
// Memory   static scenes; streams are freed here.
// Errors   cmocka's.
#define _GNU_SOURCE   // open_memstream
#include "base/vec.h" // lw_vec_*
#include "helpers.h"
#include "scene_text.h" // accept_scene, refuse_scene

// --- reading ---

static const char every_shape[] =
    "obstacles:\n"
    "  - {at: [1, 2, 3], radius: 0.5}\n"
    "  - {shape: capsule, at: [0, 0, 1], rpy_deg: [90, 0, 0], radius: 0.1, half_length: 0.4, spin: [0, 0, 1]}\n"
    "  - {shape: box, at: [0, 1, 0], half_extents: [0.1, 0.2, 0.3], rounding: 0.01}\n"
    "  - {shape: hull, at: [0, 0, 0], vertices: [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], rounding: 0.02}\n"
    "  - {shape: plane, at: [0, 0, -0.1], normal: [0, 0, 2]}\n"
    "  - shape: hull\n"
    "    at: [5, 5, 5]\n"
    "    vertices: [[-1, 0.25, 0]]\n"
    "    visible_s: [1, 2]\n"
    "    motion: {kind: circle, centre: [0, 0, 0], period_s: 20}\n";

static void every_shape_is_read(void **state)
{
    (void)state;
    const struct lw_scene *scene = accept_scene(every_shape, NULL);
    assert_int_equal(scene->obstacle_count, 6);
    for (int i = 0; i < 6; i++) {
        static const int shapes[] = {LW_SPHERE, LW_CAPSULE, LW_BOX, LW_HULL, LW_HALFSPACE, LW_HULL};
        assert_int_equal(scene->obstacle[i].shape, shapes[i]);
        assert_int_equal(scene->obstacle[i].id, i + 1);
        assert_int_equal(scene->obstacle[i].line, 5 + i);
    }
    const struct lw_scene_obstacle *o = scene->obstacle;
    assert_near(o[0].radius, 0.5, 0);
    assert_true(o[0].visible_s[0] == 0 && isinf(o[0].visible_s[1]));
    assert_near(o[1].half_length, 0.4, 0);
    assert_near(o[1].spin[2], 1, 0);
    assert_near(o[2].half_extents[1], 0.2, 0);
    assert_near(o[2].rounding, 0.01, 0);
    assert_int_equal(o[3].vertices.count, 4);
    assert_near(scene->number[o[3].vertices.first + 11], 1, 0);
    assert_near(o[4].normal[2], 2, 0);
    assert_near(scene->number[o[5].vertices.first + 1], 0.25, 0);
    assert_true(o[5].visible_s[0] == 1 && o[5].visible_s[1] == 2 && o[5].motion.axis[2] == 1);
}

// A scene with everything in it is written so that it reads back to the same text.
static void what_is_written_reads_back(void **state)
{
    (void)state;
    char more[2048];
    snprintf(more, sizeof more,
             "seed: 12\ntool: {kind: hull, vertices: [[0, 0, 0], [0, 0, 0.1]], radius: 0.02}\n"
             "sensor: {rate_hz: 25, noise_m: 0.003, latency_s: 0.04, valid_for_s: 0.5}\n%s",
             every_shape);
    char *text[2] = {NULL, NULL};
    size_t size = 0;
    static struct lw_scene scene;
    scene = *accept_scene(more, NULL);
    for (int i = 0; i < 2; i++) {
        FILE *to = open_memstream(&text[i], &size);
        lw_scene_write(&scene, to);
        assert_int_equal(fclose(to), 0);
        struct lw_error error = {""};
        const struct lw_source source = {.name = "written", .text = text[i]};
        if (lw_scene_read(&source, &scene, &error) != LW_OK)
            fail_msg("%s", error.text);
    }
    assert_string_equal(text[0], text[1]);
    assert_non_null(strstr(text[0], "{id: 3, shape: box, at: [0, 1, 0], rpy_deg: [0, 0, 0], "
                                    "half_extents: [0.1, 0.2, 0.3], rounding: 0.01, "));
    free(text[0]);
    free(text[1]);
}

// As many obstacles as there may be, with as many numbers as there may be, are written and read.
static void the_largest_scene_reads_back(void **state)
{
    (void)state;
    static char more[1 << 16];
    size_t at = (size_t)snprintf(more, sizeof more, "obstacles:\n");
    for (int i = 0; i < LW_SCENE_OBSTACLES; i++) {
        at += (size_t)snprintf(more + at, sizeof more - at, "  - {shape: hull, at: [%d, 0, 0], vertices: [", i % 90);
        for (int k = 0; k < LW_SCENE_NUMBERS / 3 / LW_SCENE_OBSTACLES; k++)
            at += (size_t)snprintf(more + at, sizeof more - at, "%s[%d, 1, 0]", k ? ", " : "", k);
        at += (size_t)snprintf(more + at, sizeof more - at, "]}\n");
    }
    static struct lw_scene scene, back;
    scene = *accept_scene(more, NULL);
    assert_int_equal(scene.number_count, LW_SCENE_NUMBERS);
    char *text = NULL;
    size_t size = 0;
    FILE *to = open_memstream(&text, &size);
    lw_scene_write(&scene, to);
    assert_int_equal(fclose(to), 0);
    struct lw_error error = {""};
    const struct lw_source source = {.name = "written", .text = text};
    if (lw_scene_read(&source, &back, &error) != LW_OK)
        fail_msg("%s", error.text);
    assert_int_equal(back.obstacle_count, LW_SCENE_OBSTACLES);
    assert_same_bits(back.number, scene.number, sizeof scene.number);
    free(text);
}

// --- orientation ---

static void check_axes(const char *keys, const double *columns)
{
    char more[256];
    snprintf(more, sizeof more, "obstacles: [{at: [0, 0, 0], %s}]\n", keys);
    double quat[4];
    struct lw_pose pose;
    lw_scene_obstacle_quat(&accept_scene(more, NULL)->obstacle[0], quat);
    assert_int_equal(lw_pose_make((const double[3]){0, 0, 0}, quat, &pose), LW_OK);
    for (int axis = 0; axis < 3; axis++)
        for (int i = 0; i < 3; i++)
            assert_near(pose.r[3 * i + axis], columns[3 * axis + i], 1e-15);
}

// Where x, y and z of the body point: turned about fixed axes, x first.
static void angles_turn_about_fixed_axes(void **state)
{
    (void)state;
#define BOX "shape: box, half_extents: [1, 1, 1], "
    check_axes(BOX "rpy_deg: [0, 0, 0]", (const double[]){1, 0, 0, 0, 1, 0, 0, 0, 1});
    check_axes(BOX "rpy_deg: [90, 0, 0]", (const double[]){1, 0, 0, 0, 0, 1, 0, -1, 0});
    check_axes(BOX "rpy_deg: [0, 90, 0]", (const double[]){0, 0, -1, 0, 1, 0, 1, 0, 0});
    check_axes(BOX "rpy_deg: [0, 0, 90]", (const double[]){0, 1, 0, -1, 0, 0, 0, 0, 1});
    check_axes(BOX "rpy_deg: [90, 0, 90]", (const double[]){0, 1, 0, 0, 0, 1, 1, 0, 0});
    check_axes(BOX "rpy_deg: [90, 90, 0]", (const double[]){0, 0, -1, 1, 0, 0, 0, -1, 0});
}

// The z axis of a plane is its normal, also where the turn is nearly half a circle or none.
static void a_plane_lies_across_its_normal(void **state)
{
    (void)state;
    struct random random = {5};
    for (int i = 0; i < 1000; i++) {
        struct lw_scene_obstacle plane = {.shape = LW_HALFSPACE};
        const double size = pow(10, random_in(&random, -12, 0)) * (i % 3);
        plane.normal[2] = i % 2 ? -1 : 1;
        plane.normal[0] = random_in(&random, -size, size);
        plane.normal[1] = random_in(&random, -size, size);
        double quat[4];
        struct lw_pose pose;
        lw_scene_obstacle_quat(&plane, quat);
        assert_near(quat[0] * quat[0] + quat[1] * quat[1] + quat[2] * quat[2], 1, 1e-14);
        assert_int_equal(lw_pose_make(plane.at, quat, &pose), LW_OK);
        for (int k = 0; k < 3; k++)
            assert_near(pose.r[3 * k + 2], plane.normal[k] / lw_vec_norm(plane.normal), 1e-14);
    }
}

// --- defaults by other keys ---

static void the_sensor_is_faster_when_something_moves(void **state)
{
    (void)state;
    assert_near(accept_scene("obstacles: [{at: [1, 0, 0]}]\n", NULL)->sensor.rate_hz, 10, 0);
    assert_near(accept_scene("obstacles: [{at: [1, 0, 0], velocity: [0, 0, 1]}]\n", NULL)->sensor.rate_hz, 30, 0);
    assert_near(
        accept_scene("sensor: {rate_hz: 5}\nobstacles: [{at: [1, 0, 0], velocity: [0, 0, 1]}]\n", NULL)->sensor.rate_hz,
        5, 0);
}

static void a_tool_is_read(void **state)
{
    (void)state;
    assert_int_equal(accept_scene("", NULL)->tool.kind, LW_TOOL_NONE);
    const struct lw_tool capsule =
        accept_scene("tool: {kind: capsule, a: [0, 0, 0.02], b: [0, 0, 0.2], radius: 0.04}\n", NULL)->tool;
    assert_int_equal(capsule.kind, LW_TOOL_CAPSULE);
    assert_true(capsule.capsule.a[2] == 0.02 && capsule.capsule.b[2] == 0.2 && capsule.capsule.r == 0.04);
    const struct lw_tool hull = accept_scene("tool: {kind: hull, vertices: [[0, 0, 0], [0.1, 0, 0.3]]}\n", NULL)->tool;
    assert_int_equal(hull.kind, LW_TOOL_HULL);
    assert_int_equal(hull.count, 2);
    assert_near(hull.vertex[5], 0.3, 0);
    assert_near(hull.radius, 0.01, 0);
}

// --- refusal ---

static void bad_obstacles_are_refused(void **state)
{
    (void)state;
    static const struct {
        const char *keys, *words;
    } bad[] = {
        {"shape: ball", ".shape: expected one of sphere, capsule, box, hull, plane, found \"ball\""},
        {"half_length: 1", ".half_length: expected this key with shape capsule only, found sphere"},
        {"shape: box, half_extents: [1, 1, 1], radius: 1",
         ".radius: expected this key with shape sphere, capsule only, found box"},
        {"normal: [0, 0, 1]", ".normal: expected this key with shape plane only, found sphere"},
        {"radius: -1", ".radius: expected a number >= 0 and <= 100 (m), found \"-1\""},
        {"shape: capsule", ".half_length: missing key: expected a number >= 0 and <= 100 (m)"},
        {"shape: box", ".half_extents: missing key: expected a list of 3 numbers > 0 and <= 100 (m)"},
        {"shape: box, half_extents: [1, 0, 1]",
         ".half_extents: expected a list of 3 numbers > 0 and <= 100 (m), found \"0\""},
        {"shape: hull",
         ".vertices: missing key: expected a list of at most 64 lists of 3 numbers >= -100 and <= 100 (m)"},
        {"shape: hull, vertices: []", ": expected a hull, found that a hull has 1 to 64 vertices"},
        {"shape: plane, normal: [0, 0, 0]", ".normal: expected a direction, found [0, 0, 0]"},
        {"visible_s: [3, 3]", ".visible_s: expected from < until, found 3 and 3"},
        {"motion: {speed: 1}", ".motion.speed: expected this key with kind waypoints, random only, found none"},
        {"motion: {kind: waypoints, waypoints: []}", ".motion.waypoints: expected at least one place, found none"},
        {"motion: {kind: waypoints, waypoints: [[1, 1, 1]]}",
         ".motion: expected either times_s or a speed > 0, found neither"},
        {"motion: {kind: waypoints, waypoints: [[1, 1, 1]], speed: 1, times_s: [1]}",
         ".motion: expected either times_s or a speed > 0, found both"},
        {"motion: {kind: waypoints, waypoints: [[1, 1, 1]], times_s: [1, 2]}",
         ".motion.times_s: expected 1, one a waypoint, found 2"},
        {"motion: {kind: waypoints, waypoints: [[1, 1, 1]], times_s: [1], repeat: loop}",
         ".motion.times_s: expected 2, one a waypoint and one for the way back, found 1"},
        {"motion: {kind: waypoints, waypoints: [[1, 1, 1], [0, 0, 0]], times_s: [2, 2]}",
         ".motion.times_s: expected times that rise, found 2 after 2"},
        {"motion: {kind: waypoints, waypoints: [[1, 0, 0]], speed: 1, repeat: loop}",
         ".motion.waypoints: expected a place other than `at`, found none"},
        {"motion: {kind: circle, centre: [0, 0, 0], axis: [0, 0, 0], period_s: 1}",
         ".motion.axis: expected a direction, found [0, 0, 0]"},
        {"motion: {kind: circle, centre: [1, 0, 9], period_s: 1}",
         ".motion: expected a circle at a speed > 0 and <= 20 (m/s), found 0"},
        {"motion: {kind: circle, centre: [0, 0, 0], period_s: 0.1}",
         ".motion: expected a circle at a speed > 0 and <= 20 (m/s), found 62.8319"},
        {"motion: {kind: random, reach: [0, 0, 0], speed: 1}",
         ".motion.reach: expected at least 0.001 (m) one way, found less"},
        {"motion: {kind: random, reach: [1, 0, 0]}", ".motion.speed: expected a number > 0 (m/s), found 0"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        char more[320], words[320];
        snprintf(more, sizeof more, "obstacles:\n  - {at: [0, 1, 0]}\n  - {at: [1, 0, 0], %s}\n", bad[i].keys);
        snprintf(words, sizeof words, "s.yaml:6: obstacles.1%s", bad[i].words);
        refuse_scene(more, words);
    }
    refuse_scene("obstacles:\n  - {id: 2, at: [0, 1, 0]}\n\n  - {at: [1, 0, 0]}\n",
                 "s.yaml:7: obstacles.1.id: expected a number of its own, found 2 again");
}

static void bad_sensors_and_tools_are_refused(void **state)
{
    (void)state;
    static const struct {
        const char *more, *words;
    } bad[] = {
        {"sensor: {valid_for_s: 0.15}",
         "s.yaml: sensor.valid_for_s: expected at least two samples and the latency, 0.2 s, found 0.15"},
        {"sensor: {rate_hz: 100, latency_s: 0.5, valid_for_s: 0.5}",
         "s.yaml: sensor.valid_for_s: expected at least two samples and the latency, 0.52 s, found 0.5"},
        {"sensor: {noise_m: -1}", "s.yaml:4: sensor.noise_m: expected a number >= 0 and <= 1 (m), found \"-1\""},
        {"seed: -1", "s.yaml:4: seed: expected an integer >= 0 and <= 1e+09, found \"-1\""},
        {"tool: {kind: capsule}", "s.yaml:4: tool.a: missing key: expected a list of 3 numbers >= -100 and <= 100 (m)"},
        {"tool: {radius: 1}", "s.yaml:4: tool.radius: expected this key with kind capsule, hull only, found none"},
        {"tool: {kind: hull, vertices: []}", "s.yaml: tool: expected a solid, found that a hull has 1 to 64 vertices"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        refuse_scene(bad[i].more, bad[i].words);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_shape_is_read),
        cmocka_unit_test(what_is_written_reads_back),
        cmocka_unit_test(the_largest_scene_reads_back),
        cmocka_unit_test(angles_turn_about_fixed_axes),
        cmocka_unit_test(a_plane_lies_across_its_normal),
        cmocka_unit_test(the_sensor_is_faster_when_something_moves),
        cmocka_unit_test(a_tool_is_read),
        cmocka_unit_test(bad_obstacles_are_refused),
        cmocka_unit_test(bad_sensors_and_tools_are_refused),
    };
    return cmocka_run_group_tests_name("scene_obstacles", tests, NULL, NULL);
}
