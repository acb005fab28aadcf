// SPDX-License-Identifier: BSD-3-Clause
// Custom shapes: any convex solid that answers a direction with its farthest point, by libccd's support functions.
//
// Units    metres.
// Frames   a support function answers in the frame of the query, about the base origin like everything else.
// Arrays   [3] x y z.
// Memory   the object is the caller's. A support function must not allocate or block where queries must not.
// Errors   none; bounded by the cap. Where cores overlap no depth is searched: d is -(r_a + r_b), an upper bound,
// without
//          a normal.
#ifndef LW_COLLISION_CUSTOM_H
#define LW_COLLISION_CUSTOM_H

#include "collision/distance.h" // struct lw_distance, struct lw_shape

#include <ccd/ccd.h> // ccd_support_fn

// What a custom shape points to.
struct lw_custom {
    ccd_support_fn support; // farthest point of the core in a direction of any length but 0
    const void *object;     // its first argument
};

// Distance of two bounded shapes of which one at least is custom; arguments as in lw_distance_link.
void lw_custom_distance(const struct lw_shape *a, const struct lw_shape *b, double d_max, struct lw_distance *out);

// Largest n . (x - origin) over the core of a custom shape.
double lw_custom_reach(const struct lw_shape *shape, const double n[3], const double origin[3]);

#endif
