// SPDX-License-Identifier: BSD-3-Clause
// Constant velocity and constant turning about a moving origin, in closed form.
//
// Units    metres, seconds.
// Frames   base frame.
// Arrays   see moving.h.
// Memory   none.
// Errors   none.
#include "collision/moving.h"

#include "base/vec.h"       // lw_vec_*
#include "collision/near.h" // LW_EXTRAPOLATE_MAX_NS

#include <math.h>   // sin, cos
#include <stddef.h> // NULL
#include <string.h> // memcpy

double lw_moving_age(int64_t seen_ns, int64_t time_ns)
{
    if (time_ns <= seen_ns)
        return 0;
    const int64_t age = time_ns - seen_ns;
    return 1e-9 * (double)(age < LW_EXTRAPOLATE_MAX_NS ? age : LW_EXTRAPOLATE_MAX_NS);
}

// Rotation by an angle about a unit axis: 1 + sin K + (1 - cos) K^2.
static void rotation(const double axis[3], double angle, double r[9])
{
    const double s = sin(angle), c = cos(angle);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            r[3 * i + k] = (1 - c) * axis[i] * axis[k] + (i == k ? c : 0);
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        r[3 * j + k] -= s * axis[i];
        r[3 * k + j] += s * axis[i];
    }
}

struct lw_moving lw_moving_since(const struct lw_snapshot_item *item, int64_t time_ns)
{
    const struct lw_motion *motion = &item->motion;
    const double age = lw_moving_age(motion->time_ns, time_ns), rate = lw_vec_norm(motion->omega);
    struct lw_moving moving = {.turns = rate * age > 0};
    memcpy(moving.p, item->p, sizeof moving.p);
    for (int k = 0; k < 3; k++)
        moving.shift[k] = motion->v[k] * age;
    if (moving.turns) {
        const double axis[3] = {motion->omega[0] / rate, motion->omega[1] / rate, motion->omega[2] / rate};
        rotation(axis, rate * age, moving.r);
    }
    return moving;
}

void lw_moving_turn_back(const struct lw_moving *moving, const double now[3], double then[3])
{
    const double *r = moving->r, x[3] = {now[0], now[1], now[2]};
    for (int k = 0; k < 3; k++)
        then[k] = moving->turns ? r[k] * x[0] + r[3 + k] * x[1] + r[6 + k] * x[2] : x[k];
}

void lw_moving_back(const struct lw_moving *moving, const double now[3], double then[3])
{
    lw_vec_sub(now, moving->shift, then);
    if (!moving->turns)
        return;
    lw_vec_sub(then, moving->p, then);
    lw_moving_turn_back(moving, then, then);
    lw_vec_add_scaled(1, moving->p, then);
}

static void turn_forth(const struct lw_moving *moving, double x[3])
{
    const double then[3] = {x[0], x[1], x[2]};
    for (int k = 0; k < 3 && moving->turns; k++)
        x[k] = lw_vec_dot(&moving->r[3 * k], then);
}

static void forth(const struct lw_moving *moving, double x[3])
{
    if (moving->turns) {
        lw_vec_sub(x, moving->p, x);
        turn_forth(moving, x);
        lw_vec_add_scaled(1, moving->p, x);
    }
    lw_vec_add_scaled(1, moving->shift, x);
}

void lw_moving_forth(const struct lw_moving *moving, struct lw_distance *result)
{
    if (result->flags & LW_DISTANCE_NO_NORMAL)
        return;
    turn_forth(moving, result->n);
    forth(moving, result->pa);
    forth(moving, result->pb);
}

void lw_moving_velocity(const struct lw_snapshot_item *item, const struct lw_moving *moving, const double x[3],
                        double velocity[3])
{
    double arm[3], turning[3];
    lw_vec_sub(x, item->p, arm);
    if (moving != NULL)
        lw_vec_sub(arm, moving->shift, arm);
    lw_vec_cross(item->motion.omega, arm, turning);
    for (int k = 0; k < 3; k++)
        velocity[k] = item->motion.v[k] + turning[k];
}
