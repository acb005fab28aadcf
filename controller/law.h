// SPDX-License-Identifier: BSD-3-Clause
// Law: what turns configuration, goal and obstacles into wished joint velocities. The tick knows no law by name.
//
// Units    metres, radians, seconds.
// Frames   base frame of the arm.
// Arrays   one entry a joint, base to wrist 3.
// Memory   nothing is allocated; inputs are read only.
// Errors   none: a law that cannot give a finite wish gives a non-finite one, and the guard brakes.
#ifndef LW_CONTROLLER_LAW_H
#define LW_CONTROLLER_LAW_H

#include "arm/joint.h"       // struct lw_nearest
#include "collision/world.h" // struct lw_world
#include "scene/scene.h"     // struct lw_law_params

struct lw_law_input {
    const struct lw_pose *frame;  // [6] poses of frames 1..6
    const struct lw_world *world; // obstacles
    const double *goal;           // [3] m
};

struct lw_law_output {
    double qd[LW_NJ];          // rad/s, wish
    struct lw_nearest nearest; // closest control point and obstacle seen on the way
};

struct lw_law {
    const char *name;
    void (*step)(const struct lw_law_params *params, const struct lw_law_input *in, struct lw_law_output *out);
};

// The law of a name; static data.
const struct lw_law *lw_law_get(enum lw_law_name name);

#endif
