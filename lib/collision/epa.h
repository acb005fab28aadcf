// SPDX-License-Identifier: BSD-3-Clause
// EPA: how deep the convex hulls of two clouds of points overlap, with fixed pools.
//
// Units    metres.
// Frames   as in gjk.h.
// Arrays   see support.h.
// Memory   pools of about 11 kB on the stack.
// Errors   none; bounded. A full pool ends the search with a depth that is enough to part the two, if not the least
// one.
#ifndef LW_COLLISION_EPA_H
#define LW_COLLISION_EPA_H

#include "collision/gjk.h" // struct lw_gjk_query

enum { LW_EPA_CAP = 92 };

struct lw_epa_result {
    double depth;   // m, moving a by depth against `out` parts the hulls
    double out[3];  // unit
    int iterations; // supports after the first ones
    int flags;      // of enum lw_distance_flag: 0 or STALLED
};

// Least motion that parts two clouds whose hulls overlap or touch.
//   cap  in  iterations at most, up to LW_EPA_CAP
void lw_epa(const struct lw_gjk_query *query, int cap, struct lw_epa_result *out);

#endif
