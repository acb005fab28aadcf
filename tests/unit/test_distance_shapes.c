// SPDX-License-Identifier: BSD-3-Clause
// Tests of the distance of any two shapes, and of custom ones: against brute force, and against the same solid in
// another guise.
//
// Units    metres.
// Frames   one.
// Arrays   see distance_pairs.h.
// Memory   none.
// Errors   cmocka's.
#include "collision/custom.h"
#include "distance_oracle.h"
#include "distance_pairs.h"
#include "helpers.h"

static struct lw_distance distance(const struct lw_shape *a, const struct lw_shape *b)
{
    struct lw_distance out;
    assert_int_equal(lw_distance_shapes(a, b, &out), LW_OK);
    return out;
}

// A shape of a kind with at most 8 points, in one place of many.
static void set_shape(struct random *random, enum lw_shape_kind kind, struct pair *pair)
{
    const double zero[3] = {0};
    do {
        *pair = (struct pair){.count = 0};
        pair_set_shape(random, RANDOM, kind, zero, pair);
    } while (pair->count > 8);
}

static void check_identity(const struct lw_distance *found, double tolerance)
{
    assert_near(lw_vec_norm(found->n), 1, 1e-14);
    for (int k = 0; k < 3; k++)
        assert_near(found->pa[k] - found->pb[k], found->d * found->n[k], tolerance);
}

// --- pairs of bounded shapes ---

static void pairs_of_all_kinds_are_exact(void **state)
{
    (void)state;
    const enum lw_shape_kind kinds[4] = {LW_SPHERE, LW_CAPSULE, LW_BOX, LW_HULL};
    struct random random = {41};
    int overlaps = 0;
    for (int n = 0; n < 1600; n++) {
        static struct pair a, b;
        set_shape(&random, kinds[n % 4], &a);
        set_shape(&random, kinds[n / 4 % 4], &b);
        const struct lw_distance found = distance(&a.shape, &b.shape);
        const double core = (double)oracle_distance(a.points[0], a.count, b.points[0], b.count);
        assert_near(found.d, core - a.shape.r - b.shape.r, 5e-15);
        assert_near(lw_distance_shapes_gap(&a.shape, &b.shape, &found), 0, 1e-12);
        check_identity(&found, 2e-15);
        assert_int_equal((found.flags & LW_DISTANCE_CORE) != 0, core < 0);
        overlaps += core < 0;
    }
    assert_true(overlaps > 20);
}

// Depth of boxes and hulls one in the other, where every face and pair of edges may be the way out.
static void deep_overlaps_are_exact(void **state)
{
    (void)state;
    struct random random = {42};
    for (int n = 0; n < 600; n++) {
        static struct pair a, b;
        double shift[3], inside[3];
        set_shape(&random, n % 2 ? LW_BOX : LW_HULL, &a);
        set_shape(&random, n / 2 % 2 ? LW_BOX : LW_HULL, &b);
        // Centre in centre, less a little.
        lw_vec_sub(a.shape.c, b.shape.c, shift);
        pair_point(&random, 0.1, inside);
        lw_vec_add_scaled(1, inside, shift);
        lw_vec_add_scaled(1, shift, b.shape.c);
        for (int i = 0; i < b.count; i++)
            lw_vec_add_scaled(1, shift, b.points[i]);
        const struct lw_distance found = distance(&a.shape, &b.shape), back = distance(&b.shape, &a.shape);
        const double core = (double)oracle_distance(a.points[0], a.count, b.points[0], b.count);
        assert_near(found.d, core - a.shape.r - b.shape.r, 1e-14);
        assert_near(back.d, found.d, 1e-14);
        check_identity(&found, 2e-15);
        assert_int_equal(found.flags & ~LW_DISTANCE_CORE, 0);
    }
}

// Whichever comes first: points swap, n turns.
static void shapes_can_swap_roles(void **state)
{
    (void)state;
    struct random random = {43};
    for (int n = 0; n < 2000; n++) {
        static struct pair a, b;
        set_shape(&random, n % 2 ? LW_SPHERE : LW_CAPSULE, &a);
        set_shape(&random, n / 2 % 2 ? LW_BOX : LW_HULL, &b);
        const struct lw_distance there = distance(&a.shape, &b.shape), back = distance(&b.shape, &a.shape);
        assert_near(back.d, there.d, 0);
        assert_all_near(back.pa, there.pb, 3, 0);
        assert_all_near(back.pb, there.pa, 3, 0);
        for (int k = 0; k < 3; k++)
            assert_near(back.n[k], -there.n[k], 0);
    }
}

// --- half-spaces ---

