// SPDX-License-Identifier: BSD-3-Clause
// World: the set of obstacles that the controller believes in, merged from messages of any number of sources.
//
// Units    metres.
// Frames   base frame of the arm.
// Arrays   obstacles in no particular order; ids are unique.
// Memory   fixed capacity, plain data: a copy is a snapshot.
// Errors   enum lw_status; a change is taken whole or not at all.
#ifndef LW_COLLISION_WORLD_H
#define LW_COLLISION_WORLD_H

#include "base/status.h"        // enum lw_status
#include "collision/obstacle.h" // struct lw_obstacle, struct lw_obstacle_change
#include "collision/snapshot.h" // struct lw_snapshot

enum { LW_REGISTRY_MAX = 256, LW_SENDERS_MAX = 32 };

// Newest messages of a sender: its numbers count by channel.
struct lw_sender {
    int64_t session;
    int64_t seq[LW_WORLD_HULL + 1]; // by enum lw_world_channel
};

struct lw_world {
    int64_t version;      // number of changes of the set so far; 0 = nothing heard
    struct lw_stamp last; // session and seq of the newest message taken in
    int last_channel;     // enum lw_world_channel of that message
    int64_t digest;       // of the obstacles, in their order
    int count;
    struct lw_obstacle obstacle[LW_REGISTRY_MAX];
    int64_t owner[LW_REGISTRY_MAX];          // session that sent the obstacle last
    struct lw_sender sender[LW_SENDERS_MAX]; // senders heard last; the oldest makes room
    int next_sender;
};

// Applies a change. The version grows only when the set really differs; a repeated message changes nothing.
// An id belongs to the source that sent it last; REMOVE and CLEAR reach obstacles of every source. A message that comes
// again is noted as the newest one heard, because its sender waits for that, and changes nothing.
// Fails LW_E_OLD when its source has sent a newer message already, LW_E_FULL when the result would exceed
// LW_REGISTRY_MAX, LW_E_UNKNOWN for a hull that is named without vertices and not there; the world is unchanged then.
// Cost: O(changes * count).
LW_MUST_CHECK enum lw_status lw_world_apply(struct lw_world *world, const struct lw_obstacle_change *change);

// The world as the tick sees it. Cost: n log n.
void lw_world_build(const struct lw_world *world, struct lw_snapshot *snapshot);

#endif
