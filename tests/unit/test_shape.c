// SPDX-License-Identifier: BSD-3-Clause
// Tests of shapes: what is refused and why, and that a placed shape is the solid moved rigidly.
//
// Units    metres.
// Frames   base frame.
// Arrays   see shape.h.
// Memory   none.
// Errors   cmocka's.
#include "base/vec.h" // lw_vec_*
#include "collision/shape.h"
#include "helpers.h"

static const struct lw_pose origin = {.r = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
static const double cube[24] = {-1, -1, -1, -1, -1, 1, -1, 1, -1, -1, 1, 1, 1, -1, -1, 1, -1, 1, 1, 1, -1, 1, 1, 1};
static const char object = 0;

// A solid of each kind that is taken as it is.
static struct lw_solid good(enum lw_shape_kind kind)
{
    return (struct lw_solid){.kind = kind,
                             .radius = 0.1,
                             .half_length = 0.2,
                             .half = {0.1, 0.2, 0.3},
                             .normal = {0, 0.6, 0.8},
                             .offset = 0.5,
                             .count = 8,
                             .vertex = cube,
                             .custom = &object,
                             .custom_bound = 1};
}

// Makes a shape in memory that shows whether it was written to.
static void check_refused(const struct lw_solid *solid, const struct lw_pose *pose, enum lw_status expected,
                          const char *word)
{
    double room[LW_HULL_ROOM];
    struct lw_shape shape, before;
    memset(&shape, 0x55, sizeof shape);
    memcpy(&before, &shape, sizeof shape);
    const char *reason = "";
    assert_int_equal(lw_shape_make(solid, pose, room, &shape, &reason), expected);
    assert_non_null(strstr(reason, word));
    assert_same_bits(&shape, &before, sizeof shape);
    assert_int_equal(lw_shape_make(solid, pose, room, &shape, NULL), expected); // a reason need not be asked for
}

static void random_pose(struct random *random, double spread, struct lw_pose *pose)
{
    double q[4], p[3], length = 0;
    random_fill(random, -spread, spread, p, 3);
    do {
        random_fill(random, -1, 1, q, 4);
        length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    } while (length < 0.1);
    for (int i = 0; i < 4; i++)
        q[i] /= length;
    assert_int_equal(lw_pose_make(p, q, pose), LW_OK);
}

static void transform(const struct lw_pose *pose, const double x[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = lw_vec_dot(&pose->r[3 * i], x) + pose->p[i];
}

// --- refusals ---

static void every_kind_is_taken(void **state)
{
    (void)state;
    double room[LW_HULL_ROOM];
    struct lw_shape shape;
    for (int kind = 0; kind < LW_SHAPE_KINDS; kind++) {
        const struct lw_solid solid = good((enum lw_shape_kind)kind);
        assert_int_equal(lw_shape_make(&solid, &origin, room, &shape, NULL), LW_OK);
        assert_true(shape.kind == (enum lw_shape_kind)kind && shape.id == 0 && shape.generation == 0);
    }
    struct lw_solid solid = good((enum lw_shape_kind)LW_SHAPE_KINDS);
    check_refused(&solid, &origin, LW_E_ARGUMENT, "no such kind");
}

// Each number of each kind, made NaN and infinite.
static void numbers_that_are_none_are_refused(void **state)
{
    (void)state;
    const double bad[3] = {(double)NAN, HUGE_VAL, -HUGE_VAL};
    for (int i = 0; i < 3; i++) {
        double vertex[24];
        memcpy(vertex, cube, sizeof vertex);
        for (int kind = 0; kind < LW_SHAPE_KINDS; kind++) {
            const struct lw_solid sound = good((enum lw_shape_kind)kind);
            struct lw_pose pose = origin;
            pose.p[i] = bad[i];
            check_refused(&sound, &pose, LW_E_NOT_FINITE, "finite");
            pose = origin;
            pose.r[4 * i] = bad[i];
            check_refused(&sound, &pose, LW_E_NOT_FINITE, "finite");
            struct lw_solid solid = sound;
            solid.radius = bad[i];
            if (kind != LW_HALFSPACE)
                check_refused(&solid, &origin, LW_E_NOT_FINITE, "finite");
        }
        struct lw_solid solid = good(LW_CAPSULE);
        solid.half_length = bad[i];
        check_refused(&solid, &origin, LW_E_NOT_FINITE, "finite");
        solid = good(LW_BOX);
        solid.half[i] = bad[i];
        check_refused(&solid, &origin, LW_E_NOT_FINITE, "finite");
        solid = good(LW_HULL);
        solid.vertex = vertex;
        vertex[21 + i] = bad[i]; // the last vertex counts
        check_refused(&solid, &origin, LW_E_NOT_FINITE, "finite");
        solid = good(LW_HALFSPACE);
        solid.normal[i] = bad[i];
        check_refused(&solid, &origin, LW_E_NOT_FINITE, "finite");
        solid = good(LW_HALFSPACE);
        solid.offset = bad[i];
        check_refused(&solid, &origin, LW_E_NOT_FINITE, "finite");
        solid = good(LW_CUSTOM);
        solid.custom_centre[i] = bad[i];
        check_refused(&solid, &origin, LW_E_NOT_FINITE, "finite");
        solid = good(LW_CUSTOM);
        solid.custom_bound = bad[i];
        check_refused(&solid, &origin, LW_E_NOT_FINITE, "finite");
    }
}

static void wrong_sizes_are_refused(void **state)
{
    (void)state;
    struct lw_solid solid;
    for (int kind = 0; kind < LW_SHAPE_KINDS; kind++) {
        solid = good((enum lw_shape_kind)kind);
        solid.radius = -1e-9;
        if (kind != LW_HALFSPACE)
            check_refused(&solid, &origin, LW_E_ARGUMENT, "radius");
    }
    for (int i = 0; i < 3; i++)
        for (int zero = 0; zero < 2; zero++) {
            solid = good(LW_BOX);
            solid.half[i] = zero ? 0 : -0.1;
            check_refused(&solid, &origin, LW_E_ARGUMENT, "half extent");
        }
    solid = good(LW_CAPSULE);
    solid.half_length = -1e-9;
    check_refused(&solid, &origin, LW_E_ARGUMENT, "half length");
    solid = good(LW_CUSTOM);
    solid.custom = NULL;
    check_refused(&solid, &origin, LW_E_ARGUMENT, "object");
    solid = good(LW_CUSTOM);
    solid.custom_bound = 0;
    check_refused(&solid, &origin, LW_E_ARGUMENT, "bound");
    solid = good(LW_SPHERE);
    solid.radius = 1e200;
    check_refused(&solid, &origin, LW_E_ARGUMENT, "too large");
    solid = good(LW_HALFSPACE);
    solid.offset = 1e200;
    check_refused(&solid, &origin, LW_E_ARGUMENT, "too large");
}

// The count is looked at before the vertices are read.
static void hulls_have_1_to_64_vertices(void **state)
{
    (void)state;
    static const double zeros[3 * (LW_HULL_MAX + 1)];
    double room[LW_HULL_ROOM];
    struct lw_shape shape;
    struct lw_solid solid = good(LW_HULL);
    const int refused[] = {INT32_MIN, -1, 0, LW_HULL_MAX + 1, INT32_MAX};
    for (int i = 0; i < 5; i++) {
        solid.count = refused[i];
        check_refused(&solid, &origin, LW_E_ARGUMENT, "64");
    }
    solid.vertex = zeros;
    for (solid.count = 1; solid.count <= LW_HULL_MAX; solid.count++)
        assert_int_equal(lw_shape_make(&solid, &origin, room, &shape, NULL), LW_OK);
    solid = good(LW_HULL);
    solid.vertex = NULL;
    check_refused(&solid, &origin, LW_E_ARGUMENT, "64");
}

static void rotations_have_to_be_orthonormal(void **state)
{
    (void)state;
    const struct lw_solid solid = good(LW_BOX);
    const double wrong[][9] = {
        {1.002, 0, 0, 0, 1, 0, 0, 0, 1}, {1, 0, 0, 0, 0.998, 0, 0, 0, 1}, {1, 0, 0, 0, 1, 0, 0, 0, 1.004},
        {1, 0, 0, 0, 1, 0, 0, 0, -1},    {1, 0.002, 0, 0, 1, 0, 0, 0, 1}, {1, 0, 0, 0, 1, 0, 0.004, 0, 1},
        {0, 0, 0, 0, 0, 0, 0, 0, 0},     {0, 1, 0, 1, 0, 0, 0, 0, 1},
    };
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        struct lw_pose pose = {{0}, {0}};
        memcpy(pose.r, wrong[i], sizeof pose.r);
        check_refused(&solid, &pose, LW_E_ARGUMENT, "orthonormal");
    }
    // Small faults are mended: the axes of the shape are orthonormal to rounding.
    struct random random = {7};
    for (int n = 0; n < 1000; n++) {
        struct lw_pose pose;
        struct lw_shape shape;
        double room[1];
        random_pose(&random, 1, &pose);
        for (int i = 0; i < 9; i++)
            pose.r[i] += random_in(&random, -3e-4, 3e-4);
        assert_int_equal(lw_shape_make(&solid, &pose, room, &shape, NULL), LW_OK);
        const double *r = shape.box.axes;
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++) {
                const double product = r[i] * r[j] + r[3 + i] * r[3 + j] + r[6 + i] * r[6 + j];
                assert_near(product, i == j, 1e-15);
            }
        assert_all_near(r, pose.r, 9, 1.5e-3);
    }
}

