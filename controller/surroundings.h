// SPDX-License-Identifier: BSD-3-Clause
// Surroundings: where the arm is at a configuration, and what is near it.
//
// Units    metres, radians, seconds; ns where a name says so.
// Frames   base frame of the arm.
// Arrays   see arm/arm.h and collision/near.h.
// Memory   the caller's; the struct is large and only its used part is written.
// Errors   enum lw_status.
#ifndef LW_CONTROLLER_SURROUNDINGS_H
#define LW_CONTROLLER_SURROUNDINGS_H

#include "arm/arm.h"            // lw_arm_fk
#include "collision/body.h"     // struct lw_body
#include "collision/near.h"     // struct lw_near_list
#include "collision/snapshot.h" // struct lw_snapshot

#include <stdbool.h> // bool

// What to look with.
struct lw_eyes {
    const struct lw_body *body;
    const struct lw_snapshot *world;
    int64_t time_ns;   // obstacles are where they are then
    double reach;      // m, obstacles farther from a part are left out
    double self_reach; // m, the same for links among one another
    struct lw_warm_table *warm;
};

struct lw_surroundings {
    struct lw_pose frame[LW_NJ]; // frames 1..6
    struct lw_placed placed;     // parts of the body
    struct lw_near_list near;    // pairs within reach
};

// Puts arm and body where a configuration has them.
//   q  in  [6] rad
// Fails LW_E_NOT_FINITE; *out is undefined then.
LW_MUST_CHECK enum lw_status lw_surroundings_place(const struct lw_arm *arm, const struct lw_body *body,
                                                   const double q[LW_NJ], struct lw_surroundings *out);

// Speed (m/s) that no point of the body exceeds.
//   qd  in  [6] rad/s
double lw_surroundings_speed(const struct lw_surroundings *s, const struct lw_body *body, const double qd[LW_NJ]);

// Looks around from where the body is. Pairs of shoulder or upper arm and an obstacle that the joints can bring no more
// than 2 cm/rad nearer, within 5 cm, are marked as fixed: the arm and what it is mounted on. Cost: that of the near
// pairs.
void lw_surroundings_look(const struct lw_eyes *eyes, struct lw_surroundings *out);

// Gradient of the distance of a near pair by the joint positions.
//   gradient  out  [6] m/rad
void lw_surroundings_gradient(const struct lw_surroundings *s, const struct lw_body *body, const struct lw_near *pair,
                              double gradient[LW_NJ]);

// Smallest distance of the obstacle pairs, or of the self pairs, in the list; NULL when there is none.
const struct lw_near *lw_surroundings_nearest(const struct lw_surroundings *s, bool self);

#endif
