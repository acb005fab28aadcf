// SPDX-License-Identifier: BSD-3-Clause
// Closed forms of the distance between a segment swept by a ball and spheres, capsules, boxes and half-spaces, and what
// all distance code ends with.
//
// Units    metres.
// Frames   everything of one call is in one frame.
// Arrays   [3] x y z.
// Memory   none.
// Errors   none; NaN passes through to d.
#ifndef LW_COLLISION_CLOSED_H
#define LW_COLLISION_CLOSED_H

#include "base/vec.h"           // lw_vec_*
#include "collision/distance.h" // struct lw_distance

// Cores this near, squared, touch: their difference has no direction.
static const double lw_touch_square = 1e-24;

// a + t (b - a)
static inline void lw_closed_along(const double a[3], const double b[3], double t, double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = a[i] + t * (b[i] - a[i]);
}

// NaN stays NaN. Written so that it compiles to a maximum and a minimum, without a branch.
static inline double lw_closed_clamp(double t, double low, double high)
{
    const double raised = low > t ? low : t;
    return high < raised ? high : raised;
}

// Result for cores apart.
//   qa  in  nearest point of the link's core
//   v   in  from the shape's core to the link's, not zero
static inline void lw_closed_apart(const double qa[3], const double v[3], double r_link, double r_shape,
                                   struct lw_distance *out)
{
    const double length = lw_vec_norm(v);
    for (int i = 0; i < 3; i++) {
        out->n[i] = v[i] / length;
        out->pa[i] = qa[i] - r_link * out->n[i];
        out->pb[i] = qa[i] - v[i] + r_shape * out->n[i];
    }
    out->d = length - r_link - r_shape;
    out->flags = 0;
    out->iterations = 0;
}

// Result for cores that overlap by a depth >= 0 against the unit direction n.
static inline void lw_closed_core(const double qa[3], const double n[3], double depth, const double r[2],
                                  struct lw_distance *out)
{
    out->d = -(depth + r[0] + r[1]);
    for (int i = 0; i < 3; i++) {
        out->n[i] = n[i];
        out->pa[i] = qa[i] - r[0] * n[i];
        out->pb[i] = out->pa[i] - out->d * n[i];
    }
    out->flags = LW_DISTANCE_CORE;
    out->iterations = 0;
}

// Unit vector perpendicular to u, z for a zero u.
void lw_closed_perpendicular(const double u[3], double out[3]);

void lw_closed_sphere(const struct lw_capsule *link, const double c[3], double r, struct lw_distance *out);
void lw_closed_segment(const struct lw_capsule *link, const double a[3], const double b[3], double r,
                       struct lw_distance *out);
void lw_closed_halfspace(const struct lw_capsule *link, const struct lw_shape *shape, struct lw_distance *out);
void lw_closed_box(const struct lw_capsule *link, const struct lw_shape *box, struct lw_distance *out);

// Overlap of a segment and a box at the origin, by the separating axes of the pair: faces and u x e_i.
//   x0, x1  in   ends of the segment in box axes
//   n       out  direction that frees the segment with the least motion
// Returns the depth; below zero by no more than rounding when they just touch.
double lw_sat_box(const double x0[3], const double x1[3], const double half[3], double n[3]);

#endif
