// SPDX-License-Identifier: BSD-3-Clause
// Tests of the distance of a link to a shape: cases with known answers, every regime of the result, and what has to
// hold between results.
//
// Units    metres.
// Frames   one.
// Arrays   see distance_pairs.h.
// Memory   none.
// Errors   cmocka's.
#include "collision/clouds.h" // lw_clouds_distance
#include "distance_pairs.h"
#include "helpers.h"
#include "program/allocations.h" // lw_allocations_*

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

// --- what is no number ---

// A NaN anywhere in the link comes out as a distance that is no number, never as a plausible one.
static void a_nan_comes_out(void **state)
{
    (void)state;
    struct random random = {23};
    const enum lw_shape_kind kinds[5] = {LW_SPHERE, LW_CAPSULE, LW_BOX, LW_HULL, LW_HALFSPACE};
    for (int n = 0; n < 7 * 5 * 20; n++) {
        struct pair pair = {.count = 0};
        const double zero[3] = {0};
        const enum lw_shape_kind kind = kinds[n / 7 % 5];
        if (kind == LW_HALFSPACE)
            pair.shape = made(&(struct lw_solid){.kind = kind, .normal = {0, 0.6, 0.8}}, NULL);
        else
            pair_set_shape(&random, RANDOM, kind, zero, &pair);
        random_fill(&random, -1, 1, pair.link.a, 3);
        random_fill(&random, -1, 1, pair.link.b, 3);
        pair.link.r = 0.1;
        const int which = n % 7;
        double *number = which < 3 ? &pair.link.a[which] : which < 6 ? &pair.link.b[which - 3] : &pair.link.r;
        *number = n / 35 % 2 ? (double)NAN : HUGE_VAL;
        const struct lw_distance found = distance(&pair.link, &pair.shape);
        assert_true(!isfinite(found.d));
    }
}

// --- bounds and caps ---

// Whatever d_max is: FAR is a bound between d_max and the distance, and everything else is exact.
static void far_is_a_proven_bound(void **state)
{
    (void)state;
    struct random random = {24};
    int far = 0;
    for (int n = 0; n < 5000; n++) {
        static struct pair pair;
        struct lw_distance bounded;
        pair_make(&random, (enum pair_class)random_below(&random, CLASSES), &pair);
        const double d_max = random_in(&random, 0, 1);
        const struct lw_distance exact = distance(&pair.link, &pair.shape);
        lw_distance_link(&pair.link, &pair.shape, d_max, NULL, &bounded);
        if (bounded.flags & LW_DISTANCE_FAR) {
            const double zero[9] = {0};
            far++;
            assert_int_equal(bounded.flags, LW_DISTANCE_FAR | LW_DISTANCE_NO_NORMAL);
            assert_true(bounded.d > d_max - 1e-15 && bounded.d <= exact.d + 1e-12);
            assert_same_bits(bounded.pa, zero, sizeof bounded.pa);
            assert_near(lw_distance_gap(&pair.link, &pair.shape, &bounded), 0, 0);
        } else {
            assert_near(bounded.d, exact.d, 0);
        }
    }
    assert_true(far > 500);
}

// The query of a link and a hull as lw_distance_link builds it, with caps of the test's.
static struct lw_distance capped(const struct pair *pair, int cap, int epa_cap)
{
    struct lw_distance out;
    double room_a[LW_HULL_ROOM], room_b[LW_HULL_ROOM];
    const struct lw_shape link = lw_shape_of_capsule(&pair->link);
    const double *c = pair->shape.c, r[2] = {pair->link.r, pair->shape.r};
    struct lw_gjk_query query = lw_clouds_query(lw_clouds_of(&link, c, room_a), lw_clouds_of(&pair->shape, c, room_b));
    struct lw_simplex simplex = {.count = 0};
    query.cap = cap;
    lw_clouds_distance(&query, &simplex, r, epa_cap, &out);
    lw_clouds_shift(c, &out);
    return out;
}

