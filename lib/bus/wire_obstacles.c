// SPDX-License-Identifier: BSD-3-Clause
// Encoding, decoding and validating changes of the set of obstacles.
//
// Units    those of lcmtypes/*.lcm.
// Frames   base frame of the arm.
// Arrays   fixed sizes.
// Memory   stack only.
// Errors   see wire.h.
#include "bus/wire_kind.h"

#include <leeway_hull_t.h>
#include <leeway_obstacles_t.h>

// --- one obstacle ---

static leeway_obstacle_t from_obstacle(const struct lw_obstacle *o)
{
    leeway_obstacle_t w = {.id = o->id, .shape = (int8_t)o->shape, .radius = o->radius};
    memcpy(w.p, o->p, sizeof w.p);
    memcpy(w.quat, o->quat, sizeof w.quat);
    memcpy(w.size, o->size, sizeof w.size);
    memcpy(w.v, o->v, sizeof w.v);
    memcpy(w.omega, o->omega, sizeof w.omega);
    return w;
}

// Values that the shape does not have are left 0, whatever the sender wrote there.
static struct lw_obstacle to_obstacle(const leeway_obstacle_t *w)
{
    const int sizes = w->shape == LW_BOX ? 3 : w->shape == LW_CAPSULE ? 1 : 0;
    struct lw_obstacle o = {.id = w->id, .shape = (enum lw_shape_kind)w->shape};
    if (w->shape != LW_HALFSPACE)
        o.radius = w->radius;
    memcpy(o.p, w->p, sizeof o.p);
    memcpy(o.quat, w->quat, sizeof o.quat);
    memcpy(o.size, w->size, (size_t)sizes * sizeof o.size[0]);
    memcpy(o.v, w->v, sizeof o.v);
    memcpy(o.omega, w->omega, sizeof o.omega);
    return o;
}

// A time that is told is positive, an expiry needs one, and both together fit.
static enum lw_status check_times(const struct lw_obstacle_change *c)
{
    if (c->time_ns < 0 || c->valid_for_ms < 0 || (c->valid_for_ms > 0 && c->time_ns == 0))
        return LW_E_ARGUMENT;
    return c->time_ns <= INT64_MAX - INT32_MAX * INT64_C(1000000) ? LW_OK : LW_E_ARGUMENT;
}

// --- obstacles ---

static int encode_obstacles(void *data, const union lw_message *message)
{
    const struct lw_obstacle_change *c = &message->obstacles;
    leeway_obstacles_t w = {.h = lw_wire_from_stamp(&c->stamp),
                            .owner = c->owner,
                            .time_ns = c->time_ns,
                            .valid_for_ms = c->valid_for_ms,
                            .op = (int8_t)c->op,
                            .n = c->count};
    for (int i = 0; i < c->count; i++)
        w.o[i] = from_obstacle(&c->obstacle[i]);
    return leeway_obstacles_t_encode(data, 0, LW_WIRE_MAX, &w);
}

// Of an obstacle that is removed only the id counts.
static enum lw_status read_obstacle(const leeway_obstacle_t *w, enum lw_change_op op, struct lw_obstacle *o)
{
    *o = op == LW_REMOVE ? (struct lw_obstacle){.id = w->id} : to_obstacle(w);
    if (op == LW_REMOVE)
        return w->id > 0 ? LW_OK : LW_E_ARGUMENT;
    return lw_obstacle_check(o, NULL, 0, NULL);
}

static enum lw_status check_unique_ids(const struct lw_obstacle_change *c)
{
    for (int i = 0; i < c->count; i++)
        for (int k = 0; k < i; k++)
            if (c->obstacle[i].id == c->obstacle[k].id)
                return LW_E_ARGUMENT;
    return LW_OK;
}

static enum lw_status decode_obstacles(const void *data, int size, union lw_message *message)
{
    leeway_obstacles_t w;
    if (leeway_obstacles_t_decode(data, 0, size, &w) < 0)
        return LW_E_DECODE;
    if (w.op < LW_UPSERT || w.op > LW_CLEAR || w.n < 0 || w.n > LW_CHANGE_MAX)
        return LW_E_ARGUMENT;
    struct lw_obstacle_change c = {.stamp = lw_wire_to_stamp(&w.h),
                                   .owner = w.owner,
                                   .time_ns = w.time_ns,
                                   .valid_for_ms = w.valid_for_ms,
                                   .op = (enum lw_change_op)w.op,
                                   .count = w.n};
    enum lw_status status = lw_wire_check_stamp(&c.stamp);
    if (status == LW_OK)
        status = check_times(&c);
    for (int i = 0; status == LW_OK && i < w.n; i++)
        status = read_obstacle(&w.o[i], c.op, &c.obstacle[i]);
    if (status == LW_OK)
        status = check_unique_ids(&c);
    if (status == LW_OK)
        message->obstacles = c;
    return status;
}

static int size_obstacles(void)
{
    return leeway_obstacles_t_encoded_size(&(leeway_obstacles_t){0});
}

const struct lw_wire_kind lw_wire_obstacles = {size_obstacles, __leeway_obstacles_t_get_hash, encode_obstacles,
                                               decode_obstacles};

// --- hull ---

static int encode_hull(void *data, const union lw_message *message)
{
    const struct lw_obstacle_change *c = &message->obstacles;
    leeway_hull_t w = {.h = lw_wire_from_stamp(&c->stamp),
                       .owner = c->owner,
                       .time_ns = c->time_ns,
                       .valid_for_ms = c->valid_for_ms,
                       .o = from_obstacle(&c->obstacle[0]),
                       .n = c->vertex_count};
    for (int i = 0; i < c->vertex_count && i < LW_HULL_MAX; i++)
        memcpy(w.vertex[i], &c->vertex[3 * i], sizeof w.vertex[i]);
    return leeway_hull_t_encode(data, 0, LW_WIRE_MAX, &w);
}

static enum lw_status decode_hull(const void *data, int size, union lw_message *message)
{
    leeway_hull_t w;
    if (leeway_hull_t_decode(data, 0, size, &w) < 0)
        return LW_E_DECODE;
    if (w.n < 1 || w.n > LW_HULL_MAX || w.o.shape != LW_HULL)
        return LW_E_ARGUMENT;
    struct lw_obstacle_change c = {.stamp = lw_wire_to_stamp(&w.h),
                                   .owner = w.owner,
                                   .time_ns = w.time_ns,
                                   .valid_for_ms = w.valid_for_ms,
                                   .op = LW_UPSERT,
                                   .count = 1,
                                   .obstacle = {to_obstacle(&w.o)},
                                   .vertex_count = w.n};
    memcpy(c.vertex, w.vertex, (size_t)w.n * sizeof w.vertex[0]);
    enum lw_status status = lw_wire_check_stamp(&c.stamp);
    if (status == LW_OK)
        status = check_times(&c);
    if (status == LW_OK)
        status = lw_obstacle_check(&c.obstacle[0], c.vertex, c.vertex_count, NULL);
    if (status == LW_OK)
        message->obstacles = c;
    return status;
}

static int size_hull(void)
{
    return leeway_hull_t_encoded_size(&(leeway_hull_t){0});
}

const struct lw_wire_kind lw_wire_hull = {size_hull, __leeway_hull_t_get_hash, encode_hull, decode_hull};
