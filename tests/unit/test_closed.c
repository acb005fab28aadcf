// SPDX-License-Identifier: BSD-3-Clause
// Tests of the closed forms where the answer is known: points, parallel and crossing axes, boxes and half-spaces.
//
// Units    metres.
// Frames   one.
// Arrays   see distance_pairs.h.
// Memory   none.
// Errors   cmocka's.
#include "collision/closed.h" // lw_closed_perpendicular
#include "distance_oracle.h"
#include "distance_pairs.h"
#include "helpers.h"

static const struct lw_pose origin = {.r = {1, 0, 0, 0, 1, 0, 0, 0, 1}};

static struct lw_distance distance(const struct lw_capsule *link, const struct lw_shape *shape)
{
    struct lw_distance out;
    memset(&out, 0x55, sizeof out);
    lw_distance_link(link, shape, HUGE_VAL, NULL, &out);
    return out;
}

static struct lw_shape made(const struct lw_solid *solid, double *room)
{
    struct lw_shape shape;
    assert_int_equal(lw_shape_make(solid, &origin, room, &shape, NULL), LW_OK);
    return shape;
}

static void check(const struct lw_distance *found, double d, int flags, const double n[3])
{
    assert_near(found->d, d, 1e-15);
    assert_int_equal(found->flags, flags);
    assert_all_near(found->n, n, 3, 1e-15);
    for (int k = 0; k < 3; k++)
        assert_near(found->pa[k] - found->pb[k], found->d * found->n[k], 1e-15);
}

static void segments_of_no_length_are_points(void **state)
{
    (void)state;
    const struct lw_capsule point = {{1, 2, 3}, {1, 2, 3}, 0.25}, other = {{1, 2, 5}, {1, 2, 5}, 0.5};
    const double up[3] = {0, 0, 1}, down[3] = {0, 0, -1};
    struct lw_distance found;
    lw_distance_capsules(&point, &other, &found);
    check(&found, 1.25, 0, down);
    lw_distance_capsules(&other, &point, &found);
    check(&found, 1.25, 0, up);
    lw_distance_capsules(&point, &point, &found);
    check(&found, -0.5, LW_DISTANCE_CORE, up);
    struct lw_shape shape = lw_shape_of_capsule(&other);
    shape.kind = LW_SPHERE;
    found = distance(&point, &shape);
    check(&found, 1.25, 0, down);
    const struct lw_shape same = {.kind = LW_SPHERE, .r = 0.5, .c = {1, 2, 3}};
    found = distance(&point, &same);
    check(&found, -0.75, LW_DISTANCE_CORE, up);
}

// A link that goes through a sphere's centre is pushed out across its axis; so are crossing and overlapping axes.
static void cores_that_meet_are_parted_across_their_axes(void **state)
{
    (void)state;
    const struct lw_capsule along_x = {{-1, 0, 0}, {2, 0, 0}, 0.25}, along_y = {{0, -3, 0}, {0, 1, 0}, 0.5};
    const struct lw_capsule on_it = {{0, 0, 0}, {5, 0, 0}, 0.5};
    const struct lw_shape sphere = {.kind = LW_SPHERE, .r = 0.5};
    const double up[3] = {0, 0, 1};
    struct lw_distance found;
    lw_distance_capsules(&along_x, &along_y, &found);
    check(&found, -0.75, LW_DISTANCE_CORE, up);
    lw_distance_capsules(&along_x, &on_it, &found);
    assert_near(found.d, -0.75, 0);
    assert_int_equal(found.flags, LW_DISTANCE_CORE);
    assert_true(found.n[0] == 0 && fabs(lw_vec_norm(found.n) - 1) < 1e-15);
    found = distance(&along_x, &sphere);
    assert_near(found.d, -0.75, 0);
    assert_int_equal(found.flags, LW_DISTANCE_CORE);
    assert_true(found.n[0] == 0 && fabs(lw_vec_norm(found.n) - 1) < 1e-15);
}

// Parallel axes, side by side, one beyond the other, in either direction.
static void parallel_axes(void **state)
{
    (void)state;
    const struct lw_capsule axis = {{0, 0, 0}, {2, 0, 0}, 0.25};
    const double down[3] = {0, 0, -1}, back[3] = {-1, 0, 0};
    for (int turned = 0; turned < 2; turned++) {
        struct lw_distance found;
        struct lw_capsule beside = {{1, 0, 1}, {4, 0, 1}, 0.25}, beyond = {{3, 0, 0}, {5, 0, 0}, 0.25};
        if (turned)
            for (int k = 0; k < 3; k++) {
                const double a = beside.a[k], b = beyond.a[k];
                beside.a[k] = beside.b[k];
                beside.b[k] = a;
                beyond.a[k] = beyond.b[k];
                beyond.b[k] = b;
            }
        lw_distance_capsules(&axis, &beside, &found);
        check(&found, 0.5, 0, down);
        assert_true(found.pa[0] >= 1 && found.pa[0] <= 2);
        lw_distance_capsules(&axis, &beyond, &found);
        check(&found, 0.5, 0, back);
    }
}