// Cut short, a search says so, errs above, and its certificate bounds the distance from below.
static void a_cut_search_is_bounded_by_its_gap(void **state)
{
    (void)state;
    struct random random = {25};
    int cut = 0;
    for (int n = 0; n < 3000; n++) {
        static struct pair pair;
        const double zero[3] = {0};
        pair_set_shape(&random, RANDOM, LW_HULL, zero, &pair);
        pair_set_link(&random, RANDOM, zero, &pair);
        const struct lw_distance exact = distance(&pair.link, &pair.shape), found = capped(&pair, 1, LW_EPA_CAP);
        assert_int_equal(found.iterations, 1);
        assert_int_equal(found.flags, LW_DISTANCE_CAPPED);
        const double gap = lw_distance_gap(&pair.link, &pair.shape, &found);
        assert_true(found.d >= exact.d - 1e-14 && found.d - gap <= exact.d + 1e-14);
        cut += gap > 1e-3;
        const struct lw_distance whole = capped(&pair, LW_GJK_CAP, LW_EPA_CAP);
        assert_near(whole.d, exact.d, 1e-14);
        assert_int_equal(whole.flags, exact.flags);
    }
    assert_true(cut > 1000);
}

// EPA cut short: the depth is enough to part the two, so d errs on the careful side; and it says so.
static void a_cut_epa_errs_on_the_careful_side(void **state)
{
    (void)state;
    struct random random = {26};
    int stalled = 0;
    for (int n = 0; n < 2000; n++) {
        static struct pair pair;
        const double zero[3] = {0};
        pair_set_shape(&random, RANDOM, LW_HULL, zero, &pair);
        pair_set_link(&random, CORE_OVERLAP, zero, &pair);
        const struct lw_distance exact = distance(&pair.link, &pair.shape);
        if (!(exact.flags & LW_DISTANCE_CORE))
            continue; // the link ends beside the hull
        for (int cap = 0; cap < 4; cap++) {
            const struct lw_distance found = capped(&pair, LW_GJK_CAP, cap);
            assert_true(found.d <= exact.d + 1e-14);
            assert_near(lw_distance_gap(&pair.link, &pair.shape, &found), 0, 1e-13);
            if (!(found.flags & LW_DISTANCE_STALLED))
                assert_near(found.d, exact.d, 1e-14);
            else
                stalled++;
            assert_true(found.flags & LW_DISTANCE_CORE);
        }
    }
    assert_true(stalled > 2000);
}

// Two evenly spread spheres of vertices, one in the other: EPA's pools cannot hold their difference.
static void a_full_pool_ends_epa(void **state)
{
    (void)state;
    double vertex[2][LW_HULL_MAX][3], room[2][LW_HULL_ROOM];
    struct lw_shape shape[2];
    struct lw_distance found;
    for (int s = 0; s < 2; s++) {
        for (int i = 0; i < LW_HULL_MAX; i++) {
            const double z = (2 * i + 1.0) / LW_HULL_MAX - 1, turn = 2.399963229728653 * i + s, r = sqrt(1 - z * z);
            const double point[3] = {r * cos(turn), r * sin(turn), z};
            memcpy(vertex[s][i], point, sizeof point);
        }
        const struct lw_solid solid = {.kind = LW_HULL, .count = LW_HULL_MAX, .vertex = vertex[s][0]};
        shape[s] = made(&solid, room[s]);
    }
    assert_int_equal(lw_distance_shapes(&shape[0], &shape[1], &found), LW_OK);
    assert_int_equal(found.flags, LW_DISTANCE_CORE | LW_DISTANCE_STALLED);
    assert_true(found.d > -2 && found.d < -1.8);
    assert_near(lw_distance_shapes_gap(&shape[0], &shape[1], &found), 0, 1e-13);
}

// --- cost ---

static void queries_allocate_nothing(void **state)
{
    (void)state;
    if (!lw_allocations_watch())
        skip();
    struct random random = {32};
    int cores = 0;
    for (int n = 0; n < 20000; n++) {
        static struct pair pair;
        struct lw_warm warm = {0};
        pair_make(&random, (enum pair_class)(n % CLASSES), &pair);
        pair.shape.id = 1;
        struct lw_distance found;
        lw_distance_link(&pair.link, &pair.shape, 0.5, &warm, &found);
        lw_distance_link(&pair.link, &pair.shape, 0.5, &warm, &found);
        cores += (found.flags & LW_DISTANCE_CORE) && pair.shape.kind == LW_HULL;
    }
    assert_int_equal(lw_allocations_count(), 0);
    lw_allocations_unwatch();
    assert_true(cores > 500); // EPA too
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_nan_comes_out),
        cmocka_unit_test(far_is_a_proven_bound),
        cmocka_unit_test(a_cut_search_is_bounded_by_its_gap),
        cmocka_unit_test(a_cut_epa_errs_on_the_careful_side),
        cmocka_unit_test(a_full_pool_ends_epa),
        cmocka_unit_test(queries_allocate_nothing),
    };
    return cmocka_run_group_tests_name("distance", tests, NULL, NULL);
}
