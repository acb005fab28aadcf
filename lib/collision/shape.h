// SPDX-License-Identifier: BSD-3-Clause
// Shapes: convex solids, each a core (point, segment, box, vertices) swept by a ball, placed in the world and ready for
// distance queries.
//
// Units    metres.
// Frames   a solid is given in a frame of its own; a shape is in the base frame of the arm.
// Arrays   rotations row-major [9], columns are the axes; a hull's vertices as x[n] y[n] z[n], relative to its centre.
// Memory   plain data. Vertices and custom objects belong to the caller, who points a copy of a shape to a copy of
// them. Errors   enum lw_status and a text; on failure the outputs are unchanged.
#ifndef LW_COLLISION_SHAPE_H
#define LW_COLLISION_SHAPE_H

#include "arm/arm.h"     // struct lw_pose
#include "base/status.h" // enum lw_status

#include <stdint.h> // uint32_t

enum lw_shape_kind { LW_SPHERE, LW_CAPSULE, LW_BOX, LW_HULL, LW_HALFSPACE, LW_CUSTOM, LW_SHAPE_KINDS };

// Vertices of a hull at most, and the doubles that hold them: each coordinate is padded to a multiple of four.
enum { LW_HULL_MAX = 64, LW_HULL_ROOM = 3 * LW_HULL_MAX };

// A segment swept by a ball; a == b is a sphere.
struct lw_capsule {
    double a[3], b[3];
    double r;
};

// A solid in its own frame, as a file, a message or a user gives it. Only the fields of its kind are read.
struct lw_solid {
    enum lw_shape_kind kind;
    double radius;           // m, >= 0: of a sphere or capsule, or the rounding of a box or hull
    double half_length;      // m, >= 0: capsule, half of its axis, along z
    double half[3];          // m, > 0: box, half extents
    double normal[3];        // half-space: out of the solid, length 1
    double offset;           // m, half-space: normal . x <= offset is solid
    int count;               // hull: 1..LW_HULL_MAX vertices; flat, collinear, duplicate and inner ones are welcome
    const double *vertex;    // m, hull: [3 * count] x y z of each
    const void *custom;      // custom: const struct lw_custom * (collision/custom.h)
    double custom_bound;     // m, > 0: custom, radius about its centre that holds its core
    double custom_centre[3]; // m, custom
};

// Cores in their place.
struct lw_core_segment { // a sphere has a == b, the centre
    double a[3], b[3];
};
struct lw_core_box {
    double axes[9], half[3];
};
struct lw_core_hull { // coordinate k of vertex i is vertex[k * padded + i], relative to the centre
    int count, padded;
    double reach; // m, largest distance of a vertex from the centre
    const double *vertex;
};
struct lw_core_halfspace { // m . x <= o
    double m[3], o;
};

// A solid in its place.
struct lw_shape {
    enum lw_shape_kind kind;
    uint32_t id;                        // key of warm starts together with the generation; 0 = none
    uint32_t generation;                // to be raised when vertices change, not when the shape moves
    double r;                           // m, radius of the ball that sweeps the core
    double c[3];                        // m, centre of the core
    double bound;                       // m, radius about c that holds the whole shape; infinite for a half-space
    union {                             // by kind
        struct lw_core_segment segment; // sphere, capsule
        struct lw_core_box box;
        struct lw_core_hull hull;
        struct lw_core_halfspace halfspace;
        const void *custom; // const struct lw_custom *
    };
};

// Vertices of one coordinate after padding.
static inline int lw_hull_padded(int count)
{
    return (count + 3) & ~3;
}

// Checks a solid and puts it into its place; id and generation are 0.
//   pose    in   frame of the solid in the base frame; axes orthonormal to 1e-3, then made so exactly
//   room    out  [3 * lw_hull_padded(count)] vertices, for hulls alone; it has to live as long as the shape
//   reason  out  why it failed, a constant text; may be NULL
// Fails LW_E_NOT_FINITE, LW_E_ARGUMENT.
LW_MUST_CHECK enum lw_status lw_shape_make(const struct lw_solid *solid, const struct lw_pose *pose, double *room,
                                           struct lw_shape *shape, const char **reason);

// Pose from a position and a quaternion w x y z, whose length may be off 1 by 1e-3. Fails as lw_shape_make.
LW_MUST_CHECK enum lw_status lw_pose_make(const double p[3], const double quaternion[4], struct lw_pose *pose);

// A sphere or capsule as the ends of its core and its radius.
struct lw_capsule lw_shape_capsule(const struct lw_shape *shape);

// A capsule as a shape. Nothing is checked.
struct lw_shape lw_shape_of_capsule(const struct lw_capsule *capsule);

#endif
