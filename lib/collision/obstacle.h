// SPDX-License-Identifier: BSD-3-Clause
// Obstacle: one convex solid as a message, a scene or a tool tells it, and the changes of the set of them that a source
// sends.
//
// Units    metres, radians, seconds; ns and ms where a name says so.
// Frames   base frame of the arm; vertices and sizes in the obstacle's own.
// Arrays   quaternions w x y z; vertices x y z of each.
// Memory   plain data.
// Errors   enum lw_status and a text.
#ifndef LW_COLLISION_OBSTACLE_H
#define LW_COLLISION_OBSTACLE_H

#include "base/stamp.h"      // struct lw_stamp
#include "collision/shape.h" // enum lw_shape_kind, struct lw_solid

enum { LW_CHANGE_MAX = 32 };

// m, m/s, rad/s: no value of an obstacle is beyond this.
#define LW_OBSTACLE_LIMIT 100.0

struct lw_obstacle {
    int id;                   // > 0, unique on the whole bus: whoever sends an id last owns it
    enum lw_shape_kind shape; // LW_SPHERE to LW_HALFSPACE
    double p[3];              // m, origin of the shape: centre; of a half-space any point of its face
    double quat[4];           // w x y z, base <- shape; a capsule lies along z, a half-space is solid below its z = 0
    double radius;            // m, >= 0: of a sphere (0 = a point) or capsule; rounding of a box or hull
    double size[3];           // m: box half extents > 0; capsule: half length >= 0 first; what is left is ignored
    double v[3], omega[3];    // m/s and rad/s about p, base frame
};

enum lw_change_op { LW_UPSERT, LW_REMOVE, LW_REPLACE, LW_CLEAR };

// Which channel a change came by; numbers are those of lcmtypes/joint_command_t.lcm.
enum lw_world_channel { LW_WORLD_NONE, LW_WORLD_OBSTACLES, LW_WORLD_HULL };

// One change of the set, as a source sends it: obstacles_t, or hull_t, the UPSERT of one hull with its vertices.
struct lw_obstacle_change {
    struct lw_stamp stamp;
    int64_t owner;    // session that the obstacles belong to; only where the controller tells its own set
    int64_t time_ns;  // when the obstacles were where it says, controller's clock; 0 = not told: not extrapolated
    int valid_for_ms; // they expire this long after time_ns; 0 = until removed; else time_ns is told
    enum lw_change_op op;
    int count;
    struct lw_obstacle obstacle[LW_CHANGE_MAX];
    int vertex_count;               // > 0 in a hull_t alone: vertices of obstacle[0]
    double vertex[3 * LW_HULL_MAX]; // m
};

// The solid of an obstacle.
//   vertex  in  [3 * count] of a hull; it has to live as long as the solid
struct lw_solid lw_obstacle_solid(const struct lw_obstacle *obstacle, const double *vertex, int count);

// Checks one obstacle: finite, no value beyond LW_OBSTACLE_LIMIT, a unit quaternion (1 +- 1e-3), sizes as its shape has
// them. Values that its shape does not have are not looked at.
//   vertex  in   [3 * count] of a hull; count 0 = an entry that names a hull told before
//   reason  out  why it failed, a constant text; may be NULL
// Fails LW_E_NOT_FINITE, LW_E_ARGUMENT.
LW_MUST_CHECK enum lw_status lw_obstacle_check(const struct lw_obstacle *obstacle, const double *vertex, int count,
                                               const char **reason);

// ns, when the obstacles of a change expire; 0 = never.
int64_t lw_change_expires_ns(const struct lw_obstacle_change *change);

// Channel of a change.
enum lw_world_channel lw_change_channel(const struct lw_obstacle_change *change);

#endif
