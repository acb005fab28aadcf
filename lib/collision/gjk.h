// SPDX-License-Identifier: BSD-3-Clause
// GJK: distance of the convex hulls of two clouds of points.
//
// Units    metres.
// Frames   both clouds in one frame, whose origin is the second one's centre: far from it digits are lost.
// Arrays   see support.h.
// Memory   none.
// Errors   none; bounded by the cap.
#ifndef LW_COLLISION_GJK_H
#define LW_COLLISION_GJK_H

#include "collision/simplex.h" // struct lw_simplex
#include "collision/support.h" // struct lw_cloud

enum { LW_GJK_CAP = 48 };

struct lw_gjk_query {
    struct lw_cloud a, b;
    double size; // m, bounds |x| over a plus |y| over b
    double far;  // m, a proven distance beyond this ends the search
    int cap;     // supports at most
};

struct lw_gjk_result {
    double bound;   // m, with FAR alone: proven lower bound of the distance
    int iterations; // supports
    int flags;      // of enum lw_distance_flag: CORE, FAR, CAPPED, STALLED
};

// Sets the points of a simplex from those of the clouds it names.
void lw_gjk_load(const struct lw_gjk_query *query, struct lw_simplex *simplex);

// Nearest points.
//   simplex  i/o  points to start from; count 0 = none. At the end v points from b to a; CORE: |v| is 0 or noise
void lw_gjk(const struct lw_gjk_query *query, struct lw_simplex *simplex, struct lw_gjk_result *out);

// Nearest point of the first cloud: the weighted sum of its points.
void lw_gjk_point(const struct lw_gjk_query *query, const struct lw_simplex *simplex, double qa[3]);

#endif
