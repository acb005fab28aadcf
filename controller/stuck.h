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

// The tick that asks.
struct lw_stuck_tick {
    int64_t number;    // 1, 2, 3 ...
    int64_t period_ns; // from one to the next
    int64_t time_ns;   // > 0 once motion has begun
};

struct lw_stuck {
    int count;                          // samples taken, up to LW_STUCK_SAMPLES
    double deviation[LW_STUCK_SAMPLES]; // m, a ring
    int64_t since_ns;                   // tick's time; 0 = not stuck
};

// Forgets what it has seen: a new goal, or the arm was braked.
void lw_stuck_reset(struct lw_stuck *stuck);

// Takes the deviation of one tick. Stuck means: farther than `tolerance` from the goal, and over the last 0.8 s the
// deviation stayed within a band of 1 cm. Slow motion is not told apart from rest: below 12.5 mm/s counts as stuck.
//   at  in  the tick; samples are 8 ms apart, at the same ticks whenever it began to watch, or one a tick where that is
//           longer
// Returns whether it is stuck. Cost: fixed, every 8 ms a pass over 101 numbers.
bool lw_stuck_note(struct lw_stuck *stuck, double deviation, double tolerance, const struct lw_stuck_tick *at);

#endif
