// SPDX-License-Identifier: BSD-3-Clause
// Tests of the wire: what a hostile sender can do with obstacles and hulls is refused, and what only looks odd is not.
//
// Units    those of lcmtypes/*.lcm.
// Frames   base frame.
// Arrays   see bus/wire.h.
// Memory   stack.
// Errors   cmocka's.
#include "bus/wire.h"
#include "helpers.h"
#include "wire_messages.h" // make, decode

#include <leeway_hull_t.h>      // counts of vertices
#include <leeway_obstacles_t.h> // counts and unused entries that lw_wire_encode never writes

// --- values ---

// Place and motion, which every shape has.
static void check_in_place(enum lw_channel channel, const union lw_message *m, struct lw_obstacle *o)
{
    const double quat[4] = {o->quat[0], o->quat[1], o->quat[2], o->quat[3]};
    for (int i = 0; i < 3; i++) {
        check_double(channel, m, &o->p[i], 100);
        check_double(channel, m, &o->v[i], 100);
        check_double(channel, m, &o->omega[i], 100);
    }
    for (int i = 0; i < 4; i++) {
        o->quat[i] = NO_NUMBER;
        check_message(channel, m, LW_E_NOT_FINITE);
        o->quat[i] = quat[i];
    }
    const double scales[] = {0, 0.998, 1.0021, 1e9};
    for (int i = 0; i < 4; i++) {
        for (int k = 0; k < 4; k++)
            o->quat[k] = scales[i] * quat[k];
        check_message(channel, m, LW_E_ARGUMENT);
    }
    memcpy(o->quat, quat, sizeof quat);
    check_message(channel, m, LW_OK);
}

// An obstacle of every shape, in the place of one of a message.
static void check_obstacle(enum lw_channel channel, const union lw_message *m, struct lw_obstacle *o)
{
    struct random random = {95};
    for (int shape = LW_SPHERE; shape <= LW_HALFSPACE; shape++) {
        *o = any_obstacle(&random, o->id, (enum lw_shape_kind)shape);
        check_in_place(channel, m, o);
        const int sizes = shape == LW_BOX ? 3 : shape == LW_CAPSULE ? 1 : 0;
        for (int i = 0; i < 3; i++) {
            const double before = o->size[i];
            if (i < sizes)
                check_double(channel, m, &o->size[i], 100);
            o->size[i] = i < sizes ? -5e-324 : NO_NUMBER; // what the shape does not have is not looked at
            check_message(channel, m, i < sizes ? LW_E_ARGUMENT : LW_OK);
            o->size[i] = before;
        }
        if (shape == LW_BOX) {
            const double before = o->size[1];
            o->size[1] = 0;
            check_message(channel, m, LW_E_ARGUMENT);
            o->size[1] = before;
        }
        const double radius = o->radius;
        if (shape != LW_HALFSPACE)
            check_double(channel, m, &o->radius, 100);
        o->radius = shape == LW_HALFSPACE ? NO_NUMBER : -5e-324;
        check_message(channel, m, shape == LW_HALFSPACE ? LW_OK : LW_E_ARGUMENT);
        o->radius = radius;
    }
}

static void every_double_of_an_obstacle_is_checked(void **state)
{
    (void)state;
    struct random random = {96};
    union lw_message o = make(&random, LW_CHANNEL_OBSTACLES);
    o.obstacles.op = LW_UPSERT;
    o.obstacles.count = LW_CHANGE_MAX;
    for (int i = 0; i < LW_CHANGE_MAX; i++)
        o.obstacles.obstacle[i] = any_obstacle(&random, i + 1, LW_SPHERE);
    check_obstacle(LW_CHANNEL_OBSTACLES, &o, &o.obstacles.obstacle[LW_CHANGE_MAX - 1]);
    check_obstacle(LW_CHANNEL_WORLD, &o, &o.obstacles.obstacle[LW_CHANGE_MAX - 1]);
}

static void every_double_of_a_hull_is_checked(void **state)
{
    (void)state;
    struct random random = {94};
    union lw_message h = make(&random, LW_CHANNEL_HULL);
    struct lw_obstacle_change *c = &h.obstacles;
    c->vertex_count = LW_HULL_MAX;
    fill(&random, 100, c->vertex, 3 * LW_HULL_MAX);
    for (int i = 0; i < 3 * LW_HULL_MAX; i++)
        check_double(LW_CHANNEL_HULL, &h, &c->vertex[i], 100);
    check_in_place(LW_CHANNEL_HULL, &h, &c->obstacle[0]);
    check_in_place(LW_CHANNEL_WORLD_HULL, &h, &c->obstacle[0]);
}

// --- obstacles ---