static void unit_vectors_may_be_off_by_a_thousandth(void **state)
{
    (void)state;
    struct lw_pose pose;
    struct lw_shape shape;
    const double p[3] = {1, 2, 3}, q[4] = {0.5, 0.5, 0.5, 0.5}, bad[4] = {0.5, (double)NAN, 0.5, 0.5};
    for (int i = -2; i <= 2; i += 4) {
        const double scale = 1 + 0.0007 * i; // 1.4e-3 off
        struct lw_solid solid = good(LW_HALFSPACE);
        double off[4], nearly[4];
        for (int k = 0; k < 4; k++) {
            off[k] = scale * q[k];
            nearly[k] = (1 + 0.0004 * i) * q[k];
        }
        assert_int_equal(lw_pose_make(p, off, &pose), LW_E_ARGUMENT);
        assert_int_equal(lw_pose_make(p, nearly, &pose), LW_OK);
        const double turned[9] = {0, 0, 1, 1, 0, 0, 0, 1, 0}; // x to y to z to x
        assert_all_near(pose.r, turned, 9, 1e-15);
        assert_all_near(pose.p, p, 3, 0);
        for (int k = 0; k < 3; k++)
            solid.normal[k] *= scale;
        check_refused(&solid, &origin, LW_E_ARGUMENT, "normal");
        // The plane stays where normal . x = offset puts it.
        solid = good(LW_HALFSPACE);
        for (int k = 0; k < 3; k++)
            solid.normal[k] *= 1 + 0.0004 * i;
        assert_int_equal(lw_shape_make(&solid, &origin, NULL, &shape, NULL), LW_OK);
        assert_near(lw_vec_norm(shape.halfspace.m), 1, 1e-15);
        assert_near(shape.halfspace.o * (1 + 0.0004 * i), solid.offset, 1e-15);
    }
    assert_int_equal(lw_pose_make(p, bad, &pose), LW_E_NOT_FINITE);
    assert_int_equal(lw_pose_make(&bad[1], q, &pose), LW_E_NOT_FINITE);
}

