// SPDX-License-Identifier: BSD-3-Clause
// Overlap of a segment and a box by separating axes: exact, because the difference of the two has no other faces.
//
// Units    metres.
// Frames   axes of the box, origin at its centre.
// Arrays   see closed.h.
// Memory   none.
// Errors   none.
#include "collision/closed.h"

#include <math.h>   // sqrt, fabs, HUGE_VAL
#include <string.h> // memcpy, memset

// Directions u x e_i shorter than this against u, squared, are left out: there a face does as well.
static const double parallel_square = 1e-12;

// Keeps the smaller depth and its direction.
static void keep_smaller(double depth, const double n[3], double *best, double best_n[3])
{
    if (depth >= *best)
        return;
    *best = depth;
    memcpy(best_n, n, 3 * sizeof *n);
}

double lw_sat_box(const double x0[3], const double x1[3], const double half[3], double n[3])
{
    double best = HUGE_VAL, u[3];
    lw_vec_sub(x1, x0, u);
    memset(n, 0, 3 * sizeof *n);

    // Faces: how far the segment's last point has to move out.
    for (int i = 0; i < 3; i++) {
        double face[3] = {0};
        face[i] = 1;
        keep_smaller(half[i] - (x0[i] < x1[i] ? x0[i] : x1[i]), face, &best, n);
        face[i] = -1;
        keep_smaller((x0[i] > x1[i] ? x0[i] : x1[i]) + half[i], face, &best, n);
    }

    // Edges of the box against the segment.
    const double uu = lw_vec_dot(u, u);
    for (int i = 0; i < 3; i++) {
        double edge[3] = {0}, across[3];
        edge[i] = 1;
        lw_vec_cross(u, edge, across);
        const double square = lw_vec_dot(across, across);
        if (square <= parallel_square * uu)
            continue;
        const double s = lw_vec_dot(x0, across), length = s < 0 ? -sqrt(square) : sqrt(square);
        double reach = 0;
        for (int k = 0; k < 3; k++) {
            across[k] /= length;
            reach += half[k] * fabs(across[k]);
        }
        keep_smaller(reach - lw_vec_dot(x0, across), across, &best, n);
    }
    return best;
}
