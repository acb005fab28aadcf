// SPDX-License-Identifier: BSD-3-Clause
// Periodic: a fixed-rate loop on absolute deadlines. A loop that is late skips periods and counts them; it never
// bursts.
//
// Units    ns.
// Frames   none.
// Arrays   none.
// Memory   plain data, one thread.
// Errors   none.
#ifndef LW_BASE_PERIODIC_H
#define LW_BASE_PERIODIC_H

#include <stdint.h> // int64_t

struct lw_periodic {
    int64_t period_ns;
    int64_t deadline_ns; // next wake-up, CLOCK_MONOTONIC
    int64_t wake_ns;     // last wake-up
    int64_t skipped;     // periods skipped so far
};

// First wake-up at first_ns.
struct lw_periodic lw_periodic_start(int64_t first_ns, int64_t period_ns);

// Sleeps to the next deadline still ahead. Returns how late it woke, ns.
int64_t lw_periodic_wait(struct lw_periodic *loop);

// Moves deadlines that have passed at now_ns to the next one ahead and counts them.
void lw_periodic_skip(struct lw_periodic *loop, int64_t now_ns);

#endif
