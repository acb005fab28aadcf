// SPDX-License-Identifier: BSD-3-Clause
// Scaling velocities to the room that is left.
//
// Units    metres, radians, seconds.
// Frames   base frame of the arm.
// Arrays   one entry a joint.
// Memory   none.
// Errors   none.
#include "controller/clearance.h"

#include "arm/joint.h" // enum lw_flag
#include "base/vec.h"  // lw_vec_dot

#include <math.h> // fmax, sqrt

static const double rounding = 1e-9; // a wish scaled to its part need not come out as wholly allowed

// Time to come to rest along a straight line in joint space.
static double braking_time(const struct lw_limits *limits, const double velocity[LW_NJ])
{
    double longest = 0;
    for (int j = 0; j < LW_NJ; j++)
        longest = fmax(longest, fabs(velocity[j]) / limits->acceleration[j]);
    return longest;
}

struct lw_law_reach lw_clearance_reach(const struct lw_guard_input *in, const struct lw_body *body,
                                       const struct lw_surroundings *s, double obstacle_speed)
{
    const struct lw_limits *limits = in->limits;
    if (isinf(limits->clearance))
        return (struct lw_law_reach){0, 0};
    // The fastest that the next tick can make it, as far as the speed limits allow.
    double next[LW_NJ], faster = 0;
    for (int j = 0; j < LW_NJ; j++) {
        next[j] = fmin(fabs(in->velocity[j]) + limits->acceleration[j] * in->period_s, limits->velocity[j]);
        faster += fmax(next[j] - fabs(in->velocity[j]), 0) * body->lever[j];
    }
    const double time = braking_time(limits, next);
    const double way = (lw_surroundings_speed(s, body, in->velocity) + faster) * (time / 2 + in->period_s);
    const double coming = obstacle_speed * (time + in->period_s);
    return (struct lw_law_reach){.obstacles = limits->clearance + way + coming, .self = limits->clearance + 2 * way};
}

void lw_clearance_rooms(const struct lw_limits *limits, struct lw_law_reach reach, const struct lw_body *body,
                        const struct lw_surroundings *s, struct lw_rooms *rooms)
{
    rooms->count = 0;
    if (isinf(limits->clearance))
        return;
    for (int i = 0; i < s->near.count; i++) {
        const struct lw_near *pair = &s->near.pair[i];
        if (pair->fixed || pair->distance.d > (pair->obstacle != 0 ? reach.obstacles : reach.self))
            continue;
        struct lw_room *room = &rooms->room[rooms->count++];
        lw_surroundings_gradient(s, body, pair, room->gradient);
        room->room = pair->distance.d - limits->clearance;
        room->approach = fmax(lw_vec_dot(pair->distance.n, pair->velocity), 0);
    }
}

// Part of a velocity that one room allows.
//   time  in  s, braking time of the whole velocity
static double part_of(const struct lw_room *room, double closing, double time, double period_s)
{
    const double left = room->room - room->approach * (time + period_s);
    if (left <= 0)
        return 0;
    // The larger root of closing (part time / 2 + period) part = left.
    const double at_once = closing * period_s;
    return fmin(1, 2 * left / (at_once + sqrt(at_once * at_once + 2 * closing * time * left)));
}

double lw_clearance_part(const struct lw_limits *limits, double period_s, const struct lw_rooms *rooms,
                         const double velocity[LW_NJ])
{
    const double time = braking_time(limits, velocity);
    double part = 1;
    for (int i = 0; i < rooms->count; i++) {
        double closing = 0;
        for (int j = 0; j < LW_NJ; j++)
            closing -= rooms->room[i].gradient[j] * velocity[j];
        if (closing > 0)
            part = fmin(part, part_of(&rooms->room[i], closing, time, period_s));
    }
    return part;
}

unsigned lw_clearance_command(const struct lw_guard_input *in, const struct lw_rooms *rooms, double command[LW_NJ])
{
    static const double rest[LW_NJ] = {0};
    struct lw_guard_input scaled = *in;
    double wish[LW_NJ];
    const bool finite = lw_all_finite(in->wish, LW_NJ);
    const double part = finite ? lw_clearance_part(in->limits, in->period_s, rooms, in->wish) : 1;
    for (int j = 0; j < LW_NJ; j++)
        wish[j] = part < 1 ? part * in->wish[j] : in->wish[j];
    scaled.wish = wish;
    const unsigned flags = lw_guard_shape(&scaled, command) | (part < 1 ? LW_LIMIT_CLEARANCE : 0u);
    if (rooms->count == 0 || lw_clearance_part(in->limits, in->period_s, rooms, command) > 1 - rounding)
        return flags;
    scaled.wish = rest;
    return flags | lw_guard_shape(&scaled, command) | LW_LIMIT_CLEARANCE;
}
