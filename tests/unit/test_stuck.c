// SPDX-License-Identifier: BSD-3-Clause
// Tests of the detector of standstill away from the goal.
//
// Units    metres; ns where a name says so.
// Frames   none.
// Arrays   none.
// Memory   stack.
// Errors   cmocka's.
#include "controller/stuck.h"
#include "helpers.h"

static const double tolerance = 0.05;
static const int64_t ms = 1000000;

static bool note(struct lw_stuck *stuck, double deviation, int64_t number, int64_t period_ns)
{
    const struct lw_stuck_tick at = {.number = number, .period_ns = period_ns, .time_ns = (number + 1) * period_ns};
    return lw_stuck_note(stuck, deviation, tolerance, &at);
}

// Notes a deviation again and again; returns the number of the tick that first finds it stuck, -1 = none did.
static int first_stuck(struct lw_stuck *stuck, double deviation, int ticks, int64_t period_ns)
{
    for (int k = 0; k < ticks; k++)
        if (note(stuck, deviation, k, period_ns))
            return k;
    return -1;
}

// At 125 Hz it takes 101 samples; at any other rate the same 0.8 s.
static void standstill_is_found_after_its_time(void **state)
{
    (void)state;
    const int64_t periods_ns[] = {8 * ms, ms / 5, ms, 2 * ms, 3 * ms, 5 * ms, 5400000, 7 * ms, 50 * ms, 900 * ms};
    for (size_t i = 0; i < sizeof periods_ns / sizeof periods_ns[0]; i++) {
        struct lw_stuck stuck = {0};
        const int64_t period_ns = periods_ns[i];
        const int k = first_stuck(&stuck, 0.3, 10000, period_ns);
        const int64_t sample_ns = period_ns > 8 * ms ? period_ns : 8 * ms + period_ns;
        assert_in_range(k * period_ns, 800 * ms, 800 * ms + sample_ns);
        assert_int_equal(stuck.since_ns, (k + 1) * period_ns);
    }
    struct lw_stuck stuck = {0};
    assert_int_equal(first_stuck(&stuck, 0.3, 1000, 8 * ms), 100);
}

// Near the goal, exactly at the tolerance, there is nothing to find; just beyond it there is.
static void the_goal_is_no_trap(void **state)
{
    (void)state;
    struct lw_stuck stuck = {0};
    assert_int_equal(first_stuck(&stuck, tolerance, 1000, 8 * ms), -1);
    assert_int_equal(first_stuck(&stuck, nextafter(tolerance, 1), 1000, 8 * ms), 0);
}

// A band of 1 cm within 0.8 s counts as standing still, a wider one does not, whichever way it goes.
static void motion_is_told_from_standstill(void **state)
{
    (void)state;
    for (int sign = -1; sign <= 1; sign += 2)
        for (int wide = 0; wide <= 1; wide++) {
            struct lw_stuck stuck = {0};
            const double step = sign * (wide ? 1.0001e-4 : 0.9999e-4); // 100 steps within the window
            bool found = false;
            for (int k = 0; k < 400; k++)
                found |= note(&stuck, 0.5 + k * step, k, 8 * ms);
            assert_int_equal(found, !wide);
        }
}

// It remembers since when, and forgets when the tip moves on or is told to.
static void since_when(void **state)
{
    (void)state;
    struct lw_stuck stuck = {0};
    const int k = first_stuck(&stuck, 0.3, 1000, 8 * ms);
    for (int i = 1; i < 50; i++)
        assert_true(note(&stuck, 0.3, k + i, 8 * ms));
    assert_int_equal(stuck.since_ns, (k + 1) * 8 * ms);
    assert_false(note(&stuck, 0.28, k + 50, 8 * ms));
    assert_int_equal(stuck.since_ns, 0);
    int more = 1;
    while (!note(&stuck, 0.28, k + 50 + more, 8 * ms))
        more++;
    assert_int_equal(more, 100);
    lw_stuck_reset(&stuck);
    assert_int_equal(stuck.since_ns, 0);
    assert_int_equal(first_stuck(&stuck, 0.28, 1000, 8 * ms), 100);
}

// Between two samples nothing changes.
static void ticks_between_samples_repeat_the_answer(void **state)
{
    (void)state;
    struct lw_stuck stuck = {0};
    const int k = first_stuck(&stuck, 0.3, 1000, 2 * ms);
    assert_int_equal(k % 4, 0);
    for (int i = 1; i < 4; i++)
        assert_true(note(&stuck, 9, k + i, 2 * ms));
    assert_false(note(&stuck, 9, k + 4, 2 * ms));
}

// Whoever begins to watch later samples at the same ticks, and comes to the same answer once it has seen enough.
static void a_later_watcher_comes_to_the_same(void **state)
{
    (void)state;
    struct random random = {5};
    for (int late = 1; late < 9; late++) {
        struct lw_stuck one = {0}, two = {0};
        double deviation = 0.5;
        for (int64_t k = 1; k < 3000; k++) {
            deviation += random_in(&random, -2e-4, 2e-4) * (k % 1000 < 600);
            const bool first = note(&one, deviation, k, 2 * ms), second = k > late && note(&two, deviation, k, 2 * ms);
            if (k > late + 408)
                assert_true(first == second);
        }
    }
}

// A deviation that is no number is not a standstill.
static void no_number_is_no_standstill(void **state)
{
    (void)state;
    struct lw_stuck stuck = {0};
    assert_int_equal(first_stuck(&stuck, (double)NAN, 1000, 8 * ms), -1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(standstill_is_found_after_its_time),
                                       cmocka_unit_test(the_goal_is_no_trap),
                                       cmocka_unit_test(motion_is_told_from_standstill),
                                       cmocka_unit_test(since_when),
                                       cmocka_unit_test(ticks_between_samples_repeat_the_answer),
                                       cmocka_unit_test(a_later_watcher_comes_to_the_same),
                                       cmocka_unit_test(no_number_is_no_standstill)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
