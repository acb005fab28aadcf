// SPDX-License-Identifier: BSD-3-Clause
// Distance of two swept clouds of points.
//
// Units    metres.
// Frames   see clouds.h.
// Arrays   see clouds.h.
// Memory   a moved copy of the first cloud on the stack, when the two overlap.
// Errors   none.
#include "collision/clouds.h"

#include "base/vec.h"         // lw_vec_*
#include "collision/closed.h" // lw_closed_apart, lw_closed_core

#include <math.h> // sqrt, HUGE_VAL

// How far apart overlapping cores are moved to find the witness points.
static const double clearance = 0.01;

static double reach(const struct lw_cloud *cloud)
{
    double square = 0;
    for (int i = 0; i < cloud->count; i++) {
        double x[3];
        lw_cloud_point(cloud, i, x);
        const double s = lw_vec_dot(x, x);
        square = s > square ? s : square;
    }
    return sqrt(square);
}

struct lw_gjk_query lw_clouds_query(struct lw_cloud a, struct lw_cloud b)
{
    return (struct lw_gjk_query){.a = a, .b = b, .size = reach(&a) + reach(&b), .far = HUGE_VAL, .cap = LW_GJK_CAP};
}

// Point i of a core relative to the shape's centre.
static void core_point(const struct lw_shape *shape, int i, double out[3])
{
    switch (shape->kind) {
    case LW_BOX:
        for (int k = 0; k < 3; k++)
            out[k] = 0;
        for (int axis = 0; axis < 3; axis++)
            for (int k = 0; k < 3; k++)
                out[k] +=
                    (i >> axis & 1 ? shape->box.half[axis] : -shape->box.half[axis]) * shape->box.axes[3 * k + axis];
        break;
    case LW_HULL:
        lw_cloud_point(&(struct lw_cloud){shape->hull.vertex, shape->hull.count, shape->hull.padded}, i, out);
        break;
    default: lw_vec_sub(i == 0 ? shape->segment.a : shape->segment.b, shape->c, out); break;
    }
}

struct lw_cloud lw_clouds_of(const struct lw_shape *shape, const double origin[3], double *room)
{
    const int count = shape->kind == LW_HULL ? shape->hull.count : shape->kind == LW_BOX ? 8 : 2;
    struct lw_cloud cloud = {.x = room, .count = count, .padded = count == 2 ? 2 : lw_hull_padded(count)};
    double shift[3], point[3];
    lw_vec_sub(shape->c, origin, shift);
    for (int i = 0; i < cloud.padded; i++) {
        core_point(shape, i < count ? i : 0, point);
        lw_vec_add_scaled(1, shift, point);
        for (int k = 0; k < 3; k++)
            room[k * cloud.padded + i] = point[k];
    }
    return cloud;
}

// A copy of a cloud, moved.
static struct lw_cloud move(const struct lw_cloud *cloud, const double by[3], double room[LW_HULL_ROOM])
{
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < cloud->padded; i++)
            room[k * cloud->padded + i] = cloud->x[k * cloud->padded + i] + by[k];
    return (struct lw_cloud){room, cloud->count, cloud->padded};
}

// Depth by EPA; the witness is nearest once the first cloud has moved out.
static void overlap(const struct lw_gjk_query *query, const double r[2], int epa_cap, struct lw_distance *out)
{
    struct lw_epa_result epa;
    struct lw_gjk_result apart;
    struct lw_simplex simplex = {.count = 0};
    double room[LW_HULL_ROOM] = {0}, n[3], back[3], qa[3], by[3];
    lw_epa(query, epa_cap, &epa);
    for (int k = 0; k < 3; k++) {
        n[k] = -epa.out[k];
        by[k] = (epa.depth + clearance) * n[k];
        back[k] = -by[k];
    }
    const struct lw_gjk_query moved = lw_clouds_query(move(&query->a, by, room), query->b);
    lw_gjk(&moved, &simplex, &apart);
    lw_gjk_point(&moved, &simplex, qa);
    lw_vec_add_scaled(1, back, qa);
    lw_closed_core(qa, n, epa.depth, r, out);
    out->flags |= epa.flags;
    out->iterations = epa.iterations;
}

void lw_clouds_distance(const struct lw_gjk_query *query, struct lw_simplex *simplex, const double r[2], int epa_cap,
                        struct lw_distance *out)
{
    struct lw_gjk_result gjk;
    double qa[3];
    lw_gjk(query, simplex, &gjk);
    if (gjk.flags & LW_DISTANCE_FAR) {
        *out = (struct lw_distance){.d = gjk.bound - r[0] - r[1], .flags = LW_DISTANCE_FAR | LW_DISTANCE_NO_NORMAL};
    } else if (gjk.flags & LW_DISTANCE_CORE) {
        overlap(query, r, epa_cap, out);
    } else {
        lw_gjk_point(query, simplex, qa);
        lw_closed_apart(qa, simplex->v, r[0], r[1], out);
        out->flags = gjk.flags;
    }
    out->iterations += gjk.iterations;
}

void lw_clouds_shift(const double by[3], struct lw_distance *out)
{
    if (out->flags & LW_DISTANCE_NO_NORMAL)
        return;
    lw_vec_add_scaled(1, by, out->pa);
    lw_vec_add_scaled(1, by, out->pb);
}
