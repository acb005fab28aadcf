// SPDX-License-Identifier: BSD-3-Clause
// World as the tick sees it: obstacles of every shape in an order that makes looking for near ones cheap. Built off the
// real-time thread, then immutable: moving obstacles stand where they were seen, and queries account for their motion.
//
// Units    metres, m/s, rad/s, ns of the clock that the queries use.
// Frames   base frame of the arm.
// Arrays   see the fields.
// Memory   plain data of 10 MB, never on a stack. A copy by lw_snapshot_copy or of its bytes is a snapshot of its own.
// Errors   enum lw_status; a refused obstacle leaves the snapshot as it was.
#ifndef LW_COLLISION_SNAPSHOT_H
#define LW_COLLISION_SNAPSHOT_H

#include "base/stamp.h"      // struct lw_stamp
#include "base/status.h"     // enum lw_status
#include "collision/shape.h" // struct lw_shape

#include <stdint.h> // int64_t

// Obstacles, and vertices (padded) of all their hulls.
enum { LW_WORLD_MAX = 10000, LW_WORLD_VERTICES = 1 << 18 };

// Obstacles of a block, which are looked at together; blocks and groups of blocks, both filled up to whole ones.
enum { LW_WORLD_BLOCK = 16, LW_WORLD_BLOCKS = 640, LW_WORLD_GROUPS = 48 };

// How an obstacle moves on from the pose it was told with.
struct lw_motion {
    double v[3];        // m/s, of the origin of its pose
    double omega[3];    // rad/s, about that origin
    int64_t time_ns;    // when it was at its pose; 0 = not told: it is taken to stay there
    int64_t expires_ns; // from then on it is no more; 0 = never
};

enum lw_trait { LW_TRAIT_MOVES = 1, LW_TRAIT_EXTRAPOLATED = 2, LW_TRAIT_EXPIRES = 4 };

struct lw_snapshot_item {
    int traits;            // enum lw_trait: which fields of motion matter
    int vertex_at;         // hull: where its vertices are in the arena
    struct lw_shape shape; // hull: without vertices, see lw_snapshot_shape
    double p[3];           // m, origin of the pose
    double speed;          // m/s, extrapolated: the shape's centre is not faster
    struct lw_motion motion;
};

// Bounding spheres of obstacles, rounded up so that single precision loses none.
struct lw_snapshot_spheres {
    float x[LW_WORLD_MAX], y[LW_WORLD_MAX], z[LW_WORLD_MAX], r[LW_WORLD_MAX];
};

// Bounding boxes along the axes, half[k] in x y z, rounded up as well: blocks first, groups from LW_WORLD_BLOCKS on.
struct lw_snapshot_boxes {
    float x[LW_WORLD_BLOCKS + LW_WORLD_GROUPS], y[LW_WORLD_BLOCKS + LW_WORLD_GROUPS];
    float z[LW_WORLD_BLOCKS + LW_WORLD_GROUPS], half[3][LW_WORLD_BLOCKS + LW_WORLD_GROUPS];
    double speed[LW_WORLD_BLOCKS + LW_WORLD_GROUPS];    // m/s, of the fastest extrapolated obstacle
    int64_t time_ns[LW_WORLD_BLOCKS + LW_WORLD_GROUPS]; // of the extrapolated one that was seen first
};

// Used while it is built.
struct lw_snapshot_order {
    uint64_t key;
    int from;
};

struct lw_snapshot {
    // What commands echo of the world, filled in by whoever builds it; 0 at first.
    int64_t version;
    struct lw_stamp last;
    int last_channel;
    int64_t digest;

    int count;        // obstacles
    int bounded;      // of them stand first, in Morton order and by id; half-spaces follow, by id
    int blocks;       // of bounded ones, 16 each
    int groups;       // of blocks, 16 each
    int extrapolated; // obstacles
    int expiring;     // obstacles
    int vertices;     // places taken in the arena
    double speed_max; // m/s, no surface point is faster (of a half-space: none within 3 m of the base)

    struct lw_snapshot_item item[LW_WORLD_MAX];
    struct lw_snapshot_spheres sphere;
    struct lw_snapshot_boxes box;
    int64_t expiry[LW_WORLD_MAX]; // ns, of the expiring ones, ascending
    struct lw_snapshot_order order[2][LW_WORLD_MAX];
    double arena[3 * LW_WORLD_VERTICES];
};

// Empties a snapshot, in fixed time. Needed before the first use too.
void lw_snapshot_begin(struct lw_snapshot *s);

// Adds an obstacle.
//   id          in  > 0, not twice in a snapshot
//   generation  in  to be raised when the vertices of the id change
//   motion      in  NULL = it stays for ever
// Fails LW_E_FULL when there is no room, LW_E_ARGUMENT, LW_E_NOT_FINITE as lw_shape_make.
LW_MUST_CHECK enum lw_status lw_snapshot_add(struct lw_snapshot *s, int id, uint32_t generation,
                                             const struct lw_solid *solid, const struct lw_pose *pose,
                                             const struct lw_motion *motion);

// Puts the obstacles in order; then it is ready. The result does not depend on the order they were added in, but for
// the places of vertices. Cost: n log n.
void lw_snapshot_end(struct lw_snapshot *s);

// Copies what is used.
void lw_snapshot_copy(const struct lw_snapshot *from, struct lw_snapshot *to);

// Number of obstacles that have not expired.
int lw_snapshot_present(const struct lw_snapshot *s, int64_t time_ns);

// Shape i of 0..count-1 as it was told, with its vertices.
struct lw_shape lw_snapshot_shape(const struct lw_snapshot *s, int i);

#endif
