// SPDX-License-Identifier: BSD-3-Clause
// Law: what turns configuration, goal and near obstacles into wished joint velocities. The tick knows no law by name.
//
// Units    metres, radians, seconds.
// Frames   base frame of the arm.
// Arrays   one entry a joint, base to wrist 3.
// Memory   nothing is allocated; inputs are read only.
// Errors   none: a law that cannot give a finite wish gives a non-finite one, and the guard brakes.
#ifndef LW_CONTROLLER_LAW_H
#define LW_CONTROLLER_LAW_H

#include "arm/joint.h"               // LW_NJ
#include "controller/surroundings.h" // struct lw_surroundings
#include "scene/scene.h"             // struct lw_law_params

struct lw_law_input {
    const struct lw_surroundings *around; // the arm, and all pairs within lw_law.reach
    const struct lw_body *body;
    const double *goal;        // [3] m
    const double *circulation; // [3] axis times gain to turn around obstacles with, zero = none; a law may ignore it
};

// Distances within which a law wants to know of things.
struct lw_law_reach {
    double obstacles; // m
    double self;      // m
};

struct lw_law {
    const char *name;
    // How far a law has to see when no obstacle is faster than `speed` (m/s).
    struct lw_law_reach (*reach)(const struct lw_law_params *params, double speed);
    // Distance (m) from the goal within which standing still is no reason to worry.
    double (*tolerance)(const struct lw_law_params *params);
    // Wish for the joint velocities.
    //   qd  out  [6] rad/s
    void (*step)(const struct lw_law_params *params, const struct lw_law_input *in, double qd[LW_NJ]);
};

// The law of a name; static data.
const struct lw_law *lw_law_get(enum lw_law_name name);

#endif