static void any_shape_over_a_half_space(void **state)
{
    (void)state;
    const enum lw_shape_kind kinds[4] = {LW_SPHERE, LW_CAPSULE, LW_BOX, LW_HULL};
    static const struct lw_pose origin = {.r = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
    struct random random = {44};
    for (int n = 0; n < 2000; n++) {
        static struct pair a;
        struct lw_solid solid = {.kind = LW_HALFSPACE, .offset = random_in(&random, -1, 1)};
        struct lw_shape wall;
        double lowest = HUGE_VAL;
        set_shape(&random, kinds[n % 4], &a);
        pair_direction(&random, solid.normal);
        assert_int_equal(lw_shape_make(&solid, &origin, NULL, &wall, NULL), LW_OK);
        for (int i = 0; i < a.count; i++)
            lowest = fmin(lowest, lw_vec_dot(a.points[i], solid.normal) - solid.offset);
        const struct lw_distance found = distance(&a.shape, &wall), back = distance(&wall, &a.shape);
        assert_near(found.d, lowest - a.shape.r, 2e-15);
        assert_near(back.d, found.d, 0);
        assert_near(lw_distance_shapes_gap(&a.shape, &wall, &found), 0, 4e-15);
        assert_near(lw_distance_shapes_gap(&wall, &a.shape, &back), 0, 4e-15);
        assert_int_equal(found.flags, lowest < 0 ? LW_DISTANCE_CORE : 0);
        assert_all_near(found.n, wall.halfspace.m, 3, 0);
        assert_all_near(back.pa, found.pb, 3, 0);
        check_identity(&found, 2e-15);
        struct lw_distance none;
        assert_int_equal(lw_distance_shapes(&wall, &wall, &none), LW_E_ARGUMENT);
    }
}

// --- custom shapes ---

// The points of a pair's shape, as a support function.
static void points_support(const void *object, const ccd_vec3_t *direction, ccd_vec3_t *out)
{
    const struct pair *pair = object;
    double best = -HUGE_VAL;
    for (int i = 0; i < pair->count; i++) {
        const double height = lw_vec_dot(pair->points[i], direction->v);
        if (height <= best)
            continue;
        best = height;
        memcpy(out->v, pair->points[i], sizeof out->v);
    }
}

// A ball, its radius part of the core: a smooth shape.
struct ball {
    double c[3], r;
};

static void ball_support(const void *object, const ccd_vec3_t *direction, ccd_vec3_t *out)
{
    const struct ball *ball = object;
    const double length = lw_vec_norm(direction->v);
    for (int k = 0; k < 3; k++)
        out->v[k] = ball->c[k] + ball->r * direction->v[k] / length;
}

static struct lw_shape custom_shape(const struct lw_custom *custom, const double centre[3], double bound, double r)
{
    static const struct lw_pose origin = {.r = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
    struct lw_solid solid = {.kind = LW_CUSTOM, .radius = r, .custom = custom, .custom_bound = bound};
    struct lw_shape shape;
    memcpy(solid.custom_centre, centre, sizeof solid.custom_centre);
    assert_int_equal(lw_shape_make(&solid, &origin, NULL, &shape, NULL), LW_OK);
    return shape;
}

static void check_custom(const struct lw_distance *found, const struct lw_distance *built_in, double radii)
{
    assert_false(found->flags & LW_DISTANCE_CAPPED);
    if (built_in->flags & LW_DISTANCE_CORE) {
        // "At least this deep."
        assert_int_equal(found->flags, LW_DISTANCE_CORE | LW_DISTANCE_NO_NORMAL);
        assert_near(found->d, -radii, 1e-15);
        return;
    }
    assert_near(found->d, built_in->d, 1e-9);
    check_identity(found, 2e-15);
}

// The witness points are on the cores.
static void check_witnesses(const struct lw_distance *found, const struct pair *a, const struct pair *b)
{
    double qa[3], qb[3];
    for (int k = 0; k < 3; k++) {
        qa[k] = found->pa[k] + a->shape.r * found->n[k];
        qb[k] = found->pb[k] - b->shape.r * found->n[k];
    }
    if (found->flags & LW_DISTANCE_NO_NORMAL)
        return;
    assert_near((double)oracle_apart_points(qa, 1, a->points[0], a->count), 0, 1e-12);
    assert_near((double)oracle_apart_points(qb, 1, b->points[0], b->count), 0, 1e-12);
}

// Spheres, capsules, boxes and hulls by their support functions alone, against a link and against other shapes.
static void custom_shapes_equal_the_built_in_ones(void **state)
{
    (void)state;
    const enum lw_shape_kind kinds[4] = {LW_SPHERE, LW_CAPSULE, LW_BOX, LW_HULL};
    struct random random = {45};
    for (int n = 0; n < 4000; n++) {
        static struct pair a, b;
        const double zero[3] = {0};
        struct lw_distance built_in, found;
        set_shape(&random, kinds[n % 4], &a);
        set_shape(&random, kinds[n / 4 % 4], &b);
        pair_set_link(&random, n % 3 ? RANDOM : CORE_OVERLAP, zero, &a);
        const struct lw_custom of_a = {points_support, &a}, of_b = {points_support, &b};
        const struct lw_shape custom_a = custom_shape(&of_a, a.shape.c, a.shape.bound, a.shape.r);
        const struct lw_shape custom_b = custom_shape(&of_b, b.shape.c, b.shape.bound, b.shape.r);

        lw_distance_link(&a.link, &a.shape, HUGE_VAL, NULL, &built_in);
        lw_distance_link(&a.link, &custom_a, HUGE_VAL, NULL, &found);
        const double radii = a.link.r + a.shape.r;
        if (fabs(built_in.d + radii) > 1e-12)
            check_custom(&found, &built_in, radii);
        if (!(found.flags & LW_DISTANCE_NO_NORMAL))
            assert_true(fabs(lw_distance_gap(&a.link, &custom_a, &found)) < 1e-9);
        else
            assert_true(isinf(lw_distance_gap(&a.link, &custom_a, &found)));

        built_in = distance(&a.shape, &b.shape);
        found = distance(&custom_a, &custom_b);
        check_custom(&found, &built_in, a.shape.r + b.shape.r);
        check_witnesses(&found, &a, &b);
        found = distance(&custom_a, &b.shape);
        check_custom(&found, &built_in, a.shape.r + b.shape.r);
        found = distance(&a.shape, &custom_b);
        check_custom(&found, &built_in, a.shape.r + b.shape.r);
    }
}

// A smooth core has no vertices to end on: the duality gap ends the search.
static void smooth_custom_shapes(void **state)
{
    (void)state;
    struct random random = {46};
    int overlaps = 0;
    for (int n = 0; n < 3000; n++) {
        static struct pair pair;
        struct ball ball = {.r = random_in(&random, 0.05, 0.5)};
        struct lw_distance built_in, found;
        const double zero[3] = {0};
        set_shape(&random, LW_SPHERE, &pair);
        pair_set_link(&random, RANDOM, zero, &pair);
        memcpy(ball.c, pair.shape.c, sizeof ball.c);
        const struct lw_custom custom = {ball_support, &ball};
        const struct lw_shape shape = custom_shape(&custom, ball.c, ball.r, 0.03);
        pair.shape.r = ball.r + 0.03;
        lw_distance_link(&pair.link, &pair.shape, HUGE_VAL, NULL, &built_in);
        lw_distance_link(&pair.link, &shape, HUGE_VAL, NULL, &found);
        const double core = built_in.d + pair.link.r + 0.03;
        if (core < -1e-6) {
            overlaps++;
            assert_int_equal(found.flags, LW_DISTANCE_CORE | LW_DISTANCE_NO_NORMAL);
            assert_true(found.d >= built_in.d && found.d < 0);
        } else if (core > 1e-6) {
            assert_near(found.d, built_in.d, 1e-9);
            assert_true(fabs(lw_distance_gap(&pair.link, &shape, &found)) < 1e-9);
        }
    }
    assert_true(overlaps > 30);
}

static void custom_shapes_far_away_are_bounded(void **state)
{
    (void)state;
    struct random random = {47};
    int far = 0;
    for (int n = 0; n < 3000; n++) {
        static struct pair pair;
        struct lw_distance exact, bounded;
        const double zero[3] = {0}, d_max = random_in(&random, 0, 0.5);
        set_shape(&random, LW_HULL, &pair);
        pair_set_link(&random, RANDOM, zero, &pair);
        const struct lw_custom custom = {points_support, &pair};
        const struct lw_shape shape = custom_shape(&custom, pair.shape.c, pair.shape.bound, pair.shape.r);
        lw_distance_link(&pair.link, &shape, HUGE_VAL, NULL, &exact);
        lw_distance_link(&pair.link, &shape, d_max, NULL, &bounded);
        if (bounded.flags & LW_DISTANCE_FAR) {
            far++;
            assert_true(bounded.d > d_max - 1e-15 && bounded.d <= exact.d + 1e-12);
        } else {
            assert_near(bounded.d, exact.d, 0);
        }
    }
    assert_true(far > 500);
    // A plane has no support function.
    static const struct lw_pose origin = {.r = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
    const struct lw_solid plane = {.kind = LW_HALFSPACE, .normal = {0, 0, 1}};
    const struct ball ball = {{0}, 1};
    const struct lw_custom custom = {ball_support, &ball};
    const double zero[3] = {0};
    const struct lw_shape shape = custom_shape(&custom, zero, 1, 0);
    struct lw_shape table;
    struct lw_distance none;
    assert_int_equal(lw_shape_make(&plane, &origin, NULL, &table, NULL), LW_OK);
    assert_int_equal(lw_distance_shapes(&shape, &table, &none), LW_E_ARGUMENT);
    assert_int_equal(lw_distance_shapes(&table, &shape, &none), LW_E_ARGUMENT);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pairs_of_all_kinds_are_exact),
        cmocka_unit_test(deep_overlaps_are_exact),
        cmocka_unit_test(shapes_can_swap_roles),
        cmocka_unit_test(any_shape_over_a_half_space),
        cmocka_unit_test(custom_shapes_equal_the_built_in_ones),
        cmocka_unit_test(smooth_custom_shapes),
        cmocka_unit_test(custom_shapes_far_away_are_bounded),
    };
    return cmocka_run_group_tests_name("distance_shapes", tests, NULL, NULL);
}
