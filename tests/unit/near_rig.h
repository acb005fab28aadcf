// SPDX-License-Identifier: BSD-3-Clause
// Random worlds and arms, and distances of theirs by trying every pair, for the tests of snapshot and near.
//
// Units    metres, seconds, ns where the name says so.
// Frames   base frame.
// Arrays   see the fields.
// Memory   static, too large for a stack.
// Errors   cmocka's.
#ifndef LW_TESTS_NEAR_RIG_H
#define LW_TESTS_NEAR_RIG_H

#include "base/vec.h"       // lw_vec_*
#include "collision/near.h" // lw_near_*
#include "helpers.h"

#define SECOND INT64_C(1000000000)

// What one obstacle was added with.
struct told {
    int id;
    uint32_t generation;
    struct lw_solid solid;
    struct lw_pose pose;
    struct lw_motion motion;
    double vertex[3 * LW_HULL_MAX];
};

enum { TOLD_MAX = 3000 };

struct near_rig {
    struct random random;
    int count;
    struct told told[TOLD_MAX];
    struct lw_snapshot world, later;
    struct lw_body body;
    struct lw_placed placed;
    struct lw_warm_table warm;
    struct lw_near_list list;
};

static inline struct near_rig *near_rig(uint64_t seed)
{
    static struct near_rig rig;
    memset(&rig.warm, 0, sizeof rig.warm);
    rig.random.state = seed;
    rig.count = 0;
    return &rig;
}

// --- obstacles ---

static inline void rig_turn(struct random *random, struct lw_pose *pose)
{
    double q[4], square;
    do {
        random_fill(random, -1, 1, q, 4);
        square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    } while (!(square > 0.1 && square < 1));
    for (int i = 0; i < 4; i++)
        q[i] /= sqrt(square);
    const double p[3] = {pose->p[0], pose->p[1], pose->p[2]};
    assert_int_equal(lw_pose_make(p, q, pose), LW_OK);
}

// A solid of 2 to 12 cm; rounded every third time where it may be.
static inline void rig_solid(struct random *random, enum lw_shape_kind kind, struct told *told)
{
    const bool ball = kind == LW_SPHERE || kind == LW_CAPSULE;
    const double rounding = random_below(random, 3) ? 0 : 0.01;
    told->solid = (struct lw_solid){.kind = kind, .radius = ball ? random_in(random, 0, 0.06) : rounding};
    told->solid.half_length = random_in(random, 0, 0.06);
    random_fill(random, 0.01, 0.06, told->solid.half, 3);
    told->solid.normal[2] = 1;
    told->solid.count = 1 + random_below(random, 20);
    // Off the origin of the pose, so that turning moves the centre.
    random_fill(random, -0.04, 0.08, told->vertex, 3 * told->solid.count);
    told->solid.vertex = told->vertex;
}

static inline enum lw_shape_kind rig_kind(struct random *random)
{
    static const enum lw_shape_kind kinds[10] = {LW_HULL,   LW_HULL,   LW_HULL, LW_HULL,    LW_BOX,
                                                 LW_SPHERE, LW_SPHERE, LW_BOX,  LW_CAPSULE, LW_HULL};
    return kinds[random_below(random, 10)];
}

static inline void rig_motion(struct random *random, int64_t seen_ns, struct lw_motion *motion)
{
    random_fill(random, -1, 1, motion->v, 3);
    random_fill(random, -2, 2, motion->omega, 3);
    if (random_below(random, 3) == 0)
        memset(motion->omega, 0, sizeof motion->omega);
    motion->time_ns = seen_ns;
}

// Tells of one more obstacle, at rest, within `spread` of the origin.
static inline struct told *rig_tell(struct near_rig *rig, enum lw_shape_kind kind, double spread)
{
    if (rig->count < 0 || rig->count >= TOLD_MAX)
        fail_msg("the rig holds %d obstacles at most", TOLD_MAX);
    struct told *told = &rig->told[rig->count % TOLD_MAX];
    told->id = ++rig->count;
    told->generation = 1;
    told->motion = (struct lw_motion){.time_ns = 0};
    random_fill(&rig->random, -spread, spread, told->pose.p, 3);
    rig_turn(&rig->random, &told->pose);
    rig_solid(&rig->random, kind, told);
    return told;
}

// Builds a snapshot of what was told.
static inline void rig_build(const struct near_rig *rig, struct lw_snapshot *world)
{
    lw_snapshot_begin(world);
    for (int i = 0; i < rig->count; i++) {
        const struct told *t = &rig->told[i];
        assert_int_equal(lw_snapshot_add(world, t->id, t->generation, &t->solid, &t->pose, &t->motion), LW_OK);
    }
    lw_snapshot_end(world);
}

// --- arms ---

static inline void rig_pose(struct near_rig *rig, enum lw_robot robot, const double q[LW_NJ])
{
    struct lw_pose frame[LW_NJ];
    assert_int_equal(lw_arm_fk(lw_arm_get(robot), q, frame), LW_OK);
    lw_body_place(&rig->body, frame, &rig->placed);
}

static inline void rig_random_pose(struct near_rig *rig, enum lw_robot robot)
{
    double q[LW_NJ];
    random_fill(&rig->random, -3, 3, q, LW_NJ);
    rig_pose(rig, robot, q);
}

static inline struct lw_tool rig_tool(struct random *random, enum lw_tool_kind kind)
{
    struct lw_tool tool = {.kind = kind, .capsule = {{0, 0, 0}, {0.02, 0, 0.15}, 0.03}, .radius = 0.01, .count = 12};
    random_fill(random, -0.06, 0.06, tool.vertex, 3 * tool.count);
    for (int i = 0; i < tool.count; i++)
        tool.vertex[3 * i + 2] = 2 * fabs(tool.vertex[3 * i + 2]);
    return tool;
}

static inline struct lw_near_query rig_query(struct near_rig *rig, int64_t time_ns, double d_max)
{
    return (struct lw_near_query){.body = &rig->body,
                                  .placed = &rig->placed,
                                  .world = &rig->world,
                                  .time_ns = time_ns,
                                  .d_max = d_max,
                                  .warm = &rig->warm};
}

// --- every pair, one by one ---

// Distance of a part to obstacle i where it was told to be.
static inline struct lw_distance rig_distance(const struct near_rig *rig, const struct lw_snapshot *world, int part,
                                              int i)
{
    const struct lw_shape shape = lw_snapshot_shape(world, i);
    struct lw_distance found;
    if (part == rig->body.tool_part && rig->body.tool.kind == LW_TOOL_HULL) {
        const struct lw_shape tool = lw_body_tool_shape(&rig->body, &rig->placed);
        assert_int_equal(lw_distance_shapes(&tool, &shape, &found), LW_OK);
    } else {
        lw_distance_link(&rig->placed.capsule[part], &shape, HUGE_VAL, NULL, &found);
    }
    return found;
}

#endif
