// SPDX-License-Identifier: BSD-3-Clause
// What the guard has to answer, stated as "the largest part that keeps the limit" and found by bisection: no formula
// of the guard is used here.
//
// Units    radians, seconds.
// Frames   none.
// Arrays   one entry a joint.
// Memory   none.
// Errors   none.
#ifndef LW_TESTS_GUARD_ORACLE_H
#define LW_TESTS_GUARD_ORACLE_H

#include "arm/joint.h"   // enum lw_flag
#include "base/vec.h"    // lw_all_finite
#include "scene/scene.h" // struct lw_limits

// Where a joint is, what it does, what it may.
struct oracle_state {
    const struct lw_limits *limits;
    double period_s;
    const double *q, *velocity, *wish;
};

struct oracle_answer {
    double command[LW_NJ];
    unsigned flags;    // that have to be up
    unsigned marginal; // so near to their limit that rounding may decide
};

// Way (rad) that a joint still moves when it goes on with v for one tick and brakes in every tick after it.
static inline double oracle_braking_way(double v, double acceleration, double period_s)
{
    const double step = acceleration * period_s;
    const double ticks = isinf(step) ? 0 : floor(v / step);
    const double lost = ticks > 0 ? step * ticks * (ticks + 1) / 2 : 0;
    return period_s * ((ticks + 1) * v - lost);
}

// Largest v >= 0 whose braking way fits into the room.
static inline double oracle_braking_velocity(double room, double acceleration, double period_s)
{
    double low = 0, high = 2 * fmax(room, 0) / period_s;
    for (int i = 0; i < 200 && low < high; i++) {
        const double middle = low + (high - low) / 2;
        if (oracle_braking_way(middle, acceleration, period_s) > fmax(room, 0))
            high = middle;
        else if (middle > low)
            low = middle;
        else
            break;
    }
    return low;
}

// Largest s in [0, 1] with |s * way| within each limit.
static inline double oracle_part(const double way[LW_NJ], const double limit[LW_NJ])
{
    double low = 0, high = 1;
    for (int i = 0; i < 200; i++) {
        const double middle = i == 0 ? 1 : low + (high - low) / 2;
        bool fits = true;
        for (int j = 0; j < LW_NJ; j++)
            fits = fits && fabs(middle * way[j]) <= limit[j];
        if (fits && middle == 1)
            return 1;
        if (middle == low || (middle == high && i > 0))
            break;
        *(fits ? &low : &high) = middle;
    }
    return low;
}

static inline double oracle_nearest(double value, double low, double high)
{
    return value < low ? low : value > high ? high : value;
}

// Ranges of velocity that leave each joint able to stop in its range.
static inline void oracle_bounds(const struct oracle_state *s, double low[LW_NJ], double high[LW_NJ])
{
    for (int j = 0; j < LW_NJ; j++) {
        const double a = s->limits->acceleration[j];
        low[j] = -oracle_braking_velocity(s->q[j] - s->limits->position_min[j], a, s->period_s);
        high[j] = oracle_braking_velocity(s->limits->position_max[j] - s->q[j], a, s->period_s);
    }
}

static inline void oracle_raise(struct oracle_answer *answer, unsigned flag, double excess)
{
    if (excess > 1e-9)
        answer->flags |= flag;
    else if (excess > -1e-9)
        answer->marginal |= flag;
}

// The one command that is as fast as the limits allow, in the order of guard.h.
static inline struct oracle_answer oracle_answer(const struct oracle_state *s)
{
    struct oracle_answer answer = {{0}, 0, 0};
    double low[LW_NJ], high[LW_NJ], target[LW_NJ], way[LW_NJ], reach[LW_NJ];
    const bool known = lw_all_finite(s->q, LW_NJ), wished = known && lw_all_finite(s->wish, LW_NJ);
    answer.flags |= wished ? 0u : (unsigned)LW_NOT_FINITE;
    if (known)
        oracle_bounds(s, low, high);

    // As much of the wish as each joint can stop from, then as much of all of it as the speed limits allow.
    for (int j = 0; j < LW_NJ; j++) {
        const double wish = wished ? s->wish[j] : 0;
        target[j] = known ? oracle_nearest(wish, low[j], high[j]) : wish;
        if (wished)
            oracle_raise(&answer, LW_LIMIT_POSITION, fmax(wish - high[j], low[j] - wish));
    }
    const double speed = oracle_part(target, s->limits->velocity);
    for (int j = 0; j < LW_NJ; j++) {
        oracle_raise(&answer, LW_LIMIT_VELOCITY, fabs(target[j]) - s->limits->velocity[j]);
        target[j] *= speed;
        way[j] = target[j] - s->velocity[j];
        reach[j] = s->limits->acceleration[j] * s->period_s;
        oracle_raise(&answer, LW_LIMIT_ACCELERATION, fabs(way[j]) - reach[j]);
    }

    // As much of the step as the accelerations allow; a joint that leaves its bounds brakes by itself, as hard as it
    // can.
    const double part = oracle_part(way, reach);
    for (int j = 0; j < LW_NJ; j++) {
        const double shared = s->velocity[j] + part * way[j];
        answer.command[j] = shared;
        if (!known)
            continue;
        const double ceiling = fmax(high[j], s->velocity[j] - reach[j]),
                     floor_ = fmin(low[j], s->velocity[j] + reach[j]);
        answer.command[j] = oracle_nearest(shared, floor_, ceiling);
        oracle_raise(&answer, LW_LIMIT_POSITION, fmax(shared - ceiling, floor_ - shared));
    }
    return answer;
}

#endif
