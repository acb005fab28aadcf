// SPDX-License-Identifier: BSD-3-Clause
// Worlds of balls, as the tick sees them.
//
// Units    metres.
// Frames   base frame.
// Arrays   [3] x y z.
// Memory   the caller's.
// Errors   cmocka's.
#ifndef LW_TESTS_BALLS_H
#define LW_TESTS_BALLS_H

#include "collision/snapshot.h"
#include "helpers.h"

// The world becomes `count` balls of one radius with ids from `id`; what commands echo of it stays.
static inline void put_balls(struct lw_snapshot *world, int id, const double (*at)[3], int count, double radius)
{
    const struct lw_stamp last = world->last;
    const int64_t version = world->version, digest = world->digest;
    lw_snapshot_begin(world);
    for (int i = 0; i < count; i++) {
        const struct lw_solid ball = {.kind = LW_SPHERE, .radius = radius};
        struct lw_pose pose = {.r = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
        memcpy(pose.p, at[i], sizeof pose.p);
        assert_int_equal(lw_snapshot_add(world, id + i, 1, &ball, &pose, NULL), LW_OK);
    }
    lw_snapshot_end(world);
    world->version = version;
    world->last = last;
    world->digest = digest;
}

// The world becomes one ball.
static inline void put_ball(struct lw_snapshot *world, int id, const double at[3], double radius)
{
    const double one[1][3] = {{at[0], at[1], at[2]}};
    put_balls(world, id, one, 1, radius);
}

#endif