// --- placing ---

// Random quaternions turn as their matrices do: q x q* by the product of quaternions.
static void quaternions_turn_vectors(void **state)
{
    (void)state;
    struct random random = {8};
    const double half = 0.35, axis[3] = {2.0 / 7, 3.0 / 7, 6.0 / 7}, x[3] = {0.3, -0.2, 0.9}, zero[3] = {0};
    const double q[4] = {cos(half), axis[0] * sin(half), axis[1] * sin(half), axis[2] * sin(half)};
    struct lw_pose pose;
    double found[3], cross[3], expected[3];
    assert_int_equal(lw_pose_make(zero, q, &pose), LW_OK);
    transform(&pose, x, found);
    // Rodrigues: x cos + (axis x x) sin + axis (axis . x)(1 - cos).
    lw_vec_cross(axis, x, cross);
    for (int i = 0; i < 3; i++)
        expected[i] = x[i] * cos(0.7) + cross[i] * sin(0.7) + axis[i] * lw_vec_dot(axis, x) * (1 - cos(0.7));
    assert_all_near(found, expected, 3, 1e-15);
    for (int n = 0; n < 100; n++) {
        random_pose(&random, 1, &pose);
        lw_vec_cross(&pose.r[0], &pose.r[3], cross);
        assert_all_near(cross, &pose.r[6], 3, 1e-15);
    }
}

