// SPDX-License-Identifier: BSD-3-Clause
// Closed forms: segment against point, segment, half-space and box.
//
// Units    metres.
// Frames   see closed.h; a box is handled in its own axes.
// Arrays   see closed.h.
// Memory   none.
// Errors   none.
#include "collision/closed.h"

#include <math.h>    // sqrt, fabs, HUGE_VAL, NAN
#include <stdbool.h> // bool
#include <string.h>  // memcpy

void lw_closed_perpendicular(const double u[3], double out[3])
{
    // u x (1, 0, 0), which is exact, or z when u is along x or zero.
    const double length = sqrt(u[1] * u[1] + u[2] * u[2]);
    out[0] = 0;
    out[1] = length > 0 ? u[2] / length : 0;
    out[2] = length > 0 ? -u[1] / length : 1;
}

// --- sphere ---

void lw_closed_sphere(const struct lw_capsule *link, const double c[3], double r, struct lw_distance *out)
{
    double u[3], w[3], qa[3], v[3];
    lw_vec_sub(link->b, link->a, u);
    lw_vec_sub(c, link->a, w);
    const double uu = lw_vec_dot(u, u);
    const double t = uu > 0 ? lw_closed_clamp(lw_vec_dot(w, u) / uu, 0, 1) : 0;
    for (int i = 0; i < 3; i++) {
        qa[i] = link->a[i] + t * u[i];
        v[i] = t * u[i] - w[i];
    }
    if (lw_vec_dot(v, v) <= lw_touch_square) {
        lw_closed_perpendicular(u, v);
        lw_closed_core(qa, v, 0, (double[2]){link->r, r}, out);
        return;
    }
    lw_closed_apart(qa, v, link->r, r, out);
}

// --- capsule ---

static double over(double value, double square)
{
    return square > 0 ? value / square : 0;
}

// Direction out of two segments that meet: perpendicular to both, or to the longer one where they are parallel.
//   cross  in  u x w
static void crossing_normal(const double u[3], const double w[3], const double cross[3], double n[3])
{
    const double uu = lw_vec_dot(u, u), ww = lw_vec_dot(w, w), square = lw_vec_dot(cross, cross);
    if (!(square > 1e-20 * uu * ww)) {
        lw_closed_perpendicular(uu >= ww ? u : w, n);
        return;
    }
    for (int i = 0; i < 3; i++)
        n[i] = cross[i] / sqrt(square);
}

// Segments p + s u and q + t w with r = p - q: s where the lines are nearest, from cross products, whose error grows
// with 1 / angle only, of parallel lines any s; the best t for it, clamped; and the best s for that t.
void lw_closed_segment(const struct lw_capsule *link, const double a[3], const double b[3], double radius,
                       struct lw_distance *out)
{
    double u[3], w[3], r[3], cross[3], wr[3], qa[3], v[3];
    lw_vec_sub(link->b, link->a, u);
    lw_vec_sub(b, a, w);
    lw_vec_sub(link->a, a, r);
    lw_vec_cross(u, w, cross);
    lw_vec_cross(w, r, wr);
    const double uw = lw_vec_dot(u, w);
    const double first = lw_closed_clamp(over(lw_vec_dot(wr, cross), lw_vec_dot(cross, cross)), 0, 1);
    const double t = lw_closed_clamp(over(uw * first + lw_vec_dot(w, r), lw_vec_dot(w, w)), 0, 1);
    const double s = lw_closed_clamp(over(uw * t - lw_vec_dot(u, r), lw_vec_dot(u, u)), 0, 1);
    for (int i = 0; i < 3; i++) {
        qa[i] = link->a[i] + s * u[i];
        v[i] = r[i] + s * u[i] - t * w[i];
    }
    if (lw_vec_dot(v, v) <= lw_touch_square) {
        crossing_normal(u, w, cross, v);
        lw_closed_core(qa, v, 0, (double[2]){link->r, radius}, out);
        return;
    }
    lw_closed_apart(qa, v, link->r, radius, out);
}

// --- half-space ---

void lw_closed_halfspace(const struct lw_capsule *link, const struct lw_shape *shape, struct lw_distance *out)
{
    const double a = lw_vec_dot(shape->halfspace.m, link->a), b = lw_vec_dot(shape->halfspace.m, link->b);
    // Ends of one height: the middle, so that the point does not jump from end to end.
    const double t = fabs(a - b) <= 1e-15 * (fabs(a) + fabs(b)) ? 0.5 : a < b ? 0 : 1;
    const double height = (a < b ? a : b) - shape->halfspace.o + 0 * (a + b); // what is not finite must show
    double qa[3];
    lw_closed_along(link->a, link->b, t, qa);
    out->d = height - link->r;
    for (int i = 0; i < 3; i++) {
        out->n[i] = shape->halfspace.m[i];
        out->pa[i] = qa[i] - link->r * shape->halfspace.m[i];
        out->pb[i] = out->pa[i] - out->d * shape->halfspace.m[i];
    }
    out->flags = height < 0 ? LW_DISTANCE_CORE : 0;
    out->iterations = 0;
}

// --- box ---

// A segment x0 + t u beside a box of half extents h at the origin.
struct beside {
    double x0[3], x1[3], u[3];
    const double *h;
};