static leeway_obstacles_t valid_obstacles(int n)
{
    leeway_obstacles_t w = {.h = {.session = 5, .seq = 6}, .op = LEEWAY_OBSTACLES_T_UPSERT, .n = n};
    for (int i = 0; i < LEEWAY_OBSTACLES_T_MAX; i++)
        w.o[i] = (leeway_obstacle_t){.id = i + 1, .p = {i, 0, 1}, .quat = {1}, .radius = 0.5};
    return w;
}

static enum lw_status decode_obstacles(const leeway_obstacles_t *w, union lw_message *out)
{
    unsigned char data[LW_WIRE_MAX];
    const int size = leeway_obstacles_t_encode(data, 0, sizeof data, w);
    assert_true(size > 0);
    return decode(LW_CHANNEL_OBSTACLES, data, (uint32_t)size, out);
}

static void counts_are_checked_before_they_are_used(void **state)
{
    (void)state;
    const int counts[] = {INT32_MIN, -1, 0, 1, LW_CHANGE_MAX, LW_CHANGE_MAX + 1, 1000000, INT32_MAX};
    for (size_t i = 0; i < sizeof counts / sizeof counts[0]; i++) {
        const leeway_obstacles_t w = valid_obstacles(counts[i]);
        union lw_message out;
        const bool valid = counts[i] >= 0 && counts[i] <= LW_CHANGE_MAX;
        assert_int_equal(decode_obstacles(&w, &out), valid ? LW_OK : LW_E_ARGUMENT);
    }
}

// Ids are positive and stand once, wherever in the message; also where only ids are read.
static void ids_are_positive_and_unique(void **state)
{
    (void)state;
    union lw_message out;
    for (int op = 0; op <= LW_CLEAR; op++)
        for (int at = 0; at < LW_CHANGE_MAX; at++) {
            leeway_obstacles_t w = valid_obstacles(LW_CHANGE_MAX);
            w.op = (int8_t)op;
            const int32_t bad[] = {0, -1, INT32_MIN, 1 + (at + 7) % LW_CHANGE_MAX}; // the last one is another's
            for (int i = 0; i < 4; i++) {
                w.o[at].id = bad[i];
                assert_int_equal(decode_obstacles(&w, &out), LW_E_ARGUMENT);
            }
            w.o[at].id = 777;
            assert_int_equal(decode_obstacles(&w, &out), LW_OK);
        }
}

// Entries behind the count are ignored whatever they hold, and REMOVE looks at ids alone.
static void unused_values_are_ignored(void **state)
{
    (void)state;
    union lw_message out;
    leeway_obstacles_t w = valid_obstacles(2);
    for (int i = 2; i < LEEWAY_OBSTACLES_T_MAX; i++)
        w.o[i] = (leeway_obstacle_t){.id = -1, .p = {NO_NUMBER, 1e300, 0}, .radius = -1};
    assert_int_equal(decode_obstacles(&w, &out), LW_OK);
    assert_int_equal(out.obstacles.count, 2);
    w.o[1].radius = NO_NUMBER;
    w.o[0].p[2] = 1e300;
    assert_int_not_equal(decode_obstacles(&w, &out), LW_OK);
    w.op = LEEWAY_OBSTACLES_T_REMOVE;
    assert_int_equal(decode_obstacles(&w, &out), LW_OK);
    assert_near(out.obstacles.obstacle[0].p[2], 0, 0);
    assert_near(out.obstacles.obstacle[1].radius, 0, 0);
}

// A time is not negative, what expires has one, and both together fit.
static void times_are_checked(void **state)
{
    (void)state;
    const int64_t newest = INT64_MAX - INT32_MAX * INT64_C(1000000);
    const struct {
        int64_t time_ns;
        int32_t valid_for_ms;
        enum lw_status status;
    } cases[] = {{0, 0, LW_OK},
                 {1, 0, LW_OK},
                 {1, 1, LW_OK},
                 {0, 1, LW_E_ARGUMENT}, // valid from when?
                 {-1, 0, LW_E_ARGUMENT},
                 {INT64_MIN, 1, LW_E_ARGUMENT},
                 {1, -1, LW_E_ARGUMENT},
                 {1, INT32_MIN, LW_E_ARGUMENT},
                 {newest, INT32_MAX, LW_OK},
                 {newest + 1, INT32_MAX, LW_E_ARGUMENT},
                 {INT64_MAX, 1, LW_E_ARGUMENT}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct random random = {97};
        leeway_obstacles_t w = valid_obstacles(3);
        union lw_message hull = make(&random, LW_CHANNEL_HULL), out;
        w.time_ns = hull.obstacles.time_ns = cases[i].time_ns;
        w.valid_for_ms = hull.obstacles.valid_for_ms = cases[i].valid_for_ms;
        assert_int_equal(decode_obstacles(&w, &out), cases[i].status);
        check_message(LW_CHANNEL_HULL, &hull, cases[i].status);
        if (cases[i].status == LW_OK)
            assert_true(lw_change_expires_ns(&out.obstacles) >= cases[i].time_ns || cases[i].valid_for_ms == 0);
    }
}

