// SPDX-License-Identifier: BSD-3-Clause
// Checking solids and placing them in the world.
//
// Units    metres.
// Frames   see shape.h.
// Arrays   see shape.h.
// Memory   see shape.h.
// Errors   see shape.h.
#include "collision/shape.h"

#include "base/vec.h" // lw_vec_*, lw_all_finite

#include <math.h>    // sqrt, fabs, isfinite, HUGE_VAL
#include <stdbool.h> // bool
#include <stddef.h>  // NULL
#include <string.h>  // memcpy

// What a length that should be 1 may be off.
static const double unit_slack = 1e-3;

static bool scale_to_unit(double *values, int n)
{
    double square = 0;
    for (int i = 0; i < n; i++)
        square += values[i] * values[i];
    const double length = sqrt(square);
    if (!(fabs(length - 1) <= unit_slack))
        return false;
    for (int i = 0; i < n; i++)
        values[i] /= length;
    return true;
}

// --- poses ---

enum lw_status lw_pose_make(const double p[3], const double quaternion[4], struct lw_pose *pose)
{
    double q[4];
    memcpy(q, quaternion, sizeof q);
    if (!lw_all_finite(p, 3) || !lw_all_finite(q, 4))
        return LW_E_NOT_FINITE;
    if (!scale_to_unit(q, 4))
        return LW_E_ARGUMENT;
    const double w = q[0], x = q[1], y = q[2], z = q[3];
    *pose = (struct lw_pose){
        .r = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),  // x row
              2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),  // y row
              2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}, // z row
        .p = {p[0], p[1], p[2]},
    };
    return LW_OK;
}

// Makes nearly orthonormal, right-handed axes exactly so: x keeps its direction, y its plane. False when they are not.
static bool straighten(const double r[9], double out[9])
{
    double x[3] = {r[0], r[3], r[6]}, y[3] = {r[1], r[4], r[7]}, z[3];
    const double given_z[3] = {r[2], r[5], r[8]};
    if (!(fabs(lw_vec_dot(x, y)) <= unit_slack) || !scale_to_unit(x, 3) || !scale_to_unit(y, 3))
        return false;
    lw_vec_add_scaled(-lw_vec_dot(x, y), x, y);
    if (!scale_to_unit(y, 3))
        return false;
    lw_vec_cross(x, y, z);
    for (int i = 0; i < 3; i++) {
        if (!(fabs(z[i] - given_z[i]) <= 3 * unit_slack))
            return false;
        out[3 * i] = x[i];
        out[3 * i + 1] = y[i];
        out[3 * i + 2] = z[i];
    }
    return true;
}