// A point on an axis, and axes that cross at a small angle: n is perpendicular to both.
static void the_way_out_is_perpendicular_to_both_axes(void **state)
{
    (void)state;
    struct random random = {20};
    for (int n = 0; n < 2000; n++) {
        double u[3], w[3], perpendicular[3];
        struct lw_capsule a = {.r = 0.1}, b = {.r = 0.2};
        struct lw_distance found;
        pair_direction(&random, u);
        pair_direction(&random, w);
        for (int k = 0; k < 3; k++) {
            w[k] = n % 2 ? 0 : u[k] + 0.02 * w[k];
            a.a[k] = -0.5 * u[k];
            a.b[k] = 0.5 * u[k];
            b.a[k] = -0.75 * w[k];
            b.b[k] = 0.25 * w[k];
        }
        lw_distance_capsules(n % 4 < 2 ? &a : &b, n % 4 < 2 ? &b : &a, &found);
        assert_int_equal(found.flags, LW_DISTANCE_CORE);
        assert_near(found.d, -0.3, 1e-15);
        assert_near(lw_vec_dot(found.n, u), 0, 2e-13);
        assert_near(lw_vec_dot(found.n, w), 0, 2e-13);
        lw_closed_perpendicular(u, perpendicular);
        assert_near(lw_vec_dot(perpendicular, u), 0, 1e-15);
        assert_near(lw_vec_norm(perpendicular), 1, 1e-15);
    }
}

// Axes that are parallel but for 1e-12 to 0.1 rad and nearly touch: leaning together or apart, side by side or end to
// end, whichever end is nearest.
static void nearly_parallel_axes_are_exact(void **state)
{
    (void)state;
    struct random random = {19};
    for (int n = 0; n < 20000; n++) {
        double u[3], side[3], lean[3], ends[2][2][3], length[2] = {0.5, 0.7};
        struct lw_capsule axis[2];
        struct lw_distance found;
        pair_direction(&random, u);
        pair_direction(&random, lean);
        lw_closed_perpendicular(u, side);
        const double apart = pow(10, random_in(&random, -10, 0)), angle = pow(10, random_in(&random, -12, -1));
        const double along = random_in(&random, -1, 1), sign = random_below(&random, 2) ? 1 : -1;
        for (int k = 0; k < 3; k++) {
            const double direction = u[k] + angle * (random_below(&random, 2) ? side[k] : lean[k]);
            ends[0][0][k] = 0;
            ends[0][1][k] = sign * length[0] * u[k];
            ends[1][0][k] = apart * side[k] + along * u[k];
            ends[1][1][k] = ends[1][0][k] + length[1] * direction;
        }
        for (int s = 0; s < 2; s++) {
            axis[s].r = 0;
            memcpy(axis[s].a, ends[s][0], sizeof axis[s].a);
            memcpy(axis[s].b, ends[s][1], sizeof axis[s].b);
        }
        lw_distance_capsules(&axis[n % 2], &axis[1 - n % 2], &found);
        const double expected = (double)oracle_apart_points(ends[0][0], 2, ends[1][0], 2);
        assert_near(found.d, expected, 2e-11);
    }
}

// A link along a face: the middle of the part beside it, in and out of it.
static void links_along_a_box(void **state)
{
    (void)state;
    const struct lw_solid solid = {.kind = LW_BOX, .half = {1, 2, 3}, .radius = 0.125};
    const struct lw_shape box = made(&solid, NULL);
    const double up[3] = {0, 0, 1};
    struct lw_distance found;
    const struct lw_capsule above = {{-5, 0.5, 4}, {0.5, 0.5, 4}, 0.25},
                            within = {{-5, 0.5, 2.5}, {0.5, 0.5, 2.5}, 0.25};
    found = distance(&above, &box);
    check(&found, 0.625, 0, up);
    assert_near(found.pa[0], -0.25, 1e-15);
    found = distance(&within, &box); // half a metre under the top
    check(&found, -0.875, LW_DISTANCE_CORE, up);
    assert_near(found.pa[0], -0.25, 1e-14);
    // The same with axes that are not exact.
    struct random random = {21};
    for (int n = 0; n < 1000; n++) {
        struct lw_pose pose;
        struct lw_shape turned;
        struct lw_capsule link = {.r = 0.25};
        double expected[3], middle[3];
        const double x[3] = {-0.25, 0.5, 4};
        pair_pose(&random, &pose);
        assert_int_equal(lw_shape_make(&solid, &pose, NULL, &turned, NULL), LW_OK);
        pair_move(&pose, above.a, link.a);
        pair_move(&pose, above.b, link.b);
        pair_move(&pose, x, middle);
        found = distance(&link, &turned);
        assert_near(found.d, 0.625, 1e-14);
        for (int k = 0; k < 3; k++)
            expected[k] = middle[k] - 0.25 * found.n[k];
        assert_all_near(found.pa, expected, 3, 1e-13);
    }
}

