// SPDX-License-Identifier: BSD-3-Clause
// Phase lock: keeps a loop's deadlines half a period behind the messages of another periodic sender, so that two
// clocks of nearly equal rate never coincide.
//
// Units    ns of CLOCK_MONOTONIC.
// Frames   none.
// Arrays   none.
// Memory   plain data, one thread.
// Errors   none.
#ifndef LW_BASE_PHASE_H
#define LW_BASE_PHASE_H

#include <stdbool.h> // bool
#include <stdint.h>  // int64_t

enum { LW_PHASE_SAMPLES = 5 };

struct lw_phase {
    int64_t error_ns[LW_PHASE_SAMPLES]; // newest errors, ring
    int count;                          // of errors so far, up to LW_PHASE_SAMPLES
    int next;
};

// Correction to add to the next deadline, after a message came.
//   deadline_ns  in  next deadline
//   arrival_ns   in  when the message came
//   period_ns    in  of the sender
//   jump         in  true while nothing depends on even periods: the whole error is taken at once, forward; false: at
//                    most 1 % of a period a call, so that the loop stays even
// The median of five errors counts: one late message moves nothing.
int64_t lw_phase_correct(struct lw_phase *phase, int64_t deadline_ns, int64_t arrival_ns, int64_t period_ns, bool jump);

#endif
