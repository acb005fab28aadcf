// SPDX-License-Identifier: BSD-3-Clause
// Tests of the sensor: which samples it takes, what their messages say, and that a world that hears them holds what is
// there, whatever gets lost or comes late.
//
// Units    metres, seconds; ns and ms where a name says so.
// Frames   base frame.
// Arrays   see scene/sensor.h.
// Memory   static: scene, sensor and world are large.
// Errors   cmocka's.
#include "scene/sensor.h"

#include "collision/world.h" // lw_world_apply
#include "helpers.h"
#include "scene/motion.h" // lw_motion_at
#include "scene_text.h"   // accept_scene

enum { ME = 5 };
#define MS INT64_C(1000000)

static struct lw_sensor sensor;

static const struct lw_scene *start(const char *more)
{
    const struct lw_scene *scene = accept_scene(more, NULL);
    lw_sensor_init(&sensor, scene);
    return scene;
}

// Message number i, which there is.
static struct lw_obstacle_change tell(int64_t now_ns, int i)
{
    struct lw_obstacle_change change = {.count = 0};
    assert_true(lw_sensor_tell(&sensor, now_ns, i, &change));
    return change;
}

// Counts the messages of the sample taken last, by what they are.
struct messages {
    int hulls, upserts, removes, obstacles;
};

static struct messages count_messages(void)
{
    struct messages out = {0};
    struct lw_obstacle_change change;
    for (int i = 0; lw_sensor_tell(&sensor, 1000 * MS, i, &change); i++) {
        out.hulls += change.vertex_count > 0;
        out.upserts += change.vertex_count == 0 && change.op == LW_UPSERT;
        out.removes += change.op == LW_REMOVE;
        out.obstacles += change.op == LW_REMOVE ? 0 : change.count;
    }
    return out;
}

static void check_messages(int64_t motion_ns, struct messages expected)
{
    assert_true(lw_sensor_look(&sensor, motion_ns));
    const struct messages found = count_messages();
    assert_int_equal(found.hulls, expected.hulls);
    assert_int_equal(found.upserts, expected.upserts);
    assert_int_equal(found.removes, expected.removes);
    assert_int_equal(found.obstacles, expected.obstacles);
}

// --- samples ---

// Each sample is taken once, at its time and not before; what was left out is not made up for.
static void samples_are_taken_at_whole_periods(void **state)
{
    (void)state;
    (void)start("sensor: {rate_hz: 20}\nobstacles: [{at: [1, 0, 0]}]\n");
    assert_true(lw_sensor_look(&sensor, 0));
    assert_false(lw_sensor_look(&sensor, 0));
    assert_false(lw_sensor_look(&sensor, 50 * MS - 1));
    assert_true(lw_sensor_look(&sensor, 50 * MS));
    assert_int_equal(sensor.sample, 1);
    assert_int_equal(sensor.age_ns, 0);
    assert_true(lw_sensor_look(&sensor, 499 * MS));
    assert_int_equal(sensor.sample, 9);
    assert_int_equal(sensor.age_ns, 49 * MS);
    assert_false(lw_sensor_look(&sensor, 499 * MS));
}

// A message says when its sample was, on the clock of whoever hears it.
static void messages_tell_their_time(void **state)
{
    (void)state;
    const struct lw_scene *scene = start("sensor: {rate_hz: 20, latency_s: 0.12, valid_for_s: 1.5}\n"
                                         "obstacles: [{at: [1, 0, 0], velocity: [1, 0, 0]}]\n");
    static const struct {
        int64_t motion_ms, now_ms, seen_ms, sample;
    } cases[] = {{0, 5000, 4880, 0},
                 {100, 5000, 4880, 0},
                 {169, 5000, 4880 - 49, 0},
                 {170, 5000, 4880, 1},
                 {1000, 1000, 850, 17}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        (void)lw_sensor_look(&sensor, cases[i].motion_ms * MS);
        const struct lw_obstacle_change change = tell(cases[i].now_ms * MS, 0);
        assert_int_equal(change.time_ns, cases[i].seen_ms * MS);
        assert_int_equal(change.valid_for_ms, 1500);
        struct lw_moving moving;
        lw_motion_at(scene, &scene->obstacle[0], (double)cases[i].sample * 0.05, &moving);
        assert_all_near(change.obstacle[0].p, moving.p, 3, 0);
        assert_all_near(change.obstacle[0].v, moving.v, 3, 0);
    }
    // In lockstep time starts at 0, which would say that the time is not told.
    (void)start("obstacles: [{at: [1, 0, 0]}]\n");
    (void)lw_sensor_look(&sensor, 0);
    assert_int_equal(tell(0, 0).time_ns, 1);
}

// --- what is told ---