static void rotate(const double r[9], const double v[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = lw_vec_dot(&r[3 * i], v);
}

// --- checks ---

static const char *not_finite = "a value is not a finite number";

static bool all_positive(const double *values, int n)
{
    for (int i = 0; i < n; i++)
        if (!(values[i] > 0))
            return false;
    return true;
}

// Text of what is wrong with the numbers of a solid, NULL when they are finite.
static const char *check_finite(const struct lw_solid *s)
{
    bool finite = true;
    switch (s->kind) {
    case LW_SPHERE: break;
    case LW_CAPSULE: finite = lw_all_finite(&s->half_length, 1); break;
    case LW_BOX: finite = lw_all_finite(s->half, 3); break;
    case LW_HULL: finite = lw_all_finite(s->vertex, 3 * s->count); break;
    case LW_HALFSPACE: return lw_all_finite(s->normal, 3) && lw_all_finite(&s->offset, 1) ? NULL : not_finite;
    case LW_CUSTOM: finite = lw_all_finite(&s->custom_bound, 1) && lw_all_finite(s->custom_centre, 3); break;
    default: break;
    }
    return finite && lw_all_finite(&s->radius, 1) ? NULL : not_finite;
}

// Text of what is wrong with the counts and sizes of a solid, NULL when nothing is.
static const char *check_sizes(const struct lw_solid *s)
{
    double normal[3];
    memcpy(normal, s->normal, sizeof normal);
    switch (s->kind) {
    case LW_SPHERE:
    case LW_HULL: break; // its count is checked before its vertices are read
    case LW_CAPSULE:
        if (s->half_length < 0)
            return "the half length is negative";
        break;
    case LW_BOX:
        if (!all_positive(s->half, 3))
            return "a half extent is not positive";
        break;
    case LW_HALFSPACE: return scale_to_unit(normal, 3) ? NULL : "the normal has not length 1";
    case LW_CUSTOM:
        if (s->custom == NULL || !(s->custom_bound > 0))
            return "a custom shape needs an object and a bound";
        break;
    default: return "there is no such kind of shape";
    }
    return s->radius < 0 ? "the radius is negative" : NULL;
}

static enum lw_status check(const struct lw_solid *solid, const struct lw_pose *pose, const char **reason)
{
    double axes[9];
    if (solid->kind == LW_HULL && (solid->count < 1 || solid->count > LW_HULL_MAX || solid->vertex == NULL)) {
        *reason = "a hull has 1 to 64 vertices";
        return LW_E_ARGUMENT;
    }
    const bool pose_finite = lw_all_finite(pose->r, 9) && lw_all_finite(pose->p, 3);
    *reason = pose_finite ? check_finite(solid) : not_finite;
    if (*reason != NULL)
        return LW_E_NOT_FINITE;
    *reason = straighten(pose->r, axes) ? check_sizes(solid) : "the rotation is not orthonormal";
    return *reason == NULL ? LW_OK : LW_E_ARGUMENT;
}

// --- placing ---

static void place_segment(const struct lw_solid *solid, const struct lw_pose *pose, struct lw_shape *shape)
{
    const double half = solid->kind == LW_CAPSULE ? solid->half_length : 0;
    for (int i = 0; i < 3; i++) {
        shape->segment.a[i] = pose->p[i] - half * pose->r[3 * i + 2];
        shape->segment.b[i] = pose->p[i] + half * pose->r[3 * i + 2];
    }
    shape->bound = half + shape->r;
}

// Vertices are taken relative to the middle of their box first: far from the origin that costs no digits.
static void place_hull(const struct lw_solid *solid, const struct lw_pose *pose, double *room, struct lw_shape *shape)
{
    const double *v = solid->vertex;
    double low[3] = {v[0], v[1], v[2]}, high[3] = {v[0], v[1], v[2]}, middle[3], turned[3];
    for (int i = 3; i < 3 * solid->count; i++) {
        low[i % 3] = v[i] < low[i % 3] ? v[i] : low[i % 3];
        high[i % 3] = v[i] > high[i % 3] ? v[i] : high[i % 3];
    }
    for (int k = 0; k < 3; k++)
        middle[k] = low[k] + 0.5 * (high[k] - low[k]);
    rotate(pose->r, middle, turned);
    lw_vec_add_scaled(1, turned, shape->c);

    // The padding repeats vertex 0.
    const int padded = lw_hull_padded(solid->count);
    double square = 0;
    for (int i = 0; i < padded; i++) {
        double relative[3];
        lw_vec_sub(&v[i < solid->count ? 3 * i : 0], middle, relative);
        rotate(pose->r, relative, turned);
        for (int k = 0; k < 3; k++)
            room[k * padded + i] = turned[k];
        square = lw_vec_dot(turned, turned) > square ? lw_vec_dot(turned, turned) : square;
    }
    shape->hull.count = solid->count;
    shape->hull.padded = padded;
    shape->hull.reach = sqrt(square);
    shape->hull.vertex = room;
    shape->bound = shape->hull.reach + shape->r;
}

static void place(const struct lw_solid *solid, const struct lw_pose *pose, double *room, struct lw_shape *shape)
{
    double turned[3];
    switch (solid->kind) {
    case LW_BOX:
        memcpy(shape->box.axes, pose->r, sizeof shape->box.axes);
        memcpy(shape->box.half, solid->half, sizeof shape->box.half);
        shape->bound = lw_vec_norm(solid->half) + shape->r;
        break;
    case LW_HULL: place_hull(solid, pose, room, shape); break;
    case LW_HALFSPACE:
        rotate(pose->r, solid->normal, shape->halfspace.m);
        (void)scale_to_unit(shape->halfspace.m, 3); // checked
        shape->halfspace.o = solid->offset / lw_vec_norm(solid->normal) + lw_vec_dot(shape->halfspace.m, pose->p);
        shape->r = 0;
        shape->bound = HUGE_VAL;
        break;
    case LW_CUSTOM:
        rotate(pose->r, solid->custom_centre, turned);
        lw_vec_add_scaled(1, turned, shape->c);
        shape->custom = solid->custom;
        shape->bound = solid->custom_bound + shape->r;
        break;
    default: place_segment(solid, pose, shape); break;
    }
}

// Squares of its numbers are finite.
static bool fits(const struct lw_shape *shape)
{
    const double size = shape->kind == LW_HALFSPACE ? shape->halfspace.o : shape->bound;
    return isfinite(lw_vec_dot(shape->c, shape->c)) && isfinite(size * size);
}

enum lw_status lw_shape_make(const struct lw_solid *solid, const struct lw_pose *pose, double *room,
                             struct lw_shape *shape, const char **reason)
{
    const char *unread = NULL, **text = reason != NULL ? reason : &unread;
    const enum lw_status status = check(solid, pose, text);
    if (status != LW_OK)
        return status;
    struct lw_pose straight = *pose;
    (void)straighten(pose->r, straight.r); // checked
    struct lw_shape placed = {.kind = solid->kind, .r = solid->radius};
    memcpy(placed.c, pose->p, sizeof placed.c);
    place(solid, &straight, room, &placed);
    if (!fits(&placed)) {
        *text = "the shape is too large or too far away for its distances to be numbers";
        return LW_E_ARGUMENT;
    }
    *shape = placed;
    return LW_OK;
}

struct lw_shape lw_shape_of_capsule(const struct lw_capsule *capsule)
{
    struct lw_shape shape = {.kind = LW_CAPSULE, .r = capsule->r};
    double axis[3];
    lw_vec_sub(capsule->b, capsule->a, axis);
    for (int i = 0; i < 3; i++) {
        shape.segment.a[i] = capsule->a[i];
        shape.segment.b[i] = capsule->b[i];
        shape.c[i] = capsule->a[i] + 0.5 * axis[i];
    }
    shape.bound = 0.5 * lw_vec_norm(axis) + capsule->r;
    return shape;
}

struct lw_capsule lw_shape_capsule(const struct lw_shape *shape)
{
    struct lw_capsule capsule = {.r = shape->r};
    memcpy(capsule.a, shape->segment.a, sizeof capsule.a);
    memcpy(capsule.b, shape->segment.b, sizeof capsule.b);
    return capsule;
}