// Each face of a box by the nearest exit, and an edge of it.
static void the_nearest_way_out_of_a_box(void **state)
{
    (void)state;
    const struct lw_solid solid = {.kind = LW_BOX, .half = {1, 2, 3}};
    const struct lw_shape box = made(&solid, NULL);
    for (int axis = 0; axis < 3; axis++)
        for (int sign = -1; sign <= 1; sign += 2) {
            struct lw_capsule link = {.r = 0.25};
            double n[3] = {0};
            n[axis] = sign;
            link.a[axis] = sign * (solid.half[axis] - 0.125);
            link.b[axis] = sign * (solid.half[axis] + 1);
            const struct lw_distance found = distance(&link, &box);
            check(&found, -0.375, LW_DISTANCE_CORE, n);
        }
    // Across the edge at x = 1, y = 2, parallel to its bevel: sqrt(2)/10 deep.
    const struct lw_capsule across = {{0, 2.8, 0}, {1.8, 1, 0}, 0.25};
    const struct lw_distance found = distance(&across, &box);
    const double bevel[3] = {sqrt(0.5), sqrt(0.5), 0};
    check(&found, -0.1 * sqrt(2) - 0.25, LW_DISTANCE_CORE, bevel);
}

// Above, across and below a plane; a parallel axis answers with its middle.
static void half_spaces(void **state)
{
    (void)state;
    const struct lw_solid solid = {.kind = LW_HALFSPACE, .normal = {0, 0, 1}, .offset = 0.5};
    const struct lw_shape table = made(&solid, NULL);
    const double up[3] = {0, 0, 1};
    for (int end = 0; end < 2; end++)
        for (int height = -2; height <= 2; height++) {
            const double low = 0.5 + height;
            struct lw_capsule link = {{1, 1, low}, {3, 1, low + 0.5}, 0.25};
            if (end) {
                link.a[2] = low + 0.5;
                link.b[2] = low;
            }
            struct lw_distance found = distance(&link, &table);
            check(&found, height - 0.25, height < 0 ? LW_DISTANCE_CORE : 0, up);
            assert_near(found.pa[0], end ? 3 : 1, 0);
            link.a[2] = link.b[2] = low;
            found = distance(&link, &table);
            check(&found, height - 0.25, height < 0 ? LW_DISTANCE_CORE : 0, up);
            assert_near(found.pa[0], 2, 0);
            assert_near(lw_distance_gap(&link, &table, &found), 0, 1e-15);
            // Nothing but its own normal proves the distance of a half-space.
            found.n[0] = 1e-9;
            assert_true(isinf(lw_distance_gap(&link, &table, &found)));
        }
}

static void half_spaces_of_any_direction(void **state)
{
    (void)state;
    struct random random = {22};
    for (int n = 0; n < 2000; n++) {
        struct lw_solid solid = {.kind = LW_HALFSPACE, .offset = random_in(&random, -1, 1)};
        struct lw_capsule link = {.r = 0.1};
        pair_direction(&random, solid.normal);
        random_fill(&random, -1, 1, link.a, 3);
        random_fill(&random, -1, 1, link.b, 3);
        const struct lw_shape shape = made(&solid, NULL);
        const struct lw_distance found = distance(&link, &shape);
        const double expected =
            fmin(lw_vec_dot(solid.normal, link.a), lw_vec_dot(solid.normal, link.b)) - solid.offset - 0.1;
        assert_near(found.d, expected, 1e-15);
        assert_near(lw_vec_dot(found.pb, shape.halfspace.m), shape.halfspace.o, 1e-15);
        assert_near(lw_distance_gap(&link, &shape, &found), 0, 2e-15);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(segments_of_no_length_are_points),
        cmocka_unit_test(cores_that_meet_are_parted_across_their_axes),
        cmocka_unit_test(parallel_axes),
        cmocka_unit_test(the_way_out_is_perpendicular_to_both_axes),
        cmocka_unit_test(nearly_parallel_axes_are_exact),
        cmocka_unit_test(links_along_a_box),
        cmocka_unit_test(the_nearest_way_out_of_a_box),
        cmocka_unit_test(half_spaces),
        cmocka_unit_test(half_spaces_of_any_direction),
    };
    return cmocka_run_group_tests_name("closed", tests, NULL, NULL);
}
