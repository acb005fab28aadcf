// SPDX-License-Identifier: BSD-3-Clause
// Certificate of a distance: the gap between the two shapes seen along the normal, a lower bound that no search has
// part in.
//
// Units    metres.
// Frames   relative to the second shape's centre.
// Arrays   see distance.h.
// Memory   none.
// Errors   none.
#include "base/vec.h"           // lw_vec_*
#include "collision/custom.h"   // lw_custom_reach
#include "collision/distance.h" // lw_distance_gap

#include <math.h> // fabs, HUGE_VAL

// Largest n . (x - origin) over the core of a shape.
static double reach(const struct lw_shape *shape, const double n[3], const double origin[3])
{
    double from[3], most = -HUGE_VAL;
    lw_vec_sub(shape->c, origin, from);
    const double centre = lw_vec_dot(n, from);
    switch (shape->kind) {
    case LW_SPHERE: return centre;
    case LW_CAPSULE:
        for (int end = 0; end < 2; end++) {
            lw_vec_sub(end ? shape->segment.b : shape->segment.a, origin, from);
            const double height = lw_vec_dot(n, from);
            most = height > most ? height : most;
        }
        return most;
    case LW_BOX:
        most = centre;
        for (int i = 0; i < 3; i++)
            most += shape->box.half[i] *
                    fabs(n[0] * shape->box.axes[i] + n[1] * shape->box.axes[3 + i] + n[2] * shape->box.axes[6 + i]);
        return most;
    case LW_HULL:
        for (int i = 0; i < shape->hull.count; i++) {
            const double *x = shape->hull.vertex + i;
            const double height = n[0] * x[0] + n[1] * x[shape->hull.padded] + n[2] * x[2 * shape->hull.padded];
            most = height > most ? height : most;
        }
        return centre + most;
    case LW_HALFSPACE: // bounded in one direction alone
        if (n[0] != shape->halfspace.m[0] || n[1] != shape->halfspace.m[1] || n[2] != shape->halfspace.m[2])
            return HUGE_VAL;
        return shape->halfspace.o - lw_vec_dot(n, origin);
    default: return lw_custom_reach(shape, n, origin);
    }
}

double lw_distance_shapes_gap(const struct lw_shape *a, const struct lw_shape *b, const struct lw_distance *result)
{
    if (result->flags & LW_DISTANCE_FAR)
        return 0;
    if (result->flags & LW_DISTANCE_NO_NORMAL)
        return HUGE_VAL;
    const double *n = result->n;
    const double *origin = a->kind == LW_HALFSPACE ? a->c : b->c;
    const double back[3] = {-n[0], -n[1], -n[2]};
    const double lower = -reach(a, back, origin) - a->r - reach(b, n, origin) - b->r;
    return result->d - lower;
}

double lw_distance_gap(const struct lw_capsule *link, const struct lw_shape *shape, const struct lw_distance *result)
{
    const struct lw_shape as_shape = lw_shape_of_capsule(link);
    return lw_distance_shapes_gap(&as_shape, shape, result);
}
