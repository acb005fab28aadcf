// SPDX-License-Identifier: BSD-3-Clause
// Tests of the wire: what a program says of itself, on STATUS and PLANT_STATUS. test_wire.c and test_wire_hostile.c
// test what these channels have in common with all others.
//
// Units    those of lcmtypes/status_t.lcm.
// Frames   none.
// Arrays   see bus/report.h.
// Memory   stack.
// Errors   cmocka's.
#include "bus/wire.h"
#include "helpers.h"
#include "wire_messages.h" // make, decode

#include <leeway_status_t.h> // constants, and fields by their names in a log

// States, faults, what the system granted and reasons of refusal are the same numbers in the structs and on the wire.
static void constants_are_those_of_the_wire(void **state)
{
    (void)state;
    assert_int_equal(LW_STARTING, LEEWAY_STATUS_T_STARTING);
    assert_int_equal(LW_RUN_WAITING, LEEWAY_STATUS_T_WAITING);
    assert_int_equal(LW_RUNNING, LEEWAY_STATUS_T_RUNNING);
    assert_int_equal(LW_STOPPING, LEEWAY_STATUS_T_STOPPING);
    assert_int_equal(LW_ENDING, LEEWAY_STATUS_T_ENDING);
    assert_int_equal(LW_FAULT_PEER_TIMEOUT, LEEWAY_STATUS_T_PEER_TIMEOUT);
    assert_int_equal(LW_FAULT_OVERRUN, LEEWAY_STATUS_T_OVERRUN);
    assert_int_equal(LW_FAULT_BAD_INPUT, LEEWAY_STATUS_T_BAD_INPUT);
    assert_int_equal(LW_FAULT_LEASE, LEEWAY_STATUS_T_LEASE);
    assert_int_equal(LW_FAULT_UNSENT, LEEWAY_STATUS_T_UNSENT);
    assert_int_equal(LW_FAULT_LOST_RECORDS, LEEWAY_STATUS_T_LOST_RECORDS);
    assert_int_equal(LW_RT_FIFO, LEEWAY_STATUS_T_FIFO);
    assert_int_equal(LW_RT_LOCKED, LEEWAY_STATUS_T_LOCKED);
    assert_int_equal(LW_RT_AWAKE, LEEWAY_STATUS_T_AWAKE);
    assert_int_equal(LW_RT_PINNED, LEEWAY_STATUS_T_PINNED);
    assert_int_equal(LW_REFUSED_SIZE, LEEWAY_STATUS_T_SIZE);
    assert_int_equal(LW_REFUSED_TYPE, LEEWAY_STATUS_T_TYPE);
    assert_int_equal(LW_REFUSED_NO_NUMBER, LEEWAY_STATUS_T_NO_NUMBER);
    assert_int_equal(LW_REFUSED_RANGE, LEEWAY_STATUS_T_RANGE);
    assert_int_equal(LW_REFUSED_DUPLICATE, LEEWAY_STATUS_T_DUPLICATE);
    assert_int_equal(LW_REFUSED_BACKWARDS, LEEWAY_STATUS_T_BACKWARDS);
    assert_int_equal(LW_REFUSED_FOREIGN, LEEWAY_STATUS_T_FOREIGN);
    assert_int_equal(LW_REFUSED_OTHER_PLANT, LEEWAY_STATUS_T_OTHER_PLANT);
    assert_int_equal(LW_REFUSED_STALE, LEEWAY_STATUS_T_STALE);
    assert_int_equal(LW_REFUSED_GUARD, LEEWAY_STATUS_T_GUARD);
    assert_int_equal(LW_REFUSED_IDLE, LEEWAY_STATUS_T_IDLE);
    assert_int_equal(LW_REFUSED_FULL, LEEWAY_STATUS_T_FULL);
    assert_int_equal(LW_REFUSED_UNKNOWN, LEEWAY_STATUS_T_UNKNOWN);
    assert_int_equal(LW_REFUSED_COUNT, LEEWAY_STATUS_T_UNKNOWN + 1);
    assert_true(LW_REFUSED_COUNT <= LEEWAY_STATUS_T_NREASONS);
    assert_int_equal(LW_PERCENTILES, LEEWAY_STATUS_T_NPERCENTILES);
}

