// SPDX-License-Identifier: BSD-3-Clause
// Body of the arm: the capsules that hold its links, a tool on the flange, and the pairs of them that may collide.
//
// Units    metres.
// Frames   parts and tool in the frame of their link (6 = flange); placed ones in the base frame.
// Arrays   parts in order of their links, the tool last; points [3] x y z.
// Memory   plain data.
// Errors   none; a tool is to be checked with lw_tool_check first.
#ifndef LW_COLLISION_BODY_H
#define LW_COLLISION_BODY_H

#include "arm/arm.h"         // enum lw_robot, struct lw_pose
#include "collision/cull.h"  // struct lw_cull
#include "collision/shape.h" // struct lw_capsule, LW_HULL_*

#include <stdint.h> // uint8_t

enum { LW_BODY_MAX = 12, LW_BODY_PAIRS = 32 };

// What stands for the arm: the origins of frames 2..6 as points (the one of frame 1 never moves), one capsule a link,
// or three capsules each for upper arm and forearm.
enum lw_body_model { LW_BODY_JOINTS, LW_BODY_CAPSULES, LW_BODY_CAPSULES_FINE };

enum lw_tool_kind { LW_TOOL_NONE, LW_TOOL_CAPSULE, LW_TOOL_HULL };

// What is bolted to the flange, in frame 6.
struct lw_tool {
    enum lw_tool_kind kind;
    struct lw_capsule capsule;      // capsule
    double radius;                  // m, >= 0: hull, rounding; 1 cm or more keeps normals good at contact
    int count;                      // hull: 1..LW_HULL_MAX vertices
    double vertex[3 * LW_HULL_MAX]; // m, hull: x y z of each
};

struct lw_body_part {
    int link;                  // 1..6
    struct lw_capsule capsule; // m, in the frame of the link; of a tool hull: one that holds it
};

// Two parts whose distance matters.
struct lw_body_pair {
    uint8_t part, other;
};

// A tool hull ready to be placed: vertices as in shape.h, relative to the centre.
struct lw_body_hull {
    int count, padded;
    double centre[3], reach;
    double vertex[LW_HULL_ROOM];
};

struct lw_body {
    int count;
    struct lw_body_part part[LW_BODY_MAX];
    double length[LW_BODY_MAX]; // m, of the capsules' axes
    int pair_count; // links 1-3 1-4 1-5 1-6 2-4 2-5 2-6 3-6, the tool like link 6; the model of joints has none
    struct lw_body_pair pair[LW_BODY_PAIRS];
    int tool_part; // -1 = no tool
    struct lw_tool tool;
    struct lw_body_hull hull; // of a tool that is one
    double lever[LW_NJ];      // m, no point of a part that joint i+1 moves is farther from its axis
};

// A body at one configuration.
struct lw_placed {
    struct lw_capsule capsule[LW_BODY_MAX];
    struct lw_cull cull[LW_BODY_MAX];                 // the capsules for the broad phase
    double tool_centre[3], tool_vertex[LW_HULL_ROOM]; // of a tool hull
};

// Whether a tool is one: finite, sizes and count in range, a capsule with a radius > 0.
//   reason  out  why it is not, a constant text; may be NULL
// Fails LW_E_NOT_FINITE, LW_E_ARGUMENT.
LW_MUST_CHECK enum lw_status lw_tool_check(const struct lw_tool *tool, const char **reason);

// Body of a robot.
//   tool  in  checked; NULL = none
void lw_body_make(enum lw_robot robot, enum lw_body_model model, const struct lw_tool *tool, struct lw_body *body);

// Puts a body where the arm is.
//   frame  in  [6] from lw_arm_fk
void lw_body_place(const struct lw_body *body, const struct lw_pose frame[LW_NJ], struct lw_placed *placed);

// Puts one part, its capsule already in `placed`, before the broad phase; lw_body_place does it for all.
//   length  in  m, of the capsule's axis
void lw_body_mark(struct lw_placed *placed, int part, double length);

// The placed hull of a body whose tool is one; its vertices stay in `placed`.
struct lw_shape lw_body_tool_shape(const struct lw_body *body, const struct lw_placed *placed);

#endif
