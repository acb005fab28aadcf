// SPDX-License-Identifier: BSD-3-Clause
// Tests of the phase lock: two simulated clocks with drift, jitter and loss. From any offset the loop comes to lie half
// a period behind the messages, and then every tick has one.
//
// Units    ns; errors in periods.
// Frames   none.
// Arrays   none.
// Memory   stack.
// Errors   cmocka's.
#include "base/phase.h"
#include "helpers.h"

static const int64_t period = 2000000;

// --- the sender ---

struct sender {
    struct random random;
    double period_ns; // by the receiver's clock: drift included
    double jitter;    // periods, either way
    double loss;      // share of messages
    double mean_ns;   // when the message under way would come without jitter
    int64_t due_ns;   // when it comes
    bool lost;
};

static void send_next(struct sender *s)
{
    s->mean_ns += s->period_ns;
    s->due_ns = llround(s->mean_ns + random_in(&s->random, -s->jitter, s->jitter) * (double)period);
    s->lost = random_in(&s->random, 0, 1) < s->loss;
}

static struct sender start_sender(uint64_t seed, double drift)
{
    struct sender s = {.random = {seed * UINT64_C(0x9e3779b97f4a7c15)},
                       .period_ns = (double)period * (1 + drift),
                       .jitter = 0.2,
                       .loss = 0.05,
                       .mean_ns = 1e12};
    send_next(&s);
    return s;
}

// --- the loop ---

struct loop {
    struct lw_phase phase;
    int64_t deadline_ns, arrival_ns;
    int64_t step_ns; // the loop's own period, a multiple of the sender's
    int came, lost;  // in the tick just done
    int64_t correction_ns;
};

// Distance of a deadline from the middle between two mean arrivals, in periods.
static double error_of(const struct loop *loop, const struct sender *s)
{
    const double behind = ((double)loop->deadline_ns - s->mean_ns) / s->period_ns - 0.5;
    return behind - round(behind);
}

static void tick(struct loop *loop, struct sender *s, bool jump)
{
    loop->came = loop->lost = 0;
    for (; s->due_ns <= loop->deadline_ns; send_next(s)) {
        loop->lost += s->lost;
        loop->came += !s->lost;
        if (!s->lost)
            loop->arrival_ns = s->due_ns;
    }
    loop->deadline_ns += loop->step_ns;
    loop->correction_ns =
        loop->came ? lw_phase_correct(&loop->phase, loop->deadline_ns, loop->arrival_ns, period, jump) : 0;
    loop->deadline_ns += loop->correction_ns;
}

static struct loop start_loop(const struct sender *s, double offset)
{
    return (struct loop){.deadline_ns = llround(s->mean_ns + offset * (double)period), .step_ns = period};
}

// The requirement on one run: locked within 250 ticks, and then one message a tick but where one was lost.
static void check_locks(struct loop *loop, struct sender *s, int ticks)
{
    const int messages = (int)(loop->step_ns / period);
    for (int k = 0; k < ticks; k++) {
        tick(loop, s, false);
        assert_true(llabs(loop->correction_ns) <= period / 100);
        if (k < 250)
            continue;
        assert_true(fabs(error_of(loop, s)) < 0.15);
        assert_int_equal(loop->came + loop->lost, messages);
    }
}

// --- locking ---

static void it_locks_from_any_offset_and_drift(void **state)
{
    (void)state;
    struct random random = {21};
    for (uint64_t seed = 1; seed <= 40; seed++)
        for (int offset = 0; offset < 16; offset++) {
            const double drifts[] = {200e-6, -200e-6, 0, random_in(&random, -200e-6, 200e-6)};
            struct sender s = start_sender(seed * 16 + (uint64_t)offset, drifts[seed % 4]);
            struct loop loop = start_loop(&s, offset / 16.0);
            check_locks(&loop, &s, 3000);
        }
}

// A loop that is four times slower than its sender locks to it as well.
static void a_slower_loop_locks(void **state)
{
    (void)state;
    for (uint64_t seed = 1; seed <= 40; seed++) {
        struct sender s = start_sender(seed, seed % 2 ? 200e-6 : -200e-6);
        struct loop loop = start_loop(&s, (double)seed / 40);
        loop.step_ns = 4 * period;
        check_locks(&loop, &s, 2000);
    }
}

// Without correction the same clocks do miss: some ticks have two messages and some none that was not lost.
static void free_clocks_do_miss(void **state)
{
    (void)state;
    struct sender s = start_sender(5, 200e-6);
    struct loop loop = start_loop(&s, 0);
    int two = 0, none = 0;
    for (int k = 0; k < 3000; k++) {
        tick(&loop, &s, false);
        loop.deadline_ns -= loop.correction_ns;
        two += loop.came > 1;
        none += loop.came + loop.lost == 0;
    }
    assert_true(two > 100 && none > 100);
}

// Silence for a while and then a sender in another phase: the lock is found again.
static void it_locks_again_after_silence(void **state)
{
    (void)state;
    for (uint64_t seed = 1; seed <= 20; seed++) {
        struct sender s = start_sender(seed, 100e-6);
        struct loop loop = start_loop(&s, 0.3);
        check_locks(&loop, &s, 500);
        s.mean_ns += (100 + (double)seed / 20) * (double)period;
        send_next(&s);
        check_locks(&loop, &s, 500);
    }
}

