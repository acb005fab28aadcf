// SPDX-License-Identifier: BSD-3-Clause
// Order of a snapshot: obstacles along a Morton curve, so that neighbours stand together, and boxes around sixteen
// obstacles and around sixteen such blocks.
//
// Units    metres.
// Frames   base frame.
// Arrays   see snapshot.h.
// Memory   the snapshot's own.
// Errors   none.
#ifndef LW_COLLISION_ORDER_H
#define LW_COLLISION_ORDER_H

#include "collision/snapshot.h" // struct lw_snapshot

// Sorts the items and lists when they expire.
void lw_order_obstacles(struct lw_snapshot *s);

// Bounds sorted items by spheres and boxes.
void lw_order_boxes(struct lw_snapshot *s);

#endif
