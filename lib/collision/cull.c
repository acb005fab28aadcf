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

struct lw_cull lw_cull_link(const struct lw_capsule *link, double d_max)
{
    struct lw_cull cull;
    double axis[3], size = 0;
    lw_vec_sub(link->b, link->a, axis);
    const double length = lw_vec_norm(axis);
    for (int k = 0; k < 3; k++) {
        cull.m[k] = (float)(link->a[k] + 0.5 * axis[k]);
        cull.e[k] = (float)(length > 0 ? axis[k] / length : 0);
        size += fabs(link->a[k]) + fabs(link->b[k]);
    }
    cull.half = (float)(0.5 * length);
    // Rounding moves the axis by less than 4e-7 of its coordinates.
    cull.thick = (float)(link->r * (1 + 1e-6) + 4e-7 * size);
    lw_cull_look(&cull, d_max);
    return cull;
}