// 1e9 m away, of no size, of no kind: refused whole, the good ones beside it too.
static void bad_obstacles_are_refused(void **state)
{
    (void)state;
    union lw_message out;
    leeway_obstacles_t w = valid_obstacles(3);
    leeway_obstacle_t bad[] = {w.o[1], w.o[1], w.o[1], w.o[1], w.o[1], w.o[1], w.o[1]};
    bad[0].p[2] = 1e9;
    bad[1].radius = -0.1;
    bad[2].quat[0] = 0;
    bad[3].shape = LEEWAY_OBSTACLE_T_BOX; // without half extents
    bad[4].shape = LEEWAY_OBSTACLE_T_HALFSPACE + 1;
    bad[5].shape = -1;
    bad[6].v[1] = NO_NUMBER;
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        w.o[1] = bad[i];
        assert_int_equal(decode_obstacles(&w, &out), i == 6 ? LW_E_NOT_FINITE : LW_E_ARGUMENT);
    }
    w.n = 1; // behind the count they are nobody's business
    assert_int_equal(decode_obstacles(&w, &out), LW_OK);
}

// --- hulls ---

static enum lw_status decode_hull(const leeway_hull_t *w, union lw_message *out)
{
    unsigned char data[LW_WIRE_MAX];
    const int size = leeway_hull_t_encode(data, 0, sizeof data, w);
    assert_true(size > 0);
    return decode(LW_CHANNEL_HULL, data, (uint32_t)size, out);
}

static void vertices_are_counted_before_they_are_read(void **state)
{
    (void)state;
    const int counts[] = {INT32_MIN, -1, 0, 1, LW_HULL_MAX, LW_HULL_MAX + 1, 1000000, INT32_MAX};
    leeway_hull_t w = {.h = {.session = 5, .seq = 6}, .o = {.id = 3, .shape = LW_HULL, .quat = {1}}};
    union lw_message out;
    for (size_t i = 0; i < sizeof counts / sizeof counts[0]; i++) {
        w.n = counts[i];
        const bool valid = counts[i] >= 1 && counts[i] <= LW_HULL_MAX;
        assert_int_equal(decode_hull(&w, &out), valid ? LW_OK : LW_E_ARGUMENT);
    }
    for (int shape = -1; shape <= LW_CUSTOM; shape++) {
        w.n = 1;
        w.o.shape = (int8_t)shape;
        assert_int_equal(decode_hull(&w, &out), shape == LW_HULL ? LW_OK : LW_E_ARGUMENT);
    }
}

// Flat, collinear and duplicate vertices make a hull as well; those behind the count are ignored.
static void degenerate_hulls_are_welcome(void **state)
{
    (void)state;
    leeway_hull_t w = {.h = {.session = 5, .seq = 6}, .o = {.id = 3, .shape = LW_HULL, .quat = {1}}, .n = 4};
    const double sets[][4][3] = {{{0}},
                                 {{1, 2, 3}, {1, 2, 3}, {1, 2, 3}, {1, 2, 3}},
                                 {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}},
                                 {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}};
    union lw_message out;
    for (int i = 4; i < LW_HULL_MAX; i++)
        w.vertex[i][0] = NO_NUMBER;
    for (size_t i = 0; i < sizeof sets / sizeof sets[0]; i++) {
        memcpy(w.vertex, sets[i], sizeof sets[i]);
        assert_int_equal(decode_hull(&w, &out), LW_OK);
        assert_int_equal(out.obstacles.vertex_count, 4);
        assert_same_bits(out.obstacles.vertex, sets[i], sizeof sets[i]);
        assert_near(out.obstacles.vertex[12], 0, 0);
    }
    w.vertex[3][2] = NO_NUMBER;
    assert_int_equal(decode_hull(&w, &out), LW_E_NOT_FINITE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_double_of_an_obstacle_is_checked),
        cmocka_unit_test(every_double_of_a_hull_is_checked),
        cmocka_unit_test(counts_are_checked_before_they_are_used),
        cmocka_unit_test(ids_are_positive_and_unique),
        cmocka_unit_test(unused_values_are_ignored),
        cmocka_unit_test(times_are_checked),
        cmocka_unit_test(bad_obstacles_are_refused),
        cmocka_unit_test(vertices_are_counted_before_they_are_read),
        cmocka_unit_test(degenerate_hulls_are_welcome),
    };
    return cmocka_run_group_tests_name("wire_obstacles", tests, NULL, NULL);
}
