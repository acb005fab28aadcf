// SPDX-License-Identifier: BSD-3-Clause
// Clocks, and a number that tells one process start from every other.
//
// Units    ns unless a name says us.
// Frames   none.
// Arrays   none.
// Memory   none.
// Errors   none.
#ifndef LW_BASE_CLOCK_H
#define LW_BASE_CLOCK_H

#include <stdint.h> // int64_t

#define LW_NS_PER_S INT64_C(1000000000)

// CLOCK_MONOTONIC now. Cost: one vDSO call.
int64_t lw_clock_mono_ns(void);

// Wall clock now, us since the Unix epoch.
int64_t lw_clock_utime(void);

// Sleeps until CLOCK_MONOTONIC reaches deadline_ns; goes on sleeping when a signal interrupts.
void lw_clock_sleep_until(int64_t deadline_ns);

// Random number > 0 from the kernel, to tell this process from every other.
int64_t lw_clock_session(void);

#endif
