// SPDX-License-Identifier: BSD-3-Clause
// Whole arm against the world and against itself: every pair in range, or the nearest ones, with witness points,
// normals and the speed of the obstacle's point.
//
// Units    metres, m/s, ns.
// Frames   base frame.
// Arrays   [3] x y z.
// Memory   the caller's; a list is 130 kB, a table of warm starts 120 kB. No function here allocates or keeps state.
// Errors   none. What is not a number counts as near and shows in d: a caller has to check d.
#ifndef LW_COLLISION_NEAR_H
#define LW_COLLISION_NEAR_H

#include "collision/body.h"     // struct lw_body, struct lw_placed
#include "collision/distance.h" // struct lw_distance, struct lw_warm
#include "collision/snapshot.h" // struct lw_snapshot

#include <stdbool.h> // bool
#include <stdint.h>  // int64_t

enum { LW_NEAR_MAX = 1024, LW_WARM_SLOTS = 512 };

// An obstacle is taken to keep its velocity for so long after it was seen, and to stand still from then on.
enum { LW_EXTRAPOLATE_MAX_NS = 500000000 };

struct lw_near {
    struct lw_distance distance; // at the time asked for; n from the obstacle, or the other part, to the part
    double velocity[3];          // m/s, of the obstacle's point pb; 0 for a self pair
    int part;                    // of the body
    int obstacle;                // id; 0 = self pair, or none
    int other;                   // self pair: the other part; else -1
    bool fixed;                  // set by whoever knows the joints: they hardly change d; false at first
};

struct lw_near_list {
    int count, needed; // needed > LW_NEAR_MAX: it did not hold all
    struct lw_near pair[LW_NEAR_MAX];
};

// A nearest pair: the obstacle's index, as long as it is the one with that id. All zero = none.
struct lw_warm_pair {
    int part, index, id;
};

// Where the searches of hulls ended, by part and id & (LW_WARM_SLOTS - 1), and what was nearest last time. All zero =
// nowhere. Two obstacles in one place, or a new order of the snapshot, cost time only. Results of a warm search may
// differ from those of a cold one in the last bits: it belongs to the state that a replay starts from.
struct lw_warm_table {
    struct lw_warm entry[LW_BODY_MAX][LW_WARM_SLOTS];
    struct lw_warm_pair each[LW_BODY_MAX], smallest;
};

// Moving obstacles are where they will be at time_ns: their age is time_ns - motion.time_ns within 0 and 0.5 s. Expired
// ones are left out.
struct lw_near_query {
    const struct lw_body *body;
    const struct lw_placed *placed;
    const struct lw_snapshot *world;
    int64_t time_ns;
    double d_max;               // m; HUGE_VAL = no bound
    struct lw_warm_table *warm; // i/o, may be NULL
};

// All pairs of a part and an obstacle with d <= d_max, by part, then in the order of the snapshot. Replaces the list.
void lw_near_range(const struct lw_near_query *query, struct lw_near_list *out);

// Appends the self pairs with d <= d_max, in the order of the body.
void lw_near_self(const struct lw_body *body, const struct lw_placed *placed, double d_max, struct lw_near_list *out);

// Nearest obstacle of each part within d_max, of equally near ones the one with the lowest id. Where there is none,
// obstacle is 0 and d is d_max.
void lw_near_each(const struct lw_near_query *query, struct lw_near out[LW_BODY_MAX]);

// The smallest of them, of equal ones the first part's.
void lw_near_smallest(const struct lw_near_query *query, struct lw_near *out);

#endif
