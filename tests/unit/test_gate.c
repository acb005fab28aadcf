// SPDX-License-Identifier: BSD-3-Clause
// Tests of the gate: every verdict at its boundaries and in its order, the lease, and that no traffic whatever gives
// two controllers one arm.
//
// Units    ns, rad/s.
// Frames   none.
// Arrays   one entry a joint.
// Memory   static.
// Errors   cmocka's.
#include "base/refusal.h"
#include "bus/gate.h"
#include "helpers.h"

enum { PLANT = 100, FIRST = 7, SECOND = 8, STATE = 1000, LAG = 20 };
static const int64_t lease_ns = 100000000, open_ns = 250000000, now_ns = 900000000;

static struct lw_gate make_gate(void)
{
    return (struct lw_gate){.plant_session = PLANT,
                            .open_ns = open_ns,
                            .lease_ns = lease_ns,
                            .max_lag = LAG,
                            .velocity = {1, 2, 3, 4, 5, HUGE_VAL}};
}

static struct lw_joint_command make_command(int64_t session, int64_t seq)
{
    return (struct lw_joint_command){.stamp = {.session = session, .seq = seq},
                                     .plant_session = PLANT,
                                     .state_seq = STATE,
                                     .mode = LW_COMMAND_VELOCITY,
                                     .qd = {0.5, -0.5, 0, -0.0, 0.1, 50}};
}

// Judges; a refusal must leave the lease as it was, to the last byte.
static enum lw_verdict judge(struct lw_lease *lease, const struct lw_joint_command *command, int64_t state_seq,
                             int64_t now)
{
    const struct lw_gate gate = make_gate();
    struct lw_lease before;
    memcpy(&before, lease, sizeof before);
    const enum lw_verdict verdict = lw_gate_judge(&gate, lease, command, state_seq, now);
    if (verdict != LW_TAKEN)
        assert_same_bits(lease, &before, sizeof before);
    return verdict;
}

static enum lw_verdict offer(struct lw_lease *lease, int64_t session, int64_t seq, int64_t now)
{
    const struct lw_joint_command c = make_command(session, seq);
    return judge(lease, &c, STATE, now);
}

// --- what a command is ---

static void a_good_command_takes_the_free_lease(void **state)
{
    (void)state;
    struct lw_lease lease = {0};
    assert_int_equal(offer(&lease, FIRST, 41, now_ns), LW_TAKEN);
    const struct lw_lease expected = {.session = FIRST, .seq = 41, .last_ns = now_ns, .taken = 1};
    assert_same_bits(&lease, &expected, sizeof lease); // what came before its first message nobody missed
}

// Each joint has its limit, and the limit itself is allowed; no number passes, not even where any speed would.
static void velocities_are_numbers_within_the_limits(void **state)
{
    (void)state;
    const struct lw_gate gate = make_gate();
    const double no_number[] = {NO_NUMBER, -NO_NUMBER, HUGE_VAL, -HUGE_VAL};
    for (int j = 0; j < LW_NJ; j++)
        for (int sign = -1; sign <= 1; sign += 2) {
            struct lw_lease lease = {0};
            struct lw_joint_command c = make_command(FIRST, 1);
            const double limit = j < 5 ? gate.velocity[j] : 1.7e308;
            c.qd[j] = sign * limit;
            assert_int_equal(judge(&lease, &c, STATE, now_ns), LW_TAKEN);
            c.stamp.seq++;
            c.qd[j] = sign * nextafter(limit, HUGE_VAL);
            assert_int_equal(judge(&lease, &c, STATE, now_ns), j < 5 ? LW_REFUSED_RANGE : LW_TAKEN);
            for (int i = 0; i < 4; i++) {
                c.qd[j] = no_number[i];
                c.stamp.seq++;
                assert_int_equal(judge(&lease, &c, STATE, now_ns), LW_REFUSED_RANGE);
            }
        }
}

static void a_command_for_another_plant_is_refused(void **state)
{
    (void)state;
    const int64_t others[] = {0, PLANT - 1, PLANT + 1, -PLANT, INT64_MIN, INT64_MAX};
    for (size_t i = 0; i < sizeof others / sizeof others[0]; i++) {
        struct lw_lease lease = {0};
        struct lw_joint_command c = make_command(FIRST, 1);
        c.plant_session = others[i];
        assert_int_equal(judge(&lease, &c, STATE, now_ns), LW_REFUSED_OTHER_PLANT);
    }
}

