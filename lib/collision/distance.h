// SPDX-License-Identifier: BSD-3-Clause
// Distance between a link of the arm (a capsule) and a shape, with witness points and normal: closed forms for spheres,
// capsules, boxes and half-spaces, GJK and EPA on the cores for hulls and pairs of general shapes.
//
// Units    metres.
// Frames   everything of one call is in one frame.
// Arrays   [3] x y z.
// Memory   no function here allocates or keeps state between calls; the warm start is the caller's.
// Errors   none: a query is bounded and always answers. A value that is not finite goes through to the distance.
#ifndef LW_COLLISION_DISTANCE_H
#define LW_COLLISION_DISTANCE_H

#include "base/status.h"     // enum lw_status
#include "collision/shape.h" // struct lw_shape, struct lw_capsule

#include <stdint.h> // uint8_t, uint32_t

enum lw_distance_flag {
    LW_DISTANCE_CORE = 1,      // the cores meet: stop, do not follow n, which may jump from face to face
    LW_DISTANCE_FAR = 2,       // d is only a proven lower bound above d_max; no points, no normal
    LW_DISTANCE_CAPPED = 4,    // the iterations ran out: d is the best value found
    LW_DISTANCE_STALLED = 8,   // rounding or a full pool ended the search: d is the best value found
    LW_DISTANCE_NO_NORMAL = 16 // pa, pb and n are zero
};

// Signed distance of surfaces, negative when they overlap; pa - pb = d n holds for either sign.
struct lw_distance {
    double d;     // m
    double pa[3]; // m, on the link's surface
    double pb[3]; // m, on the shape's surface
    double n[3];  // unit, from the shape to the link: the gradient of d when the link moves
    int iterations;
    int flags; // enum lw_distance_flag
};

// Where the last query of a pair ended: the next one starts there. All zero = nowhere. It is used only while id and
// generation are the shape's; a stale but valid one costs time, never digits.
struct lw_warm {
    uint32_t id, generation;
    uint8_t count;      // 0..3
    uint8_t a[3], b[3]; // ends of the link, vertices of the hull
};

// Distance of a link to a shape.
//   d_max  in   m: beyond it any proven lower bound will do (FAR); HUGE_VAL = always exact
//   warm   i/o  may be NULL; read and written for hulls alone
// Cost: closed forms at most 8 steps, hulls at most 48 supports, overlapping hulls 92 more.
void lw_distance_link(const struct lw_capsule *link, const struct lw_shape *shape, double d_max, struct lw_warm *warm,
                      struct lw_distance *out);

// Distance of two capsules; n points from the other one to this one.
void lw_distance_capsules(const struct lw_capsule *capsule, const struct lw_capsule *other, struct lw_distance *out);

// Distance of two shapes of any kind; pa is on shape a, n points from b to a.
// Fails LW_E_ARGUMENT for two half-spaces and for a half-space and a custom shape.
LW_MUST_CHECK enum lw_status lw_distance_shapes(const struct lw_shape *a, const struct lw_shape *b,
                                                struct lw_distance *out);

// Certificate: how far d may lie above the true distance, from the plane that n spans; no search is involved.
//   lower = min over core a of n.x - r_a - max over core b of n.x - r_b <= true distance; the gap is d - lower
// 0 for FAR, whose d is such a bound itself; HUGE_VAL without a normal.
double lw_distance_gap(const struct lw_capsule *link, const struct lw_shape *shape, const struct lw_distance *result);
double lw_distance_shapes_gap(const struct lw_shape *a, const struct lw_shape *b, const struct lw_distance *result);

#endif