static void every_shape_is_told(void **state)
{
    (void)state;
    (void)start("obstacles:\n  - {at: [1, 0, 0], radius: 0.5}\n"
                "  - {shape: capsule, at: [0, 0, 1], rpy_deg: [90, 0, 0], radius: 0.1, half_length: 0.4}\n"
                "  - {shape: box, at: [0, 1, 0], half_extents: [0.1, 0.2, 0.3], rounding: 0.01}\n"
                "  - {shape: hull, at: [0, 0, 0], vertices: [[0, 0, 0], [1, 0, 0]], rounding: 0.02}\n"
                "  - {shape: plane, at: [0, 0, -1], normal: [0, 0, 2]}\n");
    assert_true(lw_sensor_look(&sensor, 0));
    const struct lw_obstacle_change hull = tell(1, 0), others = tell(1, 1);
    assert_int_equal(hull.vertex_count, 2);
    assert_near(hull.vertex[3], 1, 0);
    assert_true(hull.obstacle[0].id == 4 && hull.obstacle[0].radius == 0.02);
    const struct lw_obstacle *o = others.obstacle;
    assert_int_equal(others.count, 4);
    assert_true(o[0].shape == LW_SPHERE && o[0].radius == 0.5 && o[0].size[0] == 0);
    assert_true(o[1].shape == LW_CAPSULE && o[1].radius == 0.1 && o[1].size[0] == 0.4 && o[1].size[1] == 0);
    assert_near(o[1].quat[1], sqrt(0.5), 1e-15);
    assert_true(o[2].shape == LW_BOX && o[2].radius == 0.01 && o[2].size[2] == 0.3);
    assert_true(o[3].shape == LW_HALFSPACE && o[3].radius == 0 && o[3].quat[0] == 1 && o[3].p[2] == -1);
}

static char crowd[1 << 16];

// So many spheres and hulls.
static const char *make_crowd(int spheres, int hulls)
{
    size_t at = (size_t)snprintf(crowd, sizeof crowd, "obstacles:\n");
    for (int i = 0; i < spheres + hulls; i++)
        at += (size_t)snprintf(crowd + at, sizeof crowd - at, "  - {at: [%d, 0, 0]%s}\n", i % 90,
                               i % 5 == 0 && i / 5 < hulls ? ", shape: hull, vertices: [[0, 0, 0], [0, 1, 0]]" : "");
    return crowd;
}

// 32 in a message; vertices once a second, not all in one sample; names in between.
static void many_obstacles_take_several_messages(void **state)
{
    (void)state;
    (void)start("");
    check_messages(0, (struct messages){.upserts = 1});
    (void)start(make_crowd(32, 0));
    check_messages(0, (struct messages){.upserts = 1, .obstacles = 32});
    (void)start(make_crowd(33, 0));
    check_messages(0, (struct messages){.upserts = 2, .obstacles = 33});
    (void)start(make_crowd(LW_SCENE_OBSTACLES - 40, 40));
    check_messages(0, (struct messages){.hulls = 40, .upserts = 7, .obstacles = LW_SCENE_OBSTACLES});
    int told = 0;
    for (int k = 1; k <= 10; k++) {
        assert_true(lw_sensor_look(&sensor, k * 100 * MS));
        const struct messages found = count_messages();
        assert_int_equal(found.obstacles, LW_SCENE_OBSTACLES);
        assert_true(found.hulls <= 20);
        told += found.hulls;
    }
    assert_int_equal(told, 40);
    // A second later in one step: all, whose turns were passed over.
    check_messages(2000 * MS, (struct messages){.hulls = 40, .upserts = 7, .obstacles = LW_SCENE_OBSTACLES});
}

static void what_comes_and_goes_is_told(void **state)
{
    (void)state;
    (void)start("obstacles:\n  - {at: [1, 0, 0], visible_s: [0, 0.25]}\n  - {at: [2, 0, 0], visible_s: [0.3, off]}\n"
                "  - {at: [3, 0, 0], shape: hull, vertices: [[0, 0, 0]], visible_s: [0.2, 0.4]}\n");
    check_messages(0, (struct messages){.upserts = 1, .obstacles = 1});
    check_messages(100 * MS, (struct messages){.upserts = 1, .obstacles = 1});
    check_messages(200 * MS, (struct messages){.hulls = 1, .upserts = 1, .obstacles = 2});
    check_messages(300 * MS, (struct messages){.upserts = 2, .removes = 1, .obstacles = 2});
    check_messages(400 * MS, (struct messages){.upserts = 1, .removes = 1, .obstacles = 1});
    check_messages(500 * MS, (struct messages){.upserts = 1, .obstacles = 1});
}

// Nobody takes a message about an obstacle beyond 100 m, so none is sent about one that got there.
static void what_is_out_of_range_is_no_longer_told(void **state)
{
    (void)state;
    (void)start("obstacles:\n  - {at: [99, 0, 0], velocity: [20, 0, 0]}\n  - {at: [1, 0, 0]}\n");
    check_messages(0, (struct messages){.upserts = 1, .obstacles = 2});
    check_messages(100 * MS, (struct messages){.upserts = 1, .removes = 1, .obstacles = 1});
}

// --- noise ---

