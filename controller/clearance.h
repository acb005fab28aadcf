// SPDX-License-Identifier: BSD-3-Clause
// Clearance: how much of a velocity the room to obstacles and between links leaves. The guard's stage between velocity
// and acceleration limits; it knows distances, not laws.
//
// Units    metres, radians, seconds.
// Frames   base frame of the arm.
// Arrays   one entry a joint, base to wrist 3.
// Memory   the caller's; nothing is allocated.
// Errors   none.
#ifndef LW_CONTROLLER_CLEARANCE_H
#define LW_CONTROLLER_CLEARANCE_H

#include "controller/guard.h"        // lw_guard_shape
#include "controller/law.h"          // struct lw_law_reach
#include "controller/surroundings.h" // struct lw_surroundings

#include <stdbool.h> // bool

// A near pair has a room for each end of the axis of one link.
enum { LW_ROOMS_MAX = 2 * LW_NEAR_MAX };

// What a near pair leaves an end of a link: it may close in on the plane between the two, which bounds what is convex,
// only so fast that it can still stop.
struct lw_room {
    int fixed_to, moved_by; // self pair: links that the plane stands on and that moves; obstacle: fixed_to 0
    double gradient[LW_NJ]; // m/rad, of the end's distance from the plane by the joint positions
    double room;            // m, that distance less the one to keep
    double approach;        // m/s, how fast the obstacle comes by itself, >= 0
};

struct lw_rooms {
    const struct lw_surroundings *around; // where the body is; NULL = its ways are straight
    const struct lw_body *body;
    int count;
    struct lw_room room[LW_ROOMS_MAX];
};

// Distances within which lw_clearance_command may have something to say: the way of the fastest point of the arm until
// it rests, and that of the fastest obstacle; between links the way that the levers of all joints add up to. Only
// limits, period and velocity of *in are looked at.
//   s               in  placed
//   obstacle_speed  in  m/s
struct lw_law_reach lw_clearance_reach(const struct lw_guard_input *in, const struct lw_body *body,
                                       const struct lw_surroundings *s, double obstacle_speed);

// Lists the rooms of all near pairs that the joints can change. With the clearance off there are none.
//   reach  in  of lw_clearance_reach: pairs farther apart have nothing to say
void lw_clearance_rooms(const struct lw_limits *limits, struct lw_law_reach reach, const struct lw_body *body,
                        const struct lw_surroundings *s, struct lw_rooms *rooms);

// Largest part in [0, 1] of a velocity that can be braked to rest within every room. Braking along a straight line in
// joint space takes T = max |qd_j| / a_j; with c = -gradient . qd the room has to hold c (T/2 + period), and approach
// (T + period) more where the obstacle comes by itself. Points of the arm move in curves: with w = sum |qd_j| and v the
// speed of the fastest point they leave the straight way by at most w v T^2 / 4 until they rest, which every room has
// to hold as well, also one that is left; between links only the joints between the two count, and v is bounded by the
// levers. A room that is used up is asked for nothing by what leaves it.
double lw_clearance_part(const struct lw_limits *limits, double period_s, const struct lw_rooms *rooms,
                         const double velocity[LW_NJ]);

// lw_guard_shape with the clearance: the wish, within the other limits, is scaled to its allowed part; where the
// acceleration limits would still lead too near, the arm is braked along its way instead. Adds LW_LIMIT_CLEARANCE.
unsigned lw_clearance_command(const struct lw_guard_input *in, const struct lw_rooms *rooms, double command[LW_NJ]);

#endif
