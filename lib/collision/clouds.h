// SPDX-License-Identifier: BSD-3-Clause
// Cores as clouds of points, and the distance of two of them: GJK while they are apart, EPA when they overlap.
//
// Units    metres.
// Frames   clouds are relative to an origin near the second one; results are in the frame of the origin.
// Arrays   see support.h.
// Memory   the caller's.
// Errors   none.
#ifndef LW_COLLISION_CLOUDS_H
#define LW_COLLISION_CLOUDS_H

#include "collision/distance.h" // struct lw_distance, struct lw_shape
#include "collision/epa.h"      // LW_EPA_CAP
#include "collision/gjk.h"      // struct lw_gjk_query

// A query with no bound and the usual cap; `size` is found from the clouds.
struct lw_gjk_query lw_clouds_query(struct lw_cloud a, struct lw_cloud b);

// Core of a sphere, capsule, box or hull relative to an origin.
//   room  out  [LW_HULL_ROOM] holds the points
struct lw_cloud lw_clouds_of(const struct lw_shape *shape, const double origin[3], double *room);

// Distance of two swept clouds.
//   simplex  i/o  start, as in gjk.h
//   r        in   [2] m, radii of the first and of the second
//   epa_cap  in   iterations at most when they overlap
void lw_clouds_distance(const struct lw_gjk_query *query, struct lw_simplex *simplex, const double r[2], int epa_cap,
                        struct lw_distance *out);

// Moves the witness points of a result.
void lw_clouds_shift(const double by[3], struct lw_distance *out);

#endif