// --- filter ---

// Nothing is moved before five messages have come.
static void it_waits_for_five_messages(void **state)
{
    (void)state;
    for (int jump = 0; jump < 2; jump++) {
        struct lw_phase phase = {0};
        for (int k = 0; k < LW_PHASE_SAMPLES - 1; k++)
            assert_int_equal(lw_phase_correct(&phase, period * k, 0, period, jump), 0);
        assert_true(lw_phase_correct(&phase, 0, 0, period, jump) != 0);
    }
}

// The median counts: two messages of five, however late or early, move nothing.
static void two_late_messages_of_five_move_nothing(void **state)
{
    (void)state;
    struct random random = {22};
    struct lw_phase phase = {0};
    int64_t deadline = 1000 * period;
    for (int k = 0; k < 1000; k++, deadline += period) {
        const bool odd = k % 5 == 1 || k % 5 == 3;
        const int64_t late = odd ? (int64_t)random_in(&random, -0.49, 0.49) * period : 0;
        assert_int_equal(lw_phase_correct(&phase, deadline, deadline - period / 2 + late, period, false), 0);
    }
}

static int ascending(const void *a, const void *b)
{
    const int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;
    return (x > y) - (x < y);
}

// Any errors: the one in the middle of the newest five is corrected.
static void the_newest_five_messages_count(void **state)
{
    (void)state;
    struct random random = {23};
    struct lw_phase phase = {0};
    int64_t errors[1000], newest[LW_PHASE_SAMPLES];
    for (int k = 0; k < 1000; k++) {
        errors[k] = (int64_t)random_in(&random, -0.49 * (double)period, 0.49 * (double)period);
        const int64_t correction = lw_phase_correct(&phase, period / 2 + errors[k], 0, period, false);
        if (k < LW_PHASE_SAMPLES - 1)
            continue;
        memcpy(newest, &errors[k - LW_PHASE_SAMPLES + 1], sizeof newest);
        qsort(newest, LW_PHASE_SAMPLES, sizeof newest[0], ascending);
        assert_int_equal(correction, -newest[LW_PHASE_SAMPLES / 2] / 50);
    }
}

// From one correction to the next the error shrinks by a fiftieth, towards the middle from either side; a whole number
// of periods between deadline and message does not count.
static void a_correction_is_a_fiftieth_of_the_error(void **state)
{
    (void)state;
    for (int64_t whole = -3; whole <= 3; whole++)
        for (int64_t error = -period / 2; error < period / 2; error += period / 40) {
            struct lw_phase phase = {0};
            int64_t correction = 0;
            for (int k = 0; k < LW_PHASE_SAMPLES; k++)
                correction = lw_phase_correct(&phase, whole * period + period / 2 + error, 0, period, false);
            assert_int_equal(correction, -error / 50);
        }
}

// --- jump ---

// While nothing depends on even periods one correction reaches the phase, forward and by less than a period; the next
// needs five new messages.
static void a_jump_reaches_the_phase_at_once(void **state)
{
    (void)state;
    for (int offset = 0; offset < 100; offset++) {
        struct sender s = start_sender((uint64_t)offset + 1, 0);
        struct loop loop = start_loop(&s, offset / 100.0);
        s.jitter = s.loss = 0;
        send_next(&s);
        for (int messages = 0; messages < LW_PHASE_SAMPLES; messages += loop.came) {
            tick(&loop, &s, true);
            assert_true(loop.correction_ns >= 0 && loop.correction_ns < period);
        }
        assert_true(fabs(error_of(&loop, &s)) < 1e-6);
        for (int k = 0; k < LW_PHASE_SAMPLES - 1; k++) {
            tick(&loop, &s, true);
            assert_int_equal(loop.correction_ns, 0);
        }
    }
}

// With jitter and loss, jumps for half a second and then even periods: locked from the first of these on.
static void after_jumps_it_is_locked(void **state)
{
    (void)state;
    for (uint64_t seed = 1; seed <= 100; seed++) {
        struct sender s = start_sender(seed, seed % 2 ? 200e-6 : -200e-6);
        struct loop loop = start_loop(&s, (double)seed / 100);
        for (int k = 0; k < 250; k++) {
            tick(&loop, &s, true);
            assert_true(loop.correction_ns >= 0);
        }
        for (int k = 0; k < 1000; k++) {
            tick(&loop, &s, false);
            assert_true(fabs(error_of(&loop, &s)) < 0.2);
            assert_true(loop.came + loop.lost <= 2);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_locks_from_any_offset_and_drift),
        cmocka_unit_test(a_slower_loop_locks),
        cmocka_unit_test(free_clocks_do_miss),
        cmocka_unit_test(it_locks_again_after_silence),
        cmocka_unit_test(it_waits_for_five_messages),
        cmocka_unit_test(two_late_messages_of_five_move_nothing),
        cmocka_unit_test(the_newest_five_messages_count),
        cmocka_unit_test(a_correction_is_a_fiftieth_of_the_error),
        cmocka_unit_test(a_jump_reaches_the_phase_at_once),
        cmocka_unit_test(after_jumps_it_is_locked),
    };
    return cmocka_run_group_tests_name("phase", tests, NULL, NULL);
}
