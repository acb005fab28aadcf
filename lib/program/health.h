// SPDX-License-Identifier: BSD-3-Clause
// Health: what the real-time loop did, tick by tick, handed to a normal thread that makes statistics of it.
//
// Units    ns; us for the bins of histograms.
// Frames   none.
// Arrays   see below.
// Memory   lw_health_init allocates; note and record do not.
// Errors   a tick that the normal thread could not follow is counted as lost.
#ifndef LW_PROGRAM_HEALTH_H
#define LW_PROGRAM_HEALTH_H

#include "arm/joint.h"    // struct lw_joint_state, struct lw_joint_command
#include "base/ring.h"    // struct lw_ring
#include "bus/gate.h"     // struct lw_lease
#include "base/refusal.h" // struct lw_refusals
#include "bus/report.h"   // struct lw_report

#include <stdatomic.h> // atomic_int_fast64_t
#include <stdbool.h>   // bool
#include <stdio.h>     // FILE

enum { LW_HISTOGRAM_BINS = 20000 }; // of 1 us

// One tick, from the real-time thread.
struct lw_record {
    int64_t time_ns; // wake-up, CLOCK_MONOTONIC
    int64_t wake_late_ns;
    int64_t exec_ns;
    int64_t age_ns;  // of the other side's newest message, 0 = not expected
    bool expected;   // the other side has been heard and has not taken its leave: its silence counts
    int64_t skipped; // periods, since start
    bool fresh;      // a message came since the tick before
    bool sent;
    bool warm;       // the warm-up is over
    unsigned faults; // set of enum lw_fault that the program itself knows of
    struct lw_lease lease;
    struct lw_joint_state state;
    struct lw_joint_command command;
};

struct lw_histogram {
    int64_t bin[LW_HISTOGRAM_BINS];
    int64_t over, max_ns;
};

// A count whose growth is a fault.
struct lw_counter {
    int64_t before;   // at the last report
    int64_t until_ns; // the fault shows, time of records
};

struct lw_health {
    // real-time thread -> normal thread
    struct lw_ring ring;
    atomic_int_fast64_t minor_faults, major_faults;
    // real-time thread
    int64_t first_minor, first_major; // page faults before the end of the warm-up
    bool warm;
    // normal thread
    struct lw_record *past; // ring of the last LW_HEALTH_PAST_S seconds
    int capacity, count, next;
    int64_t *sorted; // room for one second of values
    int64_t period_ns;
    int64_t ticks, stale_ticks, unsent, first_skipped;
    struct lw_counter bad, foreign, lost; // messages refused, records
    unsigned faults_ever;
    struct lw_histogram wake, exec, age;
};

enum { LW_HEALTH_PAST_S = 2 };

// False when there is no memory; lw_health_free is due in both cases.
bool lw_health_init(struct lw_health *health, int64_t period_ns);
void lw_health_free(struct lw_health *health);

// Real-time thread, once a tick: hands a record over. With the first record that is warm it starts to watch this
// thread's allocations and page faults. Cost: one copy; a system call 20 times a second.
void lw_health_note(struct lw_health *health, const struct lw_record *record);

// Real-time thread, after its last tick: the system's own clean-up of the thread does not count.
void lw_health_end(struct lw_health *health);

// Normal thread: takes what came. Returns the newest record, NULL before the first.
const struct lw_record *lw_health_collect(struct lw_health *health);

// Normal thread: the record `back` ticks before the newest, NULL when there is none.
const struct lw_record *lw_health_past(const struct lw_health *health, int back);

// Normal thread: fills in period, counts, percentiles of the last second, and the faults that records show.
void lw_health_report(struct lw_health *health, const struct lw_refusals *refusals, struct lw_report *report);

// Writes all statistics since the warm-up as JSON, histograms included.
void lw_health_write(const struct lw_health *health, const char *program, unsigned realtime, FILE *to);

#endif
