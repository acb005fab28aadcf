// SPDX-License-Identifier: BSD-3-Clause
// Stuck: whether the tip has ceased to come nearer to its goal while it is still far from it.
//
// Units    metres; ns where a name says so.
// Frames   none.
// Arrays   none.
// Memory   plain data.
// Errors   none.
#ifndef LW_CONTROLLER_STUCK_H
#define LW_CONTROLLER_STUCK_H

#include <stdbool.h> // bool
#include <stdint.h>  // int64_t

enum { LW_STUCK_SAMPLES = 101 };

struct lw_stuck {
    int64_t ticks;                      // since it began to watch
    int count;                          // samples taken, up to LW_STUCK_SAMPLES
    double deviation[LW_STUCK_SAMPLES]; // m, a ring
    int64_t since_ns;                   // tick's time; 0 = not stuck
};

// Forgets what it has seen: a new goal, or the arm was braked.
void lw_stuck_reset(struct lw_stuck *stuck);

// Takes the deviation of one tick. Stuck means: farther than `tolerance` from the goal, and over the last 0.8 s the
// deviation stayed within a band of 1 cm. Slow motion is not told apart from rest: below 12.5 mm/s counts as stuck.
//   period_ns  in  of the tick; samples are 8 ms apart, or one a tick where that is longer
//   time_ns    in  the tick's time, > 0 once motion has begun
// Returns whether it is stuck. Cost: fixed, every 8 ms a pass over 101 numbers.
bool lw_stuck_note(struct lw_stuck *stuck, double deviation, double tolerance, int64_t period_ns, int64_t time_ns);

#endif
