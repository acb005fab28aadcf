// SPDX-License-Identifier: BSD-3-Clause
// Rounding a link for the broad phase.
//
// Units    metres.
// Frames   see cull.h.
// Arrays   none.
// Memory   none.
// Errors   none.
#include "collision/cull.h"

#include "base/vec.h" // lw_vec_*

#include <math.h> // fabs

struct lw_cull lw_cull_link(const struct lw_capsule *link, double length)
{
    struct lw_cull cull = {.reach = 0};
    double axis[3], size = 0;
    lw_vec_sub(link->b, link->a, axis);
    const double per_length = length > 0 ? 1 / length : 0;
    for (int k = 0; k < 3; k++) {
        cull.m[k] = (float)(link->a[k] + 0.5 * axis[k]);
        cull.e[k] = (float)(per_length * axis[k]);
        size += fabs(link->a[k]) + fabs(link->b[k]);
    }
    // Rounding moves the axis by less than 4e-7 of its coordinates. The squared distance of a sphere has an error of
    // 5e-7 (half + distance)^2, which 1e-3 half in lw_cull_look and the 1e-6 in all radii outweigh.
    cull.half = (float)(0.5 * length);
    for (int k = 0; k < 3; k++)
        cull.side[k] = (float)(0.5 * fabs(axis[k]) * (1 + 1e-6));
    cull.thick = (float)(link->r * (1 + 1e-6) + 4e-7 * size);
    return cull;
}
