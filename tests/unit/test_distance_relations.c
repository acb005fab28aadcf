// SPDX-License-Identifier: BSD-3-Clause
// Tests of what has to hold between distances: gradient, continuity, motion, scale, roles and warm starts.
//
// Units    metres.
// Frames   one.
// Arrays   see distance_pairs.h.
// Memory   none.
// Errors   cmocka's.
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

// --- motion ---

// n is the gradient of d when the link moves, away from ridges where it jumps.
static void the_normal_is_the_gradient(void **state)
{
    (void)state;
    struct random random = {28};
    const double step = 1e-7;
    int checked = 0;
    for (int n = 0; n < 4000; n++) {
        static struct pair pair;
        double slope[3];
        const int class = random_below(&random, 3);
        pair_make(&random, class == 0 ? RANDOM : class == 1 ? SHALLOW : CORE_OVERLAP, &pair);
        const struct lw_distance here = distance(&pair.link, &pair.shape);
        bool smooth = here.d + pair.link.r + pair.shape.r > 1e-2 || (here.flags & LW_DISTANCE_CORE && here.d < -1e-2);
        for (int k = 0; k < 3; k++) {
            double axis[3] = {0};
            axis[k] = 1;
            struct lw_capsule ahead = pair.link, behind = pair.link;
            pair_shift(&ahead, step, axis);
            pair_shift(&behind, -step, axis);
            const struct lw_distance one = distance(&ahead, &pair.shape), other = distance(&behind, &pair.shape);
            slope[k] = (one.d - other.d) / (2 * step);
            smooth = smooth && lw_vec_dot(one.n, here.n) > 1 - 1e-9 && lw_vec_dot(other.n, here.n) > 1 - 1e-9 &&
                     one.flags == here.flags && other.flags == here.flags;
        }
        const bool solid = pair.shape.kind == LW_BOX || pair.shape.kind == LW_HULL;
        if (!smooth || (here.flags != 0 && !solid))
            continue; // cores of no volume have depth 0 and no gradient
        checked++;
        assert_all_near(slope, here.n, 3, 1e-6);
    }
    assert_true(checked > 2500);
}

// d changes by no more than the link moves, through contact and through overlapping cores.
static void the_distance_is_continuous(void **state)
{
    (void)state;
    struct random random = {29};
    const double step = 1e-3;
    int cores = 0;
    for (int n = 0; n < 400; n++) {
        static struct pair pair;
        double direction[3];
        pair_make(&random, n % 2 ? CORE_OVERLAP : PARALLEL, &pair);
        pair_direction(&random, direction);
        pair_shift(&pair.link, -0.25, direction);
        double before = distance(&pair.link, &pair.shape).d;
        for (int k = 0; k < 500; k++) {
            pair_shift(&pair.link, step, direction);
            const struct lw_distance now = distance(&pair.link, &pair.shape);
            assert_true(fabs(now.d - before) <= step * (1 + 1e-9));
            cores += (now.flags & LW_DISTANCE_CORE) != 0;
            before = now.d;
        }
    }
    assert_true(cores > 10000);
}

