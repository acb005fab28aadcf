// SPDX-License-Identifier: BSD-3-Clause
// Dispatch of a pair to its closed form, or to GJK and EPA.
//
// Units    metres.
// Frames   see distance.h. Hulls are handled relative to their centre.
// Arrays   see distance.h.
// Memory   see distance.h.
// Errors   see distance.h.
#include "collision/distance.h"

#include "base/vec.h"         // lw_vec_*
#include "collision/closed.h" // lw_closed_*
#include "collision/clouds.h" // lw_clouds_*
#include "collision/custom.h" // lw_custom_distance

#include <math.h>    // sqrt, HUGE_VAL
#include <stdbool.h> // bool
#include <stddef.h>  // NULL

// --- link against hull ---

// The simplex that a warm start names; empty when it is another pair's or another shape's.
static void recall(const struct lw_warm *warm, const struct lw_shape *hull, struct lw_simplex *simplex)
{
    simplex->count = 0;
    if (warm == NULL || warm->id == 0 || warm->id != hull->id || warm->generation != hull->generation ||
        warm->count > 3)
        return;
    for (int i = 0; i < warm->count; i++) {
        if (warm->a[i] > 1 || warm->b[i] >= hull->hull.count)
            return;
        simplex->a[i] = warm->a[i];
        simplex->b[i] = warm->b[i];
    }
    simplex->count = warm->count;
}

static void remember(const struct lw_simplex *simplex, const struct lw_shape *hull, bool core, struct lw_warm *warm)
{
    if (warm == NULL || hull->id == 0)
        return;
    *warm = (struct lw_warm){.id = hull->id, .generation = hull->generation};
    if (core || simplex->count > 3)
        return;
    warm->count = (uint8_t)simplex->count;
    for (int i = 0; i < simplex->count; i++) {
        warm->a[i] = simplex->a[i];
        warm->b[i] = simplex->b[i];
    }
}

// Asks for the vertices now: they come while the search is set up.
static void fetch(const struct lw_core_hull *hull)
{
    enum { LINE = 64 / sizeof(double) };
    for (int i = 0; i < 3 * hull->padded; i += LINE)
        __builtin_prefetch(hull->vertex + i);
}

static void link_to_hull(const struct lw_capsule *link, const struct lw_shape *hull, double d_max, struct lw_warm *warm,
                         struct lw_distance *out)
{
    double p[2][3], ends[6];
    struct lw_simplex simplex;
    fetch(&hull->hull);
    lw_vec_sub(link->a, hull->c, p[0]);
    lw_vec_sub(link->b, hull->c, p[1]);
    for (int k = 0; k < 3; k++) {
        ends[2 * k] = p[0][k];
        ends[2 * k + 1] = p[1][k];
    }
    const double square0 = lw_vec_dot(p[0], p[0]), square1 = lw_vec_dot(p[1], p[1]);
    const struct lw_gjk_query query = {
        .a = {ends, 2, 2},
        .b = {hull->hull.vertex, hull->hull.count, hull->hull.padded},
        .size = sqrt(square0 > square1 ? square0 : square1) + hull->hull.reach,
        .far = d_max + link->r + hull->r,
        .cap = LW_GJK_CAP,
    };
    recall(warm, hull, &simplex);
    lw_clouds_distance(&query, &simplex, (double[2]){link->r, hull->r}, LW_EPA_CAP, out);
    remember(&simplex, hull, out->flags & LW_DISTANCE_CORE, warm);
    lw_clouds_shift(hull->c, out);
}

void lw_distance_link(const struct lw_capsule *link, const struct lw_shape *shape, double d_max, struct lw_warm *warm,
                      struct lw_distance *out)
{
    struct lw_shape as_shape;
    switch (shape->kind) {
    case LW_SPHERE: lw_closed_sphere(link, shape->c, shape->r, out); break;
    case LW_CAPSULE: lw_closed_segment(link, shape->segment.a, shape->segment.b, shape->r, out); break;
    case LW_BOX: lw_closed_box(link, shape, out); break;
    case LW_HULL: link_to_hull(link, shape, d_max, warm, out); break;
    case LW_HALFSPACE: lw_closed_halfspace(link, shape, out); break;
    default:
        as_shape = lw_shape_of_capsule(link);
        lw_custom_distance(&as_shape, shape, d_max, out);
        break;
    }
}

void lw_distance_capsules(const struct lw_capsule *capsule, const struct lw_capsule *other, struct lw_distance *out)
{
    lw_closed_segment(capsule, other->a, other->b, other->r, out);
}

// --- pairs of any shapes ---

static bool is_segment(const struct lw_shape *shape)
{
    return shape->kind == LW_SPHERE || shape->kind == LW_CAPSULE;
}

// The result seen from the other shape.
static void flip(struct lw_distance *out)
{
    for (int k = 0; k < 3; k++) {
        const double pa = out->pa[k];
        out->pa[k] = out->pb[k];
        out->pb[k] = pa;
        out->n[k] = -out->n[k];
    }
}

// A box or hull over a half-space: its lowest point is all that counts.
static void cloud_to_halfspace(const struct lw_shape *shape, const struct lw_shape *half, struct lw_distance *out)
{
    double room[LW_HULL_ROOM], lowest[3];
    const double down[3] = {-half->halfspace.m[0], -half->halfspace.m[1], -half->halfspace.m[2]};
    const struct lw_cloud cloud = lw_clouds_of(shape, shape->c, room);
    lw_cloud_point(&cloud, lw_cloud_support(&cloud, down), lowest);
    lw_vec_add_scaled(1, shape->c, lowest);
    struct lw_capsule point = {.r = shape->r};
    for (int k = 0; k < 3; k++)
        point.a[k] = point.b[k] = lowest[k];
    lw_closed_halfspace(&point, half, out);
}

static void clouds(const struct lw_shape *a, const struct lw_shape *b, struct lw_distance *out)
{
    double room_a[LW_HULL_ROOM], room_b[LW_HULL_ROOM];
    const struct lw_gjk_query query = lw_clouds_query(lw_clouds_of(a, b->c, room_a), lw_clouds_of(b, b->c, room_b));
    struct lw_simplex simplex = {.count = 0};
    lw_clouds_distance(&query, &simplex, (double[2]){a->r, b->r}, LW_EPA_CAP, out);
    lw_clouds_shift(b->c, out);
}

enum lw_status lw_distance_shapes(const struct lw_shape *a, const struct lw_shape *b, struct lw_distance *out)
{
    const bool half = a->kind == LW_HALFSPACE || b->kind == LW_HALFSPACE;
    const bool custom = a->kind == LW_CUSTOM || b->kind == LW_CUSTOM;
    if (half && (custom || a->kind == b->kind))
        return LW_E_ARGUMENT;
    if (is_segment(a)) {
        const struct lw_capsule capsule = lw_shape_capsule(a);
        lw_distance_link(&capsule, b, HUGE_VAL, NULL, out);
    } else if (is_segment(b)) {
        const struct lw_capsule capsule = lw_shape_capsule(b);
        lw_distance_link(&capsule, a, HUGE_VAL, NULL, out);
        flip(out);
    } else if (b->kind == LW_HALFSPACE) {
        cloud_to_halfspace(a, b, out);
    } else if (a->kind == LW_HALFSPACE) {
        cloud_to_halfspace(b, a, out);
        flip(out);
    } else if (custom) {
        lw_custom_distance(a, b, HUGE_VAL, out);
    } else {
        clouds(a, b, out);
    }
    return LW_OK;
}