// Half the slope of the squared distance along the segment, sum of u_i times what x_i is outside by: monotone in t and
// linear between the kinks where the segment passes a face's plane.
//   steepness  out  its own slope
//   sides      out  which planes x is beyond: equal sides, same linear piece
static double slope_at(const struct beside *g, double t, double *steepness, int *sides)
{
    double slope = 0;
    *steepness = 0;
    *sides = 0;
    for (int i = 0; i < 3; i++) {
        const double x = g->x0[i] + t * g->u[i];
        const int above = x > g->h[i], below = x < -g->h[i];
        const double active = above + below;
        slope += active * g->u[i] * (x - (above - below) * g->h[i]);
        *steepness += active * g->u[i] * g->u[i];
        *sides |= (above + 2 * below) << (2 * i);
    }
    return slope;
}

// Stretch of t in 0..1 where no plane of an axis that the segment moves along is passed: there the squared distance
// does not change. Empty when first > last.
static void level_stretch(const struct beside *g, double *first, double *last)
{
    double size = 0;
    for (int i = 0; i < 3; i++)
        size += fabs(g->x0[i]) + fabs(g->x1[i]);
    *first = 0;
    *last = 1;
    for (int i = 0; i < 3; i++) {
        if (!(fabs(g->u[i]) > 1e-15 * size))
            continue;
        const double one = (-g->h[i] - g->x0[i]) / g->u[i], other = (g->h[i] - g->x0[i]) / g->u[i];
        const double enter = one < other ? one : other, leave = one < other ? other : one;
        *first = enter > *first ? enter : *first;
        *last = leave < *last ? leave : *last;
    }
}

// The t of slope 0, which lies between two kinks, where the slope is linear.
static double between_kinks(const struct beside *g, double slope0, double slope1)
{
    double low = 0, slope_low = slope0, high = 1, slope_high = slope1;
    for (int k = 0; k < 6; k++) {
        const int i = k / 2;
        const double t = g->u[i] != 0 ? ((k % 2 ? g->h[i] : -g->h[i]) - g->x0[i]) / g->u[i] : -1;
        double steepness;
        int sides;
        if (!(t > low && t < high))
            continue;
        const double slope = slope_at(g, t, &steepness, &sides);
        *(slope < 0 ? &low : &high) = t;
        *(slope < 0 ? &slope_low : &slope_high) = slope;
    }
    const double rise = slope_high - slope_low;
    return rise > 0 ? low - (high - low) * slope_low / rise : low;
}

// The t of the segment's point nearest to the box, the middle of them where there are many.
static double nearest_t(const struct beside *g, int *iterations)
{
    double first, last, steepness;
    int sides, sides_before = -1;
    *iterations = 0;
    level_stretch(g, &first, &last);
    if (first <= last)
        return 0.5 * (first + last);
    const double slope0 = slope_at(g, 0, &steepness, &sides), slope1 = slope_at(g, 1, &steepness, &sides);
    if (!(slope0 < 0))
        return 0;
    if (!(slope1 > 0))
        return 1;
    // Newton: on one linear piece its step is exact, so it ends where it stays on the piece it came from.
    double t = slope0 / (slope0 - slope1);
    while (++*iterations < 6 && t > 0 && t < 1) {
        const double slope = slope_at(g, t, &steepness, &sides);
        if (sides == sides_before)
            return t;
        sides_before = sides;
        t -= steepness > 0 ? slope / steepness : 2;
    }
    return between_kinks(g, slope0, slope1);
}

// From the box to the segment's point at t.
static void outside_at(const struct beside *g, double t, double v[3])
{
    for (int i = 0; i < 3; i++) {
        const double x = g->x0[i] + t * g->u[i];
        v[i] = x - lw_closed_clamp(x, -g->h[i], g->h[i]);
    }
}

// A vector in box axes, in the frame of the box's axes.
static void turn_out(const struct lw_shape *box, const double v[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = lw_vec_dot(&box->box.axes[3 * i], v);
}

// Overlap: depth and direction by separating axes; the witness is nearest once the segment has moved out.
static void box_core(const struct lw_capsule *link, const struct lw_shape *box, struct beside *g,
                     struct lw_distance *out)
{
    double inward[3], n[3], qa[3];
    int iterations;
    const double depth = lw_sat_box(g->x0, g->x1, g->h, inward);
    lw_vec_add_scaled(depth, inward, g->x0);
    lw_vec_add_scaled(depth, inward, g->x1);
    lw_closed_along(link->a, link->b, nearest_t(g, &iterations), qa);
    turn_out(box, inward, n);
    lw_closed_core(qa, n, depth, (double[2]){link->r, box->r}, out);
}

void lw_closed_box(const struct lw_capsule *link, const struct lw_shape *box, struct lw_distance *out)
{
    struct beside g = {.h = box->box.half};
    double a[3], b[3], inside[3], v[3], qa[3];
    int iterations;
    lw_vec_sub(link->a, box->c, a);
    lw_vec_sub(link->b, box->c, b);
    for (int i = 0; i < 3; i++) {
        const double *r = &box->box.axes[i];
        g.x0[i] = r[0] * a[0] + r[3] * a[1] + r[6] * a[2];
        g.x1[i] = r[0] * b[0] + r[3] * b[1] + r[6] * b[2];
        g.u[i] = g.x1[i] - g.x0[i];
    }
    const double t = nearest_t(&g, &iterations);
    outside_at(&g, t, inside);
    if (lw_vec_dot(inside, inside) <= lw_touch_square) {
        box_core(link, box, &g, out);
    } else {
        turn_out(box, inside, v);
        lw_closed_along(link->a, link->b, t, qa);
        lw_closed_apart(qa, v, link->r, box->r, out);
    }
    out->iterations = iterations;
}