// Vertices come back when the centre is added; the bound holds all of them and one is on it.
static void hulls_move_rigidly(void **state)
{
    (void)state;
    struct random random = {9};
    for (int n = 0; n < 500; n++) {
        double vertex[3 * LW_HULL_MAX], room[LW_HULL_ROOM], farthest = 0;
        struct lw_solid solid = {.kind = LW_HULL, .radius = 0.05, .count = 1 + random_below(&random, LW_HULL_MAX)};
        struct lw_pose pose;
        struct lw_shape shape;
        random_fill(&random, -0.3, 0.4, vertex, 3 * solid.count);
        random_pose(&random, 3, &pose);
        solid.vertex = vertex;
        assert_int_equal(lw_shape_make(&solid, &pose, room, &shape, NULL), LW_OK);
        assert_true(shape.hull.count == solid.count && shape.hull.padded % 4 == 0);
        assert_true(shape.hull.padded >= solid.count && shape.hull.padded < solid.count + 4);
        for (int i = 0; i < shape.hull.padded; i++) {
            double expected[3];
            transform(&pose, &vertex[i < solid.count ? 3 * i : 0], expected);
            lw_vec_sub(expected, shape.c, expected);
            for (int k = 0; k < 3; k++)
                assert_near(shape.hull.vertex[k * shape.hull.padded + i], expected[k], 2e-15);
            farthest = fmax(farthest, lw_vec_norm(expected));
        }
        assert_near(shape.hull.reach, farthest, 1e-14);
        assert_near(shape.bound, farthest + 0.05, 1e-14);
    }
}

// Far from the origin a hull's relative vertices keep all their digits.
static void hulls_far_away_keep_their_digits(void **state)
{
    (void)state;
    double vertex[6] = {1000.25, 0, 0, 1000.75, 0, 0.125}, room[12];
    const struct lw_solid solid = {.kind = LW_HULL, .count = 2, .vertex = vertex};
    struct lw_shape shape;
    assert_int_equal(lw_shape_make(&solid, &origin, room, &shape, NULL), LW_OK);
    assert_true(shape.c[0] == 1000.5 && room[0] == -0.25 && room[1] == 0.25 && room[9] == 0.0625);
}

