// SPDX-License-Identifier: BSD-3-Clause
// Tests of the health of a loop: faults show for a second and stay among those ever seen.
//
// Units    ns.
// Frames   none.
// Arrays   records in the order of their ticks.
// Memory   static; what the module allocates is given back.
// Errors   cmocka's.
#include "health_rig.h" // tick, report

// Shows now, for a second, and never after; but it stays among those ever seen.
static void check_shows_for_a_second(struct rig *rig, unsigned fault, unsigned ever)
{
    struct lw_report r = report(rig);
    assert_int_equal(r.faults, fault);
    assert_int_equal(r.faults_ever, ever | fault);
    tick_for(rig, RATE - 1);
    assert_int_equal(report(rig).faults, fault);
    tick_for(rig, 1);
    r = report(rig);
    assert_int_equal(r.faults, 0);
    assert_int_equal(r.faults_ever, ever | fault);
}

// One tick with a fault of its own, not sent, or behind a skipped period.
static void faults_of_a_tick_show_for_a_second(void **state)
{
    (void)state;
    struct rig *rig = start();
    tick_for(rig, 10);
    assert_int_equal(report(rig).faults_ever, 0);
    rig->record.faults = LW_FAULT_PEER_TIMEOUT;
    tick(rig);
    rig->record.faults = 0;
    check_shows_for_a_second(rig, LW_FAULT_PEER_TIMEOUT, 0);
    rig->record.sent = false;
    tick(rig);
    rig->record.sent = true;
    check_shows_for_a_second(rig, LW_FAULT_UNSENT, LW_FAULT_PEER_TIMEOUT);
    rig->record.skipped++;
    tick(rig);
    check_shows_for_a_second(rig, LW_FAULT_OVERRUN, LW_FAULT_PEER_TIMEOUT | LW_FAULT_UNSENT);
    finish(rig);
}

// Of all reasons to refuse a message four are bad input, and one another controller.
static void refusals_show_for_a_second(void **state)
{
    (void)state;
    for (int reason = 0; reason < LW_REFUSED_COUNT; reason++) {
        struct rig *rig = start();
        tick_for(rig, 10);
        (void)report(rig);
        (void)lw_refusals_note(&rig->refusals, (enum lw_verdict)reason);
        if (reason <= LW_REFUSED_RANGE)
            check_shows_for_a_second(rig, LW_FAULT_BAD_INPUT, 0);
        else if (reason == LW_REFUSED_FOREIGN)
            check_shows_for_a_second(rig, LW_FAULT_LEASE, 0);
        else
            assert_int_equal(report(rig).faults_ever, 0);
        finish(rig);
    }
}

// While a counter grows its fault goes on.
static void a_fault_that_goes_on_shows_on(void **state)
{
    (void)state;
    struct rig *rig = start();
    for (int k = 0; k < 3 * RATE; k++) {
        if (k % 50 == 0) {
            (void)lw_refusals_note(&rig->refusals, LW_REFUSED_SIZE);
            assert_int_equal(report(rig).faults, LW_FAULT_BAD_INPUT);
        }
        tick(rig);
    }
    finish(rig);
}

// What happens in the warm-up is no fault, and the first tick behind it has none before it to compare with.
static void the_warm_up_has_no_faults(void **state)
{
    (void)state;
    struct rig *rig = start();
    rig->record.warm = rig->record.sent = false;
    rig->record.faults = LW_FAULT_PEER_TIMEOUT;
    for (int k = 0; k < 20; k++) {
        rig->record.skipped++;
        tick(rig);
    }
    assert_int_equal(report(rig).faults_ever, 0);
    rig->record = (struct lw_record){.time_ns = rig->record.time_ns, .sent = true, .warm = true, .skipped = 25};
    tick_for(rig, 3);
    const struct lw_report r = report(rig);
    assert_int_equal(r.faults_ever, 0);
    assert_int_equal(r.skipped, 5);
    finish(rig);
}

// A normal thread that cannot follow: the newest records are lost and the report says so.
static void lost_records_are_a_fault(void **state)
{
    (void)state;
    struct rig *rig = start();
    enum { MANY = 5 * RATE };
    for (int k = 0; k < MANY; k++, rig->record.time_ns += period)
        lw_health_note(&rig->health, &rig->record);
    assert_non_null(lw_health_collect(&rig->health));
    const struct lw_report r = report(rig);
    assert_int_equal(r.faults, LW_FAULT_LOST_RECORDS);
    assert_true(r.ticks >= RATE && r.ticks < MANY); // a second is kept at least
    assert_int_equal(r.ticks + (int64_t)atomic_load(&rig->health.ring.lost), MANY);
    rig->record.time_ns = lw_health_past(&rig->health, 0)->time_ns + period;
    check_shows_for_a_second(rig, LW_FAULT_LOST_RECORDS, 0);
    finish(rig);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(faults_of_a_tick_show_for_a_second), cmocka_unit_test(refusals_show_for_a_second),
        cmocka_unit_test(a_fault_that_goes_on_shows_on),      cmocka_unit_test(the_warm_up_has_no_faults),
        cmocka_unit_test(lost_records_are_a_fault),
    };
    return cmocka_run_group_tests_name("health_faults", tests, NULL, NULL);
}
