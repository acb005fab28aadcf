// SPDX-License-Identifier: BSD-3-Clause
// Tell: the whole set of obstacles as messages that anybody can rebuild it from. Obstacles of one owner, one time and
// one expiry share a message; each hull has one of its own.
//
// Units    ns of the clock that the sources tell times by.
// Frames   base frame of the arm.
// Arrays   none.
// Memory   plain data of 0.4 MB. The world may change between two messages: what has gone is left out.
// Errors   none.
#ifndef LW_CONTROLLER_TELL_H
#define LW_CONTROLLER_TELL_H

#include "collision/world.h" // struct lw_world

#include <stdbool.h> // bool

struct lw_tell {
    int count, next;
    struct lw_tell_place {
        int64_t owner, time_ns, expires_ns;
        int id;
        bool hull;
    } place[LW_WORLD_MAX];
};

// Starts to tell a world: hulls last, all else by owner, time and expiry, then by id. What has expired is left out.
//   now_ns  in  0 = nothing has
void lw_tell_begin(struct lw_tell *tell, const struct lw_world *world, int64_t now_ns);

// Makes the next message: an UPSERT, with `vertex_count` > 0 of a hull, its owner in `owner`, its stamp 0. False when
// all is told; *change is undefined then.
bool lw_tell_next(struct lw_tell *tell, const struct lw_world *world, struct lw_obstacle_change *change);

#endif