static void an_idle_command_takes_no_lease(void **state)
{
    (void)state;
    struct lw_lease lease = {0};
    struct lw_joint_command c = make_command(FIRST, 1);
    c.mode = LW_COMMAND_IDLE;
    assert_int_equal(judge(&lease, &c, STATE, now_ns), LW_REFUSED_IDLE);
    assert_int_equal(offer(&lease, SECOND, 1, now_ns), LW_TAKEN);
}

// --- time ---

// The guard ends to the nanosecond.
static void nothing_is_taken_before_the_guard_ends(void **state)
{
    (void)state;
    for (int64_t over = -1; over <= 1; over++) {
        struct lw_lease lease = {0};
        assert_int_equal(offer(&lease, FIRST, 1, open_ns + over), over < 0 ? LW_REFUSED_GUARD : LW_TAKEN);
    }
}

// The newest state and LAG before it will do; none older, and none that was never published. The sender chooses its
// number: those whose difference does not fit are refused as well.
static void the_state_may_be_as_old_as_the_lag(void **state)
{
    (void)state;
    for (int64_t old = -2; old <= LAG + 2; old++) {
        struct lw_lease lease = {0};
        struct lw_joint_command c = make_command(FIRST, 1);
        c.state_seq = STATE - old;
        assert_int_equal(judge(&lease, &c, STATE, now_ns), old < 0 || old > LAG ? LW_REFUSED_STALE : LW_TAKEN);
    }
    const int64_t far[] = {INT64_MIN, INT64_MIN + 1, INT64_MIN + STATE, INT64_MAX, -1, 0};
    for (size_t i = 0; i < sizeof far / sizeof far[0]; i++) {
        struct lw_lease lease = {0};
        struct lw_joint_command c = make_command(FIRST, 1);
        c.state_seq = far[i];
        assert_int_equal(judge(&lease, &c, STATE, now_ns), LW_REFUSED_STALE);
    }
}

// In lockstep any lag will do, and still no state that was never published.
static void any_lag_means_any_lag(void **state)
{
    (void)state;
    struct lw_gate gate = make_gate();
    gate.max_lag = INT64_MAX;
    const int64_t seqs[] = {0, 1, STATE, STATE + 1, INT64_MIN};
    for (size_t i = 0; i < sizeof seqs / sizeof seqs[0]; i++) {
        struct lw_lease lease = {0};
        struct lw_joint_command c = make_command(FIRST, 1);
        c.state_seq = seqs[i];
        const bool published = c.state_seq >= 0 && c.state_seq <= STATE;
        assert_int_equal(lw_gate_judge(&gate, &lease, &c, STATE, now_ns), published ? LW_TAKEN : LW_REFUSED_STALE);
    }
}

// While the holder has been silent for less than the lease nobody else is heard; at the lease, to the nanosecond, the
// next one is. The holder's own next command counts however long it was silent.
static void a_second_controller_waits_for_the_lease_to_end(void **state)
{
    (void)state;
    for (int64_t over = -1; over <= 1; over++) {
        struct lw_lease lease = {0};
        assert_int_equal(offer(&lease, FIRST, 1, now_ns), LW_TAKEN);
        assert_int_equal(offer(&lease, SECOND, 9, now_ns), LW_REFUSED_FOREIGN);
        assert_int_equal(offer(&lease, FIRST, 2, now_ns + 50), LW_TAKEN); // a command renews the lease
        const enum lw_verdict expected = over < 0 ? LW_REFUSED_FOREIGN : LW_TAKEN;
        assert_int_equal(offer(&lease, SECOND, 9, now_ns + 50 + lease_ns + over), expected);
        assert_int_equal(lease.takeovers, over >= 0);
        assert_int_equal(lease.session, over < 0 ? FIRST : SECOND);
        // Now the roles are changed.
        assert_int_equal(offer(&lease, FIRST, 3, now_ns + 50 + lease_ns + over),
                         over < 0 ? LW_TAKEN : LW_REFUSED_FOREIGN);
    }
    struct lw_lease lease = {0};
    assert_int_equal(offer(&lease, FIRST, 1, now_ns), LW_TAKEN);
    assert_int_equal(offer(&lease, FIRST, 2, now_ns + 50 * lease_ns), LW_TAKEN);
    assert_int_equal(lease.takeovers, 0);
}