// Every number arrives under its own name, in the log and in the struct.
static void the_fields_keep_their_places(void **state)
{
    (void)state;
    const union lw_message m = {.report = {.stamp = {1, 2, 3, 4},
                                           .state = LW_STOPPING,
                                           .faults = 5,
                                           .faults_ever = 7,
                                           .realtime = 6,
                                           .period_ns = 8,
                                           .ticks = 9,
                                           .skipped = 10,
                                           .stale_ticks = 11,
                                           .unsent = 12,
                                           .peer_session = 13,
                                           .taken = 14,
                                           .missed = 15,
                                           .takeovers = 16,
                                           .refused = {21, 22, 23, 24, 25, 26, 27, 28, 29, 30, 31, 32, 33},
                                           .wake_late_ns = {41, 42, 43, 44},
                                           .exec_ns = {45, 46, 47, 48},
                                           .age_ns = {49, 50, 51, 52},
                                           .minor_faults = 17,
                                           .major_faults = 18,
                                           .allocations = 19,
                                           .clearance = -20.5,
                                           .deviation = 20.25,
                                           .stuck_since_ns = 53,
                                           .obstacle_count = 54,
                                           .world_age_ns = 55}};
    const struct lw_report *r = &m.report;
    for (int c = LW_CHANNEL_STATUS; c <= LW_CHANNEL_PLANT_STATUS; c++) {
        unsigned char data[LW_WIRE_MAX];
        union lw_message out;
        leeway_status_t w;
        const uint32_t size = lw_wire_encode((enum lw_channel)c, &m, data);
        assert_int_equal(leeway_status_t_decode(data, 0, (int)size, &w), size);
        const int64_t counts[] = {w.h.utime,        w.h.mono_ns,      w.h.session,    w.h.seq,        w.state,
                                  w.faults,         w.faults_ever,    w.realtime,     w.period_ns,    w.ticks,
                                  w.skipped,        w.stale_ticks,    w.unsent,       w.peer_session, w.taken,
                                  w.missed,         w.takeovers,      w.minor_faults, w.major_faults, w.allocations,
                                  w.stuck_since_ns, w.obstacle_count, w.world_age_ns};
        const int64_t expected[] = {1, 2, 3, 4, 3, 5, 7, 6, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 53, 54, 55};
        assert_same_bits(counts, expected, sizeof expected);
        assert_same_bits(w.refused, r->refused, sizeof r->refused);
        for (int i = LW_REFUSED_COUNT; i < LEEWAY_STATUS_T_NREASONS; i++)
            assert_int_equal(w.refused[i], 0);
        assert_same_bits(w.wake_late_ns, r->wake_late_ns, sizeof w.wake_late_ns);
        assert_same_bits(w.exec_ns, r->exec_ns, sizeof w.exec_ns);
        assert_same_bits(w.age_ns, r->age_ns, sizeof w.age_ns);
        assert_near(w.clearance, -20.5, 0);
        assert_near(w.deviation, 20.25, 0);
        assert_int_equal(decode((enum lw_channel)c, data, size, &out), LW_OK);
        assert_same_bits(&out.report, r, sizeof *r);
    }
}

// Every count: below its least value it is refused, from there on taken.
static void every_count_is_checked(void **state)
{
    (void)state;
    struct random random = {90};
    union lw_message m = make(&random, LW_CHANNEL_STATUS);
    struct lw_report *r = &m.report;
    struct {
        int64_t *place, least;
    } counts[14 + LW_REFUSED_COUNT] = {{&r->ticks, 0},          {&r->skipped, 0},      {&r->stale_ticks, 0},
                                       {&r->unsent, 0},         {&r->peer_session, 0}, {&r->taken, 0},
                                       {&r->missed, 0},         {&r->takeovers, 0},    {&r->minor_faults, 0},
                                       {&r->major_faults, 0},   {&r->allocations, -1}, {&r->period_ns, 1},
                                       {&r->stuck_since_ns, 0}, {&r->world_age_ns, -1}};
    for (int i = 0; i < LW_REFUSED_COUNT; i++)
        counts[14 + i].place = &r->refused[i];
    for (size_t i = 0; i < sizeof counts / sizeof counts[0]; i++) {
        const int64_t before = *counts[i].place;
        *counts[i].place = counts[i].least - 1;
        check_message(LW_CHANNEL_STATUS, &m, LW_E_ARGUMENT);
        check_message(LW_CHANNEL_PLANT_STATUS, &m, LW_E_ARGUMENT);
        *counts[i].place = INT64_MIN;
        check_message(LW_CHANNEL_STATUS, &m, LW_E_ARGUMENT);
        *counts[i].place = counts[i].least;
        check_message(LW_CHANNEL_STATUS, &m, LW_OK);
        *counts[i].place = before;
    }
    r->period_ns = 1000000001; // nobody is slower than 1 Hz
    check_message(LW_CHANNEL_STATUS, &m, LW_E_ARGUMENT);
}

// A clearance may be anything but no number, and infinite where there is no obstacle; a deviation is finite.
static void distances_are_numbers(void **state)
{
    (void)state;
    struct random random = {91};
    const double no_number[] = {NO_NUMBER, -NO_NUMBER, -HUGE_VAL, HUGE_VAL};
    union lw_message m = make(&random, LW_CHANNEL_STATUS);
    for (int i = 0; i < 4; i++) {
        const bool is_none = no_number[i] == HUGE_VAL;
        m.report.clearance = no_number[i];
        check_message(LW_CHANNEL_STATUS, &m, is_none ? LW_OK : LW_E_NOT_FINITE);
        check_message(LW_CHANNEL_PLANT_STATUS, &m, is_none ? LW_OK : LW_E_NOT_FINITE);
        m.report.clearance = i % 2 ? -1.7e308 : 1.7e308;
        m.report.deviation = no_number[i];
        check_message(LW_CHANNEL_STATUS, &m, LW_E_NOT_FINITE);
        m.report.deviation = i % 2 ? -1.7e308 : 1.7e308;
        check_message(LW_CHANNEL_STATUS, &m, LW_OK);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(constants_are_those_of_the_wire),
        cmocka_unit_test(the_fields_keep_their_places),
        cmocka_unit_test(every_count_is_checked),
        cmocka_unit_test(distances_are_numbers),
    };
    return cmocka_run_group_tests_name("wire_status", tests, NULL, NULL);
}
