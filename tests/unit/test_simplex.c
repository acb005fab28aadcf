// SPDX-License-Identifier: BSD-3-Clause
// Tests of a simplex's nearest point: against brute force, also where it is flat, a needle, or repeats a point.
//
// Units    metres.
// Frames   one.
// Arrays   see simplex.h.
// Memory   none.
// Errors   cmocka's.
#include "base/vec.h" // lw_vec_*
#include "collision/simplex.h"
#include "distance_oracle.h"
#include "helpers.h"

enum { ROUNDS = 20000 };

// Points about the origin or beside it; of the later ones some lie on a line, in a plane or on a point of the others.
static struct lw_simplex make(struct random *random)
{
    struct lw_simplex s = {.count = 1 + random_below(random, 4)};
    double beside[3];
    random_fill(random, -1, 1, beside, 3);
    const double far = 0.7 * random_below(random, 2);
    for (int i = 0; i < s.count; i++) {
        random_fill(random, -1, 1, s.w[i], 3);
        lw_vec_add_scaled(far, beside, s.w[i]);
        s.a[i] = (uint8_t)(10 + i);
        s.b[i] = (uint8_t)(20 + i);
        double t[3], point[3] = {0};
        random_fill(random, -0.5, 1.5, t, 3);
        if (i == 0 || random_below(random, 4))
            continue;
        const int kind = random_below(random, 3);
        t[2] = i > 2 ? t[2] : 0;
        t[1] = i > 1 && kind == 0 ? t[1] : 0;
        t[2] = kind == 0 ? t[2] : 0;
        t[0] = kind == 2 ? 1 : t[0];
        const double sum = 1 - t[0] - t[1] - t[2];
        lw_vec_add_scaled(sum, s.w[0], point);
        lw_vec_add_scaled(t[0], s.w[i > 1 ? 1 : 0], point);
        lw_vec_add_scaled(t[1], s.w[i > 1 ? i - 1 : 0], point);
        lw_vec_add_scaled(t[2], s.w[i > 2 ? 2 : 0], point);
        memcpy(s.w[i], point, sizeof point);
    }
    return s;
}

// Six times the volume of a tetrahedron with a corner at the origin.
static long double volume(const struct lw_simplex *s, int i, int j, int k)
{
    return wide_dot(wide_cross(wide_of(s->w[i]), wide_of(s->w[j])), wide_of(s->w[k]));
}

// The origin is inside four points by more than rounding: it parts them into four tetrahedra of one sign.
static bool origin_inside(const struct lw_simplex *s)
{
    if (s->count < 4)
        return false;
    const long double part[4] = {volume(s, 1, 2, 3), -volume(s, 0, 2, 3), volume(s, 0, 1, 3), -volume(s, 0, 1, 2)};
    const long double sign = part[0] < 0 ? -1 : 1;
    for (int i = 0; i < 4; i++)
        if (sign * part[i] < 1e-12L)
            return false;
    return true;
}

static void the_nearest_point_is_exact(void **state)
{
    (void)state;
    struct random random = {51};
    const double origin[3] = {0};
    int inside = 0, dropped[5] = {0};
    for (int n = 0; n < ROUNDS; n++) {
        const struct lw_simplex before = make(&random);
        struct lw_simplex s = before;
        assert_true(lw_simplex_reduce(&s, HUGE_VAL));
        if (s.count == 4) {
            inside++;
            assert_near(s.square, 0, 0);
            assert_true((double)oracle_distance(origin, 1, before.w[0], 4) < 1e-12);
            continue;
        }
        dropped[s.count]++;
        const double expected = (double)oracle_apart_points(origin, 1, before.w[0], before.count);
        assert_near(lw_vec_norm(s.v), expected, 1e-14);
        assert_false(origin_inside(&before));
        assert_near(s.square, lw_vec_dot(s.v, s.v), 1e-15);

        // v is the mean of points that were there, each still with its names.
        double sum = 0, mean[3] = {0};
        for (int i = 0; i < s.count; i++) {
            const int from = (s.a[i] - 10) & 3;
            assert_true(s.a[i] == 10 + from && s.b[i] == 20 + from && from < before.count && s.lambda[i] > 0);
            assert_all_near(s.w[i], before.w[from], 3, 0);
            sum += s.lambda[i];
            lw_vec_add_scaled(s.lambda[i], s.w[i], mean);
        }
        assert_near(sum, 1, 1e-15);
        assert_all_near(mean, s.v, 3, 1e-13);
    }
    assert_true(inside > 80 && dropped[1] > 1000 && dropped[2] > 1000 && dropped[3] > 1000);
}

// Without progress nothing changes but that the newest point goes.
static void no_progress_drops_the_newest_point(void **state)
{
    (void)state;
    struct random random = {52};
    for (int n = 0; n < 1000; n++) {
        struct lw_simplex s = make(&random);
        const struct lw_simplex before = s;
        assert_false(lw_simplex_reduce(&s, 0) && s.count < 4);
        if (s.count == 4)
            continue; // the origin is inside
        struct lw_simplex expected = before;
        expected.count--;
        assert_same_bits(&s, &expected, sizeof s);
        struct lw_simplex bad = before;
        bad.w[0][1] = (double)NAN;
        bad.count = 1;
        assert_false(lw_simplex_reduce(&bad, HUGE_VAL));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_nearest_point_is_exact),
        cmocka_unit_test(no_progress_drops_the_newest_point),
    };
    return cmocka_run_group_tests_name("simplex", tests, NULL, NULL);
}