static void capsules_and_customs_move_rigidly(void **state)
{
    (void)state;
    struct random random = {10};
    for (int n = 0; n < 200; n++) {
        struct lw_pose pose;
        struct lw_shape shape;
        double a[3], b[3];
        const double top[3] = {0, 0, 0.2}, bottom[3] = {0, 0, -0.2};
        random_pose(&random, 3, &pose);
        transform(&pose, bottom, a);
        transform(&pose, top, b);
        struct lw_solid solid = good(LW_CAPSULE);
        assert_int_equal(lw_shape_make(&solid, &pose, NULL, &shape, NULL), LW_OK);
        assert_all_near(shape.segment.a, a, 3, 2e-15);
        assert_all_near(shape.segment.b, b, 3, 2e-15);
        assert_near(shape.bound, 0.3, 1e-15);
        const struct lw_capsule capsule = lw_shape_capsule(&shape);
        const struct lw_shape again = lw_shape_of_capsule(&capsule);
        assert_true(capsule.r == 0.1 && again.r == 0.1 && again.kind == LW_CAPSULE);
        assert_all_near(again.segment.a, shape.segment.a, 3, 0);
        assert_all_near(again.segment.b, shape.segment.b, 3, 0);
        assert_all_near(again.c, pose.p, 3, 2e-15);
        assert_near(again.bound, 0.3, 2e-15);

        solid = good(LW_CUSTOM);
        solid.custom_centre[2] = -0.2;
        assert_int_equal(lw_shape_make(&solid, &pose, NULL, &shape, NULL), LW_OK);
        assert_all_near(shape.c, a, 3, 2e-15);
        assert_true(shape.custom == &object);
        assert_near(shape.bound, 1.1, 1e-15);
    }
}

static void spheres_and_boxes_move_rigidly(void **state)
{
    (void)state;
    struct random random = {11};
    for (int n = 0; n < 200; n++) {
        struct lw_pose pose;
        struct lw_shape shape;
        random_pose(&random, 3, &pose);
        struct lw_solid solid = good(LW_SPHERE);
        assert_int_equal(lw_shape_make(&solid, &pose, NULL, &shape, NULL), LW_OK);
        assert_all_near(shape.c, pose.p, 3, 0);
        assert_all_near(shape.segment.a, pose.p, 3, 0); // the half length is not a sphere's
        assert_all_near(shape.segment.b, pose.p, 3, 0);
        assert_near(shape.bound, 0.1, 0);

        solid = good(LW_BOX);
        assert_int_equal(lw_shape_make(&solid, &pose, NULL, &shape, NULL), LW_OK);
        assert_all_near(shape.box.axes, pose.r, 9, 1e-15);
        assert_all_near(shape.box.half, solid.half, 3, 0);
        assert_near(shape.bound, sqrt(0.14) + 0.1, 1e-15);
    }
}

// A point of the plane stays on it.
static void half_spaces_move_rigidly(void **state)
{
    (void)state;
    struct random random = {12};
    for (int n = 0; n < 200; n++) {
        struct lw_pose pose;
        struct lw_shape shape;
        double point[3], moved[3];
        const struct lw_solid solid = good(LW_HALFSPACE);
        random_pose(&random, 3, &pose);
        assert_int_equal(lw_shape_make(&solid, &pose, NULL, &shape, NULL), LW_OK);
        for (int i = 0; i < 3; i++)
            point[i] = 0.5 * solid.normal[i] + (i == 0 ? 0.7 : 0);
        transform(&pose, point, moved);
        assert_near(lw_vec_dot(shape.halfspace.m, moved), shape.halfspace.o, 4e-15);
        assert_true(isinf(shape.bound) && shape.r == 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_kind_is_taken),
        cmocka_unit_test(numbers_that_are_none_are_refused),
        cmocka_unit_test(wrong_sizes_are_refused),
        cmocka_unit_test(hulls_have_1_to_64_vertices),
        cmocka_unit_test(rotations_have_to_be_orthonormal),
        cmocka_unit_test(unit_vectors_may_be_off_by_a_thousandth),
        cmocka_unit_test(quaternions_turn_vectors),
        cmocka_unit_test(hulls_move_rigidly),
        cmocka_unit_test(hulls_far_away_keep_their_digits),
        cmocka_unit_test(capsules_and_customs_move_rigidly),
        cmocka_unit_test(spheres_and_boxes_move_rigidly),
        cmocka_unit_test(half_spaces_move_rigidly),
    };
    return cmocka_run_group_tests_name("shape", tests, NULL, NULL);
}
