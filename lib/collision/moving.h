// SPDX-License-Identifier: BSD-3-Clause
// Motion of an obstacle since it was seen, as a rigid motion between the world then and the world now. Instead of the
// obstacle, what looks at it is moved back, and the answer forth again: the snapshot stays as it is.
//
// Units    metres, seconds, ns where the name says so.
// Frames   base frame.
// Arrays   rotations row-major [9], points and vectors [3].
// Memory   plain data.
// Errors   none.
#ifndef LW_COLLISION_MOVING_H
#define LW_COLLISION_MOVING_H

#include "collision/distance.h" // struct lw_distance
#include "collision/snapshot.h" // struct lw_snapshot_item

#include <stdbool.h> // bool
#include <stdint.h>  // int64_t

// x then -> R (x - p) + p + shift now
struct lw_moving {
    double p[3], shift[3];
    bool turns; // else R is 1 and r is not set
    double r[9];
};

// Seconds that an obstacle is extrapolated by, 0..0.5.
//   seen_ns  in  >= 0
double lw_moving_age(int64_t seen_ns, int64_t time_ns);

// Motion of an extrapolated obstacle until time_ns. Cost: one sine and cosine if it turns.
struct lw_moving lw_moving_since(const struct lw_snapshot_item *item, int64_t time_ns);

// A point now, back to then; a direction of now, turned back to then.
void lw_moving_back(const struct lw_moving *moving, const double now[3], double then[3]);
void lw_moving_turn_back(const struct lw_moving *moving, const double now[3], double then[3]);

// A result of then, with its points and normal as they are now.
void lw_moving_forth(const struct lw_moving *moving, struct lw_distance *result);

// Velocity of a point x of an obstacle now.
//   moving  in  NULL = it is not extrapolated
void lw_moving_velocity(const struct lw_snapshot_item *item, const struct lw_moving *moving, const double x[3],
                        double velocity[3]);

#endif
