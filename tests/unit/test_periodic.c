// SPDX-License-Identifier: BSD-3-Clause
// Tests of the fixed-rate loop: deadlines lie on one absolute grid, late ones are skipped and counted, never made up.
//
// Units    ns.
// Frames   none.
// Arrays   none.
// Memory   none.
// Errors   cmocka's.
#include "base/clock.h"
#include "base/periodic.h"
#include "helpers.h"

static const int64_t period = 2000000;

// A loop that is in time keeps its deadline.
static void nothing_is_skipped_in_time(void **state)
{
    (void)state;
    struct lw_periodic loop = lw_periodic_start(1000, period);
    const int64_t in_time[] = {INT64_MIN / 2, 0, 999, 1000};
    for (size_t i = 0; i < sizeof in_time / sizeof in_time[0]; i++) {
        lw_periodic_skip(&loop, in_time[i]);
        assert_true(loop.deadline_ns == 1000 && loop.skipped == 0);
    }
}

// One nanosecond late costs one period, one nanosecond before the next deadline too; one after it costs two.
static void lateness_is_counted_in_whole_periods(void **state)
{
    (void)state;
    const struct {
        int64_t late, skipped;
    } cases[] = {{1, 1}, {period - 1, 1}, {period + 1, 2}, {2 * period - 1, 2}, {1000 * period + 1, 1001}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct lw_periodic loop = lw_periodic_start(5000, period);
        lw_periodic_skip(&loop, 5000 + cases[i].late);
        assert_int_equal(loop.skipped, cases[i].skipped);
        assert_int_equal(loop.deadline_ns, 5000 + cases[i].skipped * period);
    }
}

// Whatever the lateness: the deadline stays on the grid and ahead by at most a period, so no burst can follow; what was
// skipped adds up; asking again at the same time changes nothing.
static void any_lateness_ends_on_the_grid_just_ahead(void **state)
{
    (void)state;
    struct random random = {4};
    struct lw_periodic loop = lw_periodic_start(777, period);
    int64_t now = 0;
    for (int i = 0; i < 10000; i++) {
        now += (int64_t)random_in(&random, 0, 5e6);
        const bool was_late = now > loop.deadline_ns;
        const struct lw_periodic before = loop;
        lw_periodic_skip(&loop, now);
        assert_true(loop.deadline_ns >= now);
        assert_true(!was_late || loop.deadline_ns - now <= period);
        assert_int_equal((loop.deadline_ns - 777) % period, 0);
        assert_int_equal(loop.deadline_ns - before.deadline_ns, (loop.skipped - before.skipped) * period);
        const struct lw_periodic once = loop;
        lw_periodic_skip(&loop, now);
        assert_true(loop.deadline_ns == once.deadline_ns && loop.skipped == once.skipped);
    }
}

// Against the real clock: no wake-up before its deadline, deadlines are first + k * period however late one wakes, and
// skipped plus waited periods account for all of the time.
static void waiting_keeps_absolute_deadlines(void **state)
{
    (void)state;
    const int64_t first = lw_clock_mono_ns() + period;
    struct lw_periodic loop = lw_periodic_start(first, period);
    for (int64_t waits = 1; waits <= 20; waits++) {
        const int64_t late = lw_periodic_wait(&loop);
        assert_true(late >= 0);
        assert_true(loop.wake_ns <= lw_clock_mono_ns());
        assert_int_equal(loop.wake_ns - late, loop.deadline_ns - period);
        assert_int_equal(loop.deadline_ns, first + (waits + loop.skipped) * period);
    }
}

// A loop that overslept three and a half periods goes on at the fifth deadline and says that four were skipped.
static void a_late_loop_does_not_burst(void **state)
{
    (void)state;
    const int64_t first = lw_clock_mono_ns() - 3 * period - period / 2;
    struct lw_periodic loop = lw_periodic_start(first, period);
    (void)lw_periodic_wait(&loop);
    assert_true(loop.skipped >= 4);
    assert_true(loop.wake_ns >= first + loop.skipped * period);
    assert_int_equal(loop.deadline_ns, first + (loop.skipped + 1) * period);
}

// The clocks run forwards, and two sessions differ.
static void clocks_and_sessions(void **state)
{
    (void)state;
    const int64_t a = lw_clock_mono_ns(), b = lw_clock_mono_ns();
    assert_true(a > 0 && b >= a);
    assert_true(lw_clock_utime() > INT64_C(1500000000000000));
    lw_clock_sleep_until(b + 1000000);
    assert_true(lw_clock_mono_ns() >= b + 1000000);
    const int64_t one = lw_clock_session(), two = lw_clock_session();
    assert_true(one > 0 && two > 0 && one != two);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_is_skipped_in_time),
        cmocka_unit_test(lateness_is_counted_in_whole_periods),
        cmocka_unit_test(any_lateness_ends_on_the_grid_just_ahead),
        cmocka_unit_test(waiting_keeps_absolute_deadlines),
        cmocka_unit_test(a_late_loop_does_not_burst),
        cmocka_unit_test(clocks_and_sessions),
    };
    return cmocka_run_group_tests_name("periodic", tests, NULL, NULL);
}