// Rigid motion with an offset of 1 km, and scales from 1 mm to 10 m, change nothing but the scale.
static void results_move_and_scale_with_the_pair(void **state)
{
    (void)state;
    struct random random = {30};
    for (int n = 0; n < 3000; n++) {
        struct lw_pose pose;
        double vertex[LW_HULL_MAX][3], room[2][LW_HULL_ROOM];
        struct lw_shape here, there, scaled;
        struct lw_capsule link = {.r = 0.05}, moved = {.r = 0.05}, resized;
        const double scale = n % 2 ? 1e-3 : 10;
        struct lw_solid solid = {.kind = n % 4 < 2 ? LW_HULL : n % 4 == 2 ? LW_BOX : LW_CAPSULE, .radius = 0.02};
        solid.count = pair_vertices(&random, RANDOM, vertex);
        solid.vertex = vertex[0];
        solid.half_length = 0.3;
        random_fill(&random, 0.1, 0.3, solid.half, 3);
        random_fill(&random, -0.6, 0.6, link.a, 3);
        random_fill(&random, -0.6, 0.6, link.b, 3);
        pair_pose(&random, &pose);
        for (int k = 0; k < 3; k++)
            pose.p[k] *= 1e3;
        pair_move(&pose, link.a, moved.a);
        pair_move(&pose, link.b, moved.b);
        here = made(&solid, room[0]);
        assert_int_equal(lw_shape_make(&solid, &pose, room[1], &there, NULL), LW_OK);
        const struct lw_distance a = distance(&link, &here), b = distance(&moved, &there);
        assert_near(b.d, a.d, 1e-12);

        resized = link;
        for (int k = 0; k < 3; k++) {
            resized.a[k] *= scale;
            resized.b[k] *= scale;
            solid.half[k] *= scale;
        }
        for (int i = 0; i < 3 * solid.count; i++)
            vertex[i / 3][i % 3] *= scale;
        resized.r *= scale;
        solid.radius *= scale;
        solid.half_length *= scale;
        scaled = made(&solid, room[1]);
        const struct lw_distance c = distance(&resized, &scaled);
        assert_near(c.d / scale, a.d, 2e-14);
    }
}

// Capsules in either role: distances and points agree, normals are opposite.
static void capsules_can_swap_roles(void **state)
{
    (void)state;
    struct random random = {31};
    for (int n = 0; n < 5000; n++) {
        struct lw_capsule a = {.r = 0.1}, b = {.r = 0.2};
        struct lw_distance there, back;
        random_fill(&random, -1, 1, a.a, 3);
        random_fill(&random, -1, 1, a.b, 3);
        random_fill(&random, -1, 1, b.a, 3);
        random_fill(&random, -1, 1, b.b, 3);
        lw_distance_capsules(&a, &b, &there);
        lw_distance_capsules(&b, &a, &back);
        const struct lw_shape shape = lw_shape_of_capsule(&b);
        const struct lw_distance same = distance(&a, &shape);
        assert_same_bits(&same, &there, sizeof same);
        assert_near(back.d, there.d, 1e-15);
        for (int k = 0; k < 3; k++) {
            assert_near(back.pa[k], there.pb[k], 1e-12);
            assert_near(back.n[k], -there.n[k], 1e-12);
        }
    }
}

// --- warm starts ---

static void check_same(const struct lw_distance *warm, const struct lw_distance *cold)
{
    assert_near(warm->d, cold->d, 1e-12 * fmax(1, cold->d));
    assert_int_equal(warm->flags & ~LW_DISTANCE_STALLED, cold->flags & ~LW_DISTANCE_STALLED);
}

// One warm start through pairs that have nothing in common but their key: every simplex in it is stale.
static void a_stale_warm_start_changes_nothing(void **state)
{
    (void)state;
    struct random random = {33};
    struct lw_warm warm = {0};
    for (int n = 0; n < 20000; n++) {
        static struct pair pair;
        struct lw_distance found;
        pair_make(&random, (enum pair_class)(n % 3 ? RANDOM : random_below(&random, CLASSES)), &pair);
        pair.shape.id = 7;
        pair.shape.generation = 3;
        lw_distance_link(&pair.link, &pair.shape, HUGE_VAL, &warm, &found);
        const struct lw_distance cold = distance(&pair.link, &pair.shape);
        if (fabs(cold.d + pair.link.r + pair.shape.r) > 1e-5) // else the search may end on either side of contact
            check_same(&found, &cold);
    }
}

// Small motions: most queries need one support, and the answer is the cold one.
static void coherent_motion_takes_one_support(void **state)
{
    (void)state;
    struct random random = {34};
    int queries = 0, supports = 0;
    for (int n = 0; n < 200; n++) {
        static struct pair pair;
        struct lw_warm warm = {0};
        struct lw_distance found;
        double direction[3];
        const double zero[3] = {0};
        pair_set_shape(&random, RANDOM, LW_HULL, zero, &pair);
        pair_set_link(&random, RANDOM, zero, &pair);
        pair.shape.id = 1;
        pair_direction(&random, direction);
        lw_distance_link(&pair.link, &pair.shape, HUGE_VAL, &warm, &found);
        for (int k = 0; k < 100 && !(found.flags & LW_DISTANCE_CORE); k++) {
            pair_shift(&pair.link, 1e-3, direction);
            lw_distance_link(&pair.link, &pair.shape, HUGE_VAL, &warm, &found);
            const struct lw_distance cold = distance(&pair.link, &pair.shape);
            check_same(&found, &cold);
            queries++;
            supports += found.iterations;
        }
    }
    assert_true(queries > 10000 && supports < 1.05 * queries);
}