// A lease that nobody held is free at any time, also when the clock has only just started.
static void a_lease_that_nobody_held_is_free(void **state)
{
    (void)state;
    for (int64_t now = 0; now <= 2 * lease_ns; now += lease_ns / 2) {
        struct lw_lease lease = {0};
        const struct lw_stamp stamp = {.session = FIRST, .seq = 1};
        assert_int_equal(lw_lease_take(&lease, &stamp, now, lease_ns), LW_TAKEN);
        assert_true(lease.session == FIRST && lease.last_ns == now && lease.takeovers == 0);
    }
}

// --- order ---

static void a_command_is_taken_once_and_in_order(void **state)
{
    (void)state;
    struct lw_lease lease = {0};
    assert_int_equal(offer(&lease, FIRST, 5, now_ns), LW_TAKEN);
    assert_int_equal(offer(&lease, FIRST, 5, now_ns + 1), LW_REFUSED_DUPLICATE);
    assert_int_equal(offer(&lease, FIRST, 4, now_ns + 1), LW_REFUSED_BACKWARDS);
    assert_int_equal(offer(&lease, FIRST, 6, now_ns + 1), LW_TAKEN);
    assert_int_equal(offer(&lease, FIRST, 5, now_ns + 1), LW_REFUSED_BACKWARDS);
    // The end of the lease gives an old message no second life.
    assert_int_equal(offer(&lease, FIRST, 6, now_ns + 9 * lease_ns), LW_REFUSED_DUPLICATE);
    assert_int_equal(offer(&lease, FIRST, 1, now_ns + 9 * lease_ns), LW_REFUSED_BACKWARDS);
    // Another one counts from where it likes.
    assert_int_equal(offer(&lease, SECOND, 2, now_ns + 9 * lease_ns), LW_TAKEN);
    assert_int_equal(lease.seq, 2);
}

// Numbers skipped by a holder add up over all holders; where the sum would not fit it ends at the largest number.
static void missed_numbers_add_up(void **state)
{
    (void)state;
    struct lw_lease lease = {0};
    int64_t now = now_ns;
    assert_int_equal(offer(&lease, FIRST, 10, now), LW_TAKEN);
    assert_int_equal(offer(&lease, FIRST, 11, now), LW_TAKEN);
    assert_int_equal(lease.missed, 0);
    assert_int_equal(offer(&lease, FIRST, 15, now), LW_TAKEN);
    assert_int_equal(lease.missed, 3);
    now += lease_ns;
    assert_int_equal(offer(&lease, SECOND, 100, now), LW_TAKEN);
    assert_int_equal(lease.missed, 3);
    assert_int_equal(offer(&lease, SECOND, 102, now), LW_TAKEN);
    assert_true(lease.missed == 4 && lease.taken == 5 && lease.takeovers == 1);
    for (int64_t session = 50; session < 53; session++) {
        now += lease_ns;
        assert_int_equal(offer(&lease, session, 1, now), LW_TAKEN);
        assert_int_equal(offer(&lease, session, INT64_MAX, now), LW_TAKEN);
    }
    assert_int_equal(lease.missed, INT64_MAX);
}

// --- the order of verdicts ---

// A command with every fault at once; mending the one named brings up the next.
static void verdicts_come_in_their_order(void **state)
{
    (void)state;
    struct lw_lease lease = {.session = FIRST, .seq = 5, .last_ns = open_ns - 2};
    struct lw_joint_command c = {.stamp = {.session = SECOND, .seq = 5}, .qd = {NO_NUMBER}};
    int64_t now = open_ns - 1;
    assert_int_equal(judge(&lease, &c, STATE, now), LW_REFUSED_RANGE);
    c.qd[0] = 0;
    assert_int_equal(judge(&lease, &c, STATE, now), LW_REFUSED_GUARD);
    now = open_ns;
    assert_int_equal(judge(&lease, &c, STATE, now), LW_REFUSED_OTHER_PLANT);
    c.plant_session = PLANT;
    assert_int_equal(judge(&lease, &c, STATE, now), LW_REFUSED_IDLE);
    c.mode = LW_COMMAND_VELOCITY;
    assert_int_equal(judge(&lease, &c, STATE, now), LW_REFUSED_STALE);
    c.state_seq = STATE;
    assert_int_equal(judge(&lease, &c, STATE, now), LW_REFUSED_FOREIGN);
    c.stamp.session = FIRST;
    assert_int_equal(judge(&lease, &c, STATE, now), LW_REFUSED_DUPLICATE);
    c.stamp.seq = 4;
    assert_int_equal(judge(&lease, &c, STATE, now), LW_REFUSED_BACKWARDS);
    c.stamp.seq = 6;
    assert_int_equal(judge(&lease, &c, STATE, now), LW_TAKEN);
}

