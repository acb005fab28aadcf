// SPDX-License-Identifier: BSD-3-Clause
// Guard: finite, position, velocity, acceleration, in this order.
//
// Units    radians, seconds.
// Frames   none.
// Arrays   one entry a joint.
// Memory   none.
// Errors   none.
#include "controller/guard.h"

#include "arm/joint.h" // enum lw_flag
#include "base/vec.h"  // lw_all_finite

#include <math.h>    // fabs, floor, sqrt
#include <stdbool.h> // bool
#include <string.h>  // memcpy

// Of finite numbers and inf; the library's fmin and fmax, which heed NaN, are calls.
static double lesser(double a, double b)
{
    return a < b ? a : b;
}

static double greater(double a, double b)
{
    return a > b ? a : b;
}

double lw_guard_braking_velocity(double room, double acceleration, double period_s)
{
    if (room <= 0)
        return 0;
    if (isinf(acceleration) || isinf(room))
        return room / period_s;
    // Braking from v takes k more ticks after this one and the way T ((k+1) v - k(k+1)/2 aT).
    const double step = acceleration * period_s;
    const double k = floor((sqrt(1 + 8 * room / (step * period_s)) - 1) / 2);
    return (room / period_s + step * k * (k + 1) / 2) / (k + 1);
}

// Largest part of the way from 0 to `way` that keeps within `limit`.
static double part_within(double way, double limit)
{
    return fabs(way) > limit ? limit / fabs(way) : 1.0;
}

// Range of velocities of each joint from which its position range can still be kept; any where nobody knows the
// positions.
static void position_bounds(const struct lw_guard_input *in, double low[LW_NJ], double high[LW_NJ])
{
    const struct lw_limits *limits = in->limits;
    const bool known = lw_all_finite(in->q, LW_NJ);
    for (int j = 0; j < LW_NJ; j++) {
        const double a = limits->acceleration[j], q = in->q[j];
        low[j] = known ? -lw_guard_braking_velocity(q - limits->position_min[j], a, in->period_s) : -HUGE_VAL;
        high[j] = known ? lw_guard_braking_velocity(limits->position_max[j] - q, a, in->period_s) : HUGE_VAL;
    }
}

// Clamps each joint; returns whether any was changed.
static bool clamp_each(const double low[LW_NJ], const double high[LW_NJ], double value[LW_NJ])
{
    bool changed = false;
    for (int j = 0; j < LW_NJ; j++) {
        const double clamped = greater(low[j], lesser(high[j], value[j]));
        changed |= clamped != value[j];
        value[j] = clamped;
    }
    return changed;
}

// Scales the whole vector into the velocity limits; returns whether it had to.
static bool limit_velocity(const struct lw_limits *limits, double target[LW_NJ])
{
    double scale = 1;
    for (int j = 0; j < LW_NJ; j++)
        scale = lesser(scale, part_within(target[j], limits->velocity[j]));
    for (int j = 0; scale < 1 && j < LW_NJ; j++)
        target[j] *= scale;
    return scale < 1;
}

// Goes from velocity towards target as far as the accelerations allow, in a straight line; returns whether short of it.
static bool limit_acceleration(const struct lw_limits *limits, double period_s, const double velocity[LW_NJ],
                               double target[LW_NJ])
{
    double scale = 1;
    for (int j = 0; j < LW_NJ; j++)
        scale = lesser(scale, part_within(target[j] - velocity[j], limits->acceleration[j] * period_s));
    for (int j = 0; scale < 1 && j < LW_NJ; j++)
        target[j] = velocity[j] + scale * (target[j] - velocity[j]);
    return scale < 1;
}

// Range of a joint's next velocity: its position bounds where its acceleration can keep them, else as near as it can.
static void reachable_bounds(const struct lw_limits *limits, double period_s, const double velocity[LW_NJ],
                             double low[LW_NJ], double high[LW_NJ])
{
    for (int j = 0; j < LW_NJ; j++) {
        const double step = limits->acceleration[j] * period_s;
        low[j] = lesser(low[j], velocity[j] + step);
        high[j] = greater(high[j], velocity[j] - step);
    }
}

// The wish within position and velocity limits; low and high are the former. Returns flags.
static unsigned shape_wish(const struct lw_guard_input *in, double low[LW_NJ], double high[LW_NJ], double target[LW_NJ])
{
    // Finite first: a NaN that reaches a min or max becomes full speed.
    const bool finite = lw_all_finite(in->q, LW_NJ) && lw_all_finite(in->wish, LW_NJ);
    unsigned flags = finite ? 0u : LW_NOT_FINITE;
    for (int j = 0; j < LW_NJ; j++)
        target[j] = finite ? in->wish[j] : 0.0;

    // Position, then velocity: both shape the wish itself.
    position_bounds(in, low, high);
    if (clamp_each(low, high, target))
        flags |= LW_LIMIT_POSITION;
    if (limit_velocity(in->limits, target))
        flags |= LW_LIMIT_VELOCITY;
    return flags;
}

unsigned lw_guard_wish(const struct lw_guard_input *in, double target[LW_NJ])
{
    double low[LW_NJ], high[LW_NJ];
    return shape_wish(in, low, high, target);
}

unsigned lw_guard_shape(const struct lw_guard_input *in, double command[LW_NJ])
{
    const struct lw_limits *limits = in->limits;
    double target[LW_NJ], low[LW_NJ], high[LW_NJ];
    unsigned flags = shape_wish(in, low, high, target);

    // Acceleration; where the common scale brakes a joint too little for its range, that joint goes first.
    if (limit_acceleration(limits, in->period_s, in->velocity, target))
        flags |= LW_LIMIT_ACCELERATION;
    reachable_bounds(limits, in->period_s, in->velocity, low, high);
    if (clamp_each(low, high, target))
        flags |= LW_LIMIT_POSITION;
    memcpy(command, target, sizeof target);
    return flags;
}
