// SPDX-License-Identifier: BSD-3-Clause
// Tests of three-vectors: the identities that define them, over random vectors.
//
// Units    none.
// Frames   one.
// Arrays   [3].
// Memory   none.
// Errors   cmocka's.
#include "base/vec.h"
#include "helpers.h"

enum { ROUNDS = 1000 };

// A cross product stands on both factors, turns right-handed and has the length of Lagrange's identity.
static void cross_product_is_right_handed_and_perpendicular(void **state)
{
    (void)state;
    struct random random = {1};
    const double x[3] = {1, 0, 0}, y[3] = {0, 1, 0}, z[3] = {0, 0, 1};
    double c[3];
    lw_vec_cross(x, y, c);
    assert_all_near(c, z, 3, 0);
    for (int i = 0; i < ROUNDS; i++) {
        double a[3], b[3];
        random_fill(&random, -2, 2, a, 3);
        random_fill(&random, -2, 2, b, 3);
        lw_vec_cross(a, b, c);
        assert_near(lw_vec_dot(a, c), 0, 1e-14);
        assert_near(lw_vec_dot(b, c), 0, 1e-14);
        const double ab = lw_vec_dot(a, b);
        assert_near(lw_vec_dot(c, c), lw_vec_dot(a, a) * lw_vec_dot(b, b) - ab * ab, 1e-13);
    }
}

// a - b, then + b, gives a again; the result may stand in an argument.
static void sums_and_differences_undo_each_other(void **state)
{
    (void)state;
    struct random random = {2};
    for (int i = 0; i < ROUNDS; i++) {
        double a[3], b[3], c[3], half[3] = {0};
        random_fill(&random, -2, 2, a, 3);
        random_fill(&random, -2, 2, b, 3);
        lw_vec_sub(a, b, c);
        lw_vec_add_scaled(1, b, c);
        assert_all_near(c, a, 3, 1e-15);
        lw_vec_sub(c, b, c);
        lw_vec_add_scaled(-0.5, c, half);
        for (int k = 0; k < 3; k++)
            assert_near(half[k], -0.5 * (a[k] - b[k]), 1e-15);
    }
}

static void norm_is_the_length(void **state)
{
    (void)state;
    const double a[3] = {2, -3, 6}, zero[3] = {0};
    assert_near(lw_vec_norm(a), 7, 0);
    assert_near(lw_vec_norm(zero), 0, 0);
}

// One value that is no number is found wherever it stands, and those behind the count are not looked at.
static void all_finite_looks_at_every_value_and_no_more(void **state)
{
    (void)state;
    const double bad[] = {NO_NUMBER, HUGE_VAL, -HUGE_VAL};
    for (int n = 1; n <= 6; n++)
        for (int at = 0; at < 6; at++)
            for (int b = 0; b < 3; b++) {
                double values[6] = {1, -2, 0, 1e308, -1e-308, 5};
                values[at] = bad[b];
                assert_int_equal(lw_all_finite(values, n), at >= n);
            }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cross_product_is_right_handed_and_perpendicular),
        cmocka_unit_test(sums_and_differences_undo_each_other),
        cmocka_unit_test(norm_is_the_length),
        cmocka_unit_test(all_finite_looks_at_every_value_and_no_more),
    };
    return cmocka_run_group_tests_name("vec", tests, NULL, NULL);
}