// A late command of a controller that is gone cannot take the lease that another one left free, nor the first one.
static void a_stale_command_cannot_take_a_free_lease(void **state)
{
    (void)state;
    struct lw_lease lease = {0};
    struct lw_joint_command old = make_command(FIRST, 7);
    old.state_seq = STATE - LAG - 1;
    assert_int_equal(judge(&lease, &old, STATE, now_ns), LW_REFUSED_STALE);
    assert_int_equal(offer(&lease, SECOND, 1, now_ns), LW_TAKEN);
    assert_int_equal(judge(&lease, &old, STATE, now_ns + 5 * lease_ns), LW_REFUSED_STALE);
    assert_int_equal(offer(&lease, SECOND, 2, now_ns + 5 * lease_ns), LW_TAKEN);
}

// --- counting refusals ---

// Every status of the wire and the world has a reason; only LW_OK is none.
static void every_failure_has_a_reason(void **state)
{
    (void)state;
    const struct {
        enum lw_status status;
        enum lw_verdict verdict;
    } cases[] = {{LW_OK, LW_TAKEN},
                 {LW_E_SIZE, LW_REFUSED_SIZE},
                 {LW_E_DECODE, LW_REFUSED_TYPE},
                 {LW_E_NOT_FINITE, LW_REFUSED_NO_NUMBER},
                 {LW_E_ARGUMENT, LW_REFUSED_RANGE},
                 {LW_E_OLD, LW_REFUSED_BACKWARDS},
                 {LW_E_FULL, LW_REFUSED_FULL}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        assert_int_equal(lw_verdict_of(cases[i].status), cases[i].verdict);
}

static void refusals_are_counted_by_reason(void **state)
{
    (void)state;
    struct lw_refusals refusals = {0};
    assert_true(lw_refusals_note(&refusals, LW_TAKEN));
    assert_int_equal(lw_refusals_total(&refusals), 0);
    for (int reason = 0; reason < LW_REFUSED_COUNT; reason++)
        for (int n = 0; n <= reason; n++)
            assert_false(lw_refusals_note(&refusals, (enum lw_verdict)reason));
    for (int reason = 0; reason < LW_REFUSED_COUNT; reason++)
        assert_int_equal(lw_refusals_of(&refusals, (enum lw_verdict)reason), reason + 1);
    assert_int_equal(lw_refusals_total(&refusals), LW_REFUSED_COUNT * (LW_REFUSED_COUNT + 1) / 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_good_command_takes_the_free_lease),
        cmocka_unit_test(velocities_are_numbers_within_the_limits),
        cmocka_unit_test(a_command_for_another_plant_is_refused),
        cmocka_unit_test(an_idle_command_takes_no_lease),
        cmocka_unit_test(nothing_is_taken_before_the_guard_ends),
        cmocka_unit_test(the_state_may_be_as_old_as_the_lag),
        cmocka_unit_test(any_lag_means_any_lag),
        cmocka_unit_test(a_second_controller_waits_for_the_lease_to_end),
        cmocka_unit_test(a_lease_that_nobody_held_is_free),
        cmocka_unit_test(a_command_is_taken_once_and_in_order),
        cmocka_unit_test(missed_numbers_add_up),
        cmocka_unit_test(verdicts_come_in_their_order),
        cmocka_unit_test(a_stale_command_cannot_take_a_free_lease),
        cmocka_unit_test(every_failure_has_a_reason),
        cmocka_unit_test(refusals_are_counted_by_reason),
    };
    return cmocka_run_group_tests_name("gate", tests, NULL, NULL);
}
