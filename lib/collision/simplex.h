// SPDX-License-Identifier: BSD-3-Clause
// Simplex of up to four points of a difference of two convex sets, and its point nearest to the origin, by signed
// volumes from cross products.
//
// Units    metres.
// Frames   of the difference.
// Arrays   [3] x y z.
// Memory   plain data.
// Errors   none; flat, needle-like and repeated points are welcome.
#ifndef LW_COLLISION_SIMPLEX_H
#define LW_COLLISION_SIMPLEX_H

#include <stdbool.h> // bool
#include <stdint.h>  // uint8_t

struct lw_simplex {
    int count;           // 1..4
    double w[4][3];      // m, points
    uint8_t a[4], b[4];  // where each comes from: point a of the first set less point b of the second
    double lambda[4];    // weights of v: positive, sum 1
    double v[3], square; // m, m2: nearest point, and its squared length
};

// Nearest point of the simplex; points it does not need are dropped. Four points stay only when the origin is inside
// them; then v is 0.
// Returns false, and leaves all but the number of points as it was, when the square does not fall below `below`: then
// the last point is dropped.
bool lw_simplex_reduce(struct lw_simplex *simplex, double below);

#endif