// The key decides: another id, another generation, numbers out of range and no id at all start cold.
static void a_foreign_warm_start_is_not_used(void **state)
{
    (void)state;
    struct random random = {35};
    for (int n = 0; n < 500; n++) {
        static struct pair pair;
        struct lw_distance cold, found;
        struct lw_warm good, warm;
        const double zero[3] = {0};
        do {
            pair_set_shape(&random, RANDOM, LW_HULL, zero, &pair);
            pair_set_link(&random, RANDOM, zero, &pair);
            pair.shape.id = 5;
            pair.shape.generation = 9;
            good = (struct lw_warm){0};
            lw_distance_link(&pair.link, &pair.shape, HUGE_VAL, &good, &cold);
        } while (cold.flags != 0 || cold.iterations < 3);
        assert_true(good.id == 5 && good.generation == 9 && good.count >= 1 && good.count <= 3);
        warm = good;
        lw_distance_link(&pair.link, &pair.shape, HUGE_VAL, &warm, &found);
        assert_true(found.iterations < cold.iterations);
        for (int wrong = 0; wrong < 5; wrong++) {
            warm = good;
            warm.id += wrong == 0;
            warm.generation += wrong == 1;
            warm.count = (uint8_t)(wrong == 2 ? 4 : warm.count);
            warm.a[0] = (uint8_t)(wrong == 3 ? 2 : warm.a[0]);
            warm.b[0] = (uint8_t)(wrong == 4 ? pair.count : warm.b[0]);
            lw_distance_link(&pair.link, &pair.shape, HUGE_VAL, &warm, &found);
            assert_same_bits(&found, &cold, sizeof found);
            assert_same_bits(&warm, &good, sizeof warm);
        }
        // A shape without an id neither reads nor writes.
        pair.shape.id = 0;
        pair.shape.generation = 0;
        warm = (struct lw_warm){.count = 1};
        const struct lw_warm before = warm;
        lw_distance_link(&pair.link, &pair.shape, HUGE_VAL, &warm, &found);
        assert_same_bits(&found, &cold, sizeof found);
        assert_same_bits(&warm, &before, sizeof warm);
    }
}

// Overlapping cores forget the simplex: the next query starts cold.
static void overlap_clears_the_warm_start(void **state)
{
    (void)state;
    struct random random = {36};
    int cleared = 0;
    for (int n = 0; n < 500; n++) {
        static struct pair pair;
        const double zero[3] = {0};
        struct lw_warm warm = {.id = 2, .count = 1};
        struct lw_distance found;
        pair_set_shape(&random, RANDOM, LW_HULL, zero, &pair);
        pair_set_link(&random, CORE_OVERLAP, zero, &pair);
        pair.shape.id = 2;
        lw_distance_link(&pair.link, &pair.shape, HUGE_VAL, &warm, &found);
        if (!(found.flags & LW_DISTANCE_CORE))
            continue;
        cleared++;
        assert_int_equal(warm.count, 0);
    }
    assert_true(cleared > 400);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_normal_is_the_gradient),           cmocka_unit_test(the_distance_is_continuous),
        cmocka_unit_test(results_move_and_scale_with_the_pair), cmocka_unit_test(capsules_can_swap_roles),
        cmocka_unit_test(a_stale_warm_start_changes_nothing),   cmocka_unit_test(coherent_motion_takes_one_support),
        cmocka_unit_test(a_foreign_warm_start_is_not_used),     cmocka_unit_test(overlap_clears_the_warm_start),
    };
    return cmocka_run_group_tests_name("distance_relations", tests, NULL, NULL);
}