static void see_first(const char *more, int64_t motion_ns, double p[3])
{
    (void)start(more);
    (void)lw_sensor_look(&sensor, motion_ns);
    const struct lw_obstacle_change change = tell(motion_ns, 0);
    memcpy(p, change.obstacle[0].p, sizeof change.obstacle[0].p);
}

// The same seed and sample give the same noise to the last bit, others another one.
static void noise_is_drawn_by_seed_and_sample(void **state)
{
    (void)state;
    static const char one[] = "seed: 1\nsensor: {noise_m: 0.01}\nobstacles: [{id: 3, at: [1, 0, 0]}]\n";
    static const char two[] = "seed: 2\nsensor: {noise_m: 0.01}\nobstacles: [{id: 3, at: [1, 0, 0]}]\n";
    double p[4][3];
    see_first(one, 700 * MS, p[0]);
    see_first(one, 799 * MS, p[1]);
    see_first(two, 700 * MS, p[2]);
    see_first(one, 800 * MS, p[3]);
    assert_same_bits(p[0], p[1], sizeof p[0]);
    for (int i = 0; i < 3; i++)
        assert_true(p[2][i] != p[0][i] && p[3][i] != p[0][i] && p[0][i] != p[0][(i + 1) % 3]);
}

static void noise_has_the_deviation_asked_for(void **state)
{
    (void)state;
    enum { SAMPLES = 20000 };
    (void)start("sensor: {noise_m: 0.02, rate_hz: 100}\nobstacles: [{at: [1, 2, 3]}]\n");
    double sum[3] = {0}, square[3] = {0}, product = 0;
    for (int k = 0; k < SAMPLES; k++) {
        assert_true(lw_sensor_look(&sensor, k * 10 * MS));
        const struct lw_obstacle_change change = tell(1, 0);
        double off[3];
        for (int i = 0; i < 3; i++) {
            off[i] = (change.obstacle[0].p[i] - 1 - i) / 0.02;
            sum[i] += off[i];
            square[i] += off[i] * off[i];
        }
        product += off[0] * off[1];
    }
    for (int i = 0; i < 3; i++) {
        assert_near(sum[i] / SAMPLES, 0, 0.03);
        assert_near(square[i] / SAMPLES, 1, 0.05);
    }
    assert_near(product / SAMPLES, 0, 0.03);
}

// --- a world that hears it ---

static void check_world(const struct lw_world *world)
{
    int visible = 0;
    for (int place = 0; place < sensor.scene->obstacle_count; place++) {
        visible += sensor.is_seen[place];
        bool found = !sensor.is_seen[place];
        for (int i = 0; i < world->count; i++)
            if (world->entry[i].obstacle.id == sensor.seen[place].id) {
                found = true;
                assert_all_near(world->entry[i].obstacle.p, sensor.seen[place].p, 3, 0);
            }
        assert_true(found);
    }
    assert_int_equal(world->count, visible);
}

// At no message is an obstacle lost that is still there: the set never shrinks but by what went out of sight.
static void a_world_holds_what_is_seen_at_any_time(void **state)
{
    (void)state;
    (void)start("seed: 4\nsensor: {noise_m: 0.01}\nobstacles:\n"
                "  - {at: [1, 0, 0], motion: {kind: random, reach: [1, 1, 1], speed: 1}}\n"
                "  - {at: [2, 0, 0], shape: hull, vertices: [[0, 0, 0], [0, 1, 0]], visible_s: [0.5, 3]}\n"
                "  - {at: [3, 0, 0], visible_s: [0, 2]}\n  - {at: [4, 0, 0], visible_s: [1, off]}\n");
    static struct lw_world world;
    world = (struct lw_world){0};
    int64_t seq = 0;
    for (int64_t motion_ns = 0; motion_ns < 4000 * MS; motion_ns += 8 * MS) {
        struct lw_obstacle_change change;
        if (!lw_sensor_look(&sensor, motion_ns))
            continue;
        for (int i = 0; lw_sensor_tell(&sensor, motion_ns, i, &change); i++) {
            const int before = world.count;
            change.stamp = (struct lw_stamp){.session = ME, .seq = ++seq};
            assert_int_equal(lw_world_apply(&world, &change), LW_OK);
            assert_true(world.count >= before || change.op == LW_REMOVE);
        }
        check_world(&world);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(samples_are_taken_at_whole_periods),
        cmocka_unit_test(messages_tell_their_time),
        cmocka_unit_test(every_shape_is_told),
        cmocka_unit_test(many_obstacles_take_several_messages),
        cmocka_unit_test(what_comes_and_goes_is_told),
        cmocka_unit_test(what_is_out_of_range_is_no_longer_told),
        cmocka_unit_test(noise_is_drawn_by_seed_and_sample),
        cmocka_unit_test(noise_has_the_deviation_asked_for),
        cmocka_unit_test(a_world_holds_what_is_seen_at_any_time),
    };
    return cmocka_run_group_tests_name("sensor", tests, NULL, NULL);
}
