// SPDX-License-Identifier: BSD-3-Clause
// Report: how a program fares (lcmtypes/status_t.lcm says what each field means).
//
// Units    ns, m.
// Frames   none.
// Arrays   percentiles p50, p99, p99.9, max.
// Memory   plain data, copied by value.
// Errors   none.
#ifndef LW_BUS_REPORT_H
#define LW_BUS_REPORT_H

#include "base/verdict.h" // LW_REFUSED_COUNT
#include "base/stamp.h"   // struct lw_stamp

enum lw_run_state { LW_STARTING, LW_RUN_WAITING, LW_RUNNING, LW_STOPPING, LW_ENDING };

enum lw_fault {
    LW_FAULT_PEER_TIMEOUT = 1,
    LW_FAULT_OVERRUN = 2,
    LW_FAULT_BAD_INPUT = 4,
    LW_FAULT_LEASE = 8,
    LW_FAULT_UNSENT = 16,
    LW_FAULT_LOST_RECORDS = 32,
};

enum lw_realtime { LW_RT_FIFO = 1, LW_RT_LOCKED = 2, LW_RT_AWAKE = 4, LW_RT_PINNED = 8 };

enum { LW_PERCENTILES = 4 };

struct lw_report {
    struct lw_stamp stamp;
    enum lw_run_state state;
    unsigned faults, faults_ever; // sets of enum lw_fault
    unsigned realtime;            // set of enum lw_realtime
    int64_t period_ns;
    int64_t ticks, skipped, stale_ticks, unsent;
    int64_t peer_session, taken, missed, takeovers;
    int64_t refused[LW_REFUSED_COUNT];
    int64_t wake_late_ns[LW_PERCENTILES], exec_ns[LW_PERCENTILES], age_ns[LW_PERCENTILES];
    int64_t minor_faults, major_faults, allocations;
    double clearance;       // m, infinite = no obstacle
    double deviation;       // m
    int64_t stuck_since_ns; // 0 = not stuck
    int64_t obstacle_count;
    int64_t world_age_ns; // -1 = nothing heard of obstacles
};

#endif
