// SPDX-License-Identifier: BSD-3-Clause
// Guard: the last word on every command. Knows limits, not laws.
//
// Units    radians, seconds.
// Frames   none.
// Arrays   one entry a joint, base to wrist 3.
// Memory   nothing is kept or allocated.
// Errors   none; what it did is returned as flags.
#ifndef LW_CONTROLLER_GUARD_H
#define LW_CONTROLLER_GUARD_H

#include "scene/scene.h" // struct lw_limits, LW_NJ

struct lw_guard_input {
    const struct lw_limits *limits; // infinite entries are off
    double period_s;                // s, length of the tick
    const double *q;                // [6] rad, configuration
    const double *velocity;         // [6] rad/s, command in force; finite
    const double *wish;             // [6] rad/s, any values
};

// Turns a wish into a command that keeps all limits and is as fast as they allow:
//   1 finite     a wish or configuration that is no number becomes "brake to rest"
//   2 position   each joint may be only so fast that it can still stop before the end of its range
//   3 velocity   the whole vector is scaled, so the direction stays
//   4 acceleration  the step from `velocity` to the wish is scaled as a whole; a joint that must brake for
//                its range goes first
//   command  out  [6] rad/s, finite
// Returns the set of enum lw_flag that shaped the command. Cost: fixed.
unsigned lw_guard_shape(const struct lw_guard_input *in, double command[LW_NJ]);

// The first three of these: the wish within position and velocity limits, whatever the velocity in force.
//   target  out  [6] rad/s, finite; may be in->wish
unsigned lw_guard_wish(const struct lw_guard_input *in, double target[LW_NJ]);

// Fastest velocity (rad/s) from which a joint can come to rest within `room` (rad) when each tick moves it by
// velocity * period_s and may lower the velocity by acceleration * period_s.
double lw_guard_braking_velocity(double room, double acceleration, double period_s);

#endif
