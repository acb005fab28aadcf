// SPDX-License-Identifier: BSD-3-Clause
// Changes of a world, short enough to be read in a test.
//
// Units    metres.
// Frames   base frame.
// Arrays   none.
// Memory   one static world.
// Errors   cmocka's.
#ifndef LW_TESTS_WORLD_CHANGES_H
#define LW_TESTS_WORLD_CHANGES_H

#include "collision/world.h"
#include "helpers.h"

enum { MINE = 7, YOURS = 8 };
static const struct lw_obstacle none = {0};

static inline struct lw_world *empty_world(void)
{
    static struct lw_world world;
    memset(&world, 0, sizeof world);
    return &world;
}

static inline struct lw_obstacle ball(int id, double x)
{
    return (struct lw_obstacle){.id = id, .p = {x, 2 * x, 0.5}, .quat = {1}, .radius = 0.1};
}

// Any shape but a hull, somewhere, moving; what its shape does not have is 0.
static inline struct lw_obstacle any_solid(struct random *random, int id)
{
    static const enum lw_shape_kind shapes[] = {LW_SPHERE, LW_CAPSULE, LW_BOX, LW_HALFSPACE};
    struct lw_obstacle o = {.id = id, .shape = shapes[random_below(random, 4)], .quat = {0.6, 0, 0.8, 0}};
    random_fill(random, -2, 2, o.p, 3);
    random_fill(random, 0.01, 0.2, o.size, o.shape == LW_BOX ? 3 : o.shape == LW_CAPSULE ? 1 : 0);
    random_fill(random, -1, 1, o.v, 3);
    random_fill(random, -1, 1, o.omega, 3);
    o.radius = o.shape == LW_HALFSPACE ? 0 : random_in(random, 0, 0.1);
    return o;
}

// A change of one or two obstacles; id 0 = none.
static inline struct lw_obstacle_change change(int64_t session, int64_t seq, enum lw_change_op op, struct lw_obstacle a,
                                               struct lw_obstacle b)
{
    return (struct lw_obstacle_change){
        .stamp = {.session = session, .seq = seq}, .op = op, .count = (a.id != 0) + (b.id != 0), .obstacle = {a, b}};
}

// A hull of some vertices, other ones for every id.
static inline struct lw_obstacle_change hull(int64_t session, int64_t seq, int id, int vertices)
{
    struct random random = {(uint64_t)id};
    struct lw_obstacle_change c = change(session, seq, LW_UPSERT, ball(id, 0.01 * id), none);
    c.obstacle[0].shape = LW_HULL;
    c.vertex_count = vertices;
    random_fill(&random, -0.1, 0.1, c.vertex, 3 * vertices);
    return c;
}

// Applies the next message of a session on OBSTACLES.
static inline void apply(struct lw_world *world, int64_t session, enum lw_change_op op, struct lw_obstacle a,
                         struct lw_obstacle b)
{
    const struct lw_obstacle_change c = change(session, world->last.seq + 1, op, a, b);
    assert_int_equal(lw_world_apply(world, &c), LW_OK);
    assert_true(world->last.session == session && world->last.seq == c.stamp.seq);
}

// The obstacle of an id; id 0 = the world has none.
static inline struct lw_obstacle get(const struct lw_world *world, int id)
{
    const int at = lw_world_find(world, id);
    assert_true(at >= -1 && at < world->count);
    assert_true(at < 0 || world->entry[at].obstacle.id == id);
    return at >= 0 ? world->entry[at].obstacle : none;
}

static inline int64_t owner_of(const struct lw_world *world, int id)
{
    const int at = lw_world_find(world, id);
    return at >= 0 ? world->owner[at] : 0;
}

static inline int vertices_of(const struct lw_world *world, int id, double vertex[3 * LW_HULL_MAX])
{
    const int at = lw_world_find(world, id);
    return at >= 0 ? lw_world_vertices(world, &world->entry[at], vertex) : 0;
}

#endif
