// SPDX-License-Identifier: BSD-3-Clause
// Three-vectors as plain arrays.
//
// Units    of the caller.
// Frames   all arguments of a call are in one frame.
// Arrays   [3] x y z. The result may alias an argument, except in lw_vec_cross.
// Memory   none.
// Errors   none; NaN and inf pass through.
#ifndef LW_BASE_VEC_H
#define LW_BASE_VEC_H

#include <math.h>    // sqrt, isfinite
#include <stdbool.h> // bool

static inline double lw_vec_dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline double lw_vec_norm(const double a[3])
{
    return sqrt(lw_vec_dot(a, a));
}

static inline void lw_vec_sub(const double a[3], const double b[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = a[i] - b[i];
}

// out += scale * a
static inline void lw_vec_add_scaled(double scale, const double a[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] += scale * a[i];
}

static inline void lw_vec_cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

// True when all n values are finite.
static inline bool lw_all_finite(const double *values, int n)
{
    for (int i = 0; i < n; i++)
        if (!isfinite(values[i]))
            return false;
    return true;
}

#endif
