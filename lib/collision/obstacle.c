// SPDX-License-Identifier: BSD-3-Clause
// Checking obstacles.
//
// Units    see obstacle.h.
// Frames   see obstacle.h.
// Arrays   see obstacle.h.
// Memory   stack only.
// Errors   see obstacle.h.
#include "collision/obstacle.h"

#include "base/vec.h" // lw_all_finite

#include <stdbool.h> // bool
#include <stddef.h>  // NULL
#include <string.h>  // memcpy

static const int64_t ns_per_ms = 1000 * 1000;

struct lw_solid lw_obstacle_solid(const struct lw_obstacle *obstacle, const double *vertex, int count)
{
    struct lw_solid solid = {.kind = obstacle->shape, .radius = obstacle->radius};
    switch (obstacle->shape) {
    case LW_CAPSULE: solid.half_length = obstacle->size[0]; break;
    case LW_BOX: memcpy(solid.half, obstacle->size, sizeof solid.half); break;
    case LW_HULL:
        solid.count = count;
        solid.vertex = vertex;
        break;
    case LW_HALFSPACE: solid.normal[2] = 1; break;
    default: break;
    }
    return solid;
}

// How many of the sizes a shape has.
static int size_count(enum lw_shape_kind shape)
{
    return shape == LW_BOX ? 3 : shape == LW_CAPSULE ? 1 : 0;
}

static bool within_limit(const double *values, int n)
{
    for (int i = 0; i < n; i++)
        if (!(fabs(values[i]) <= LW_OBSTACLE_LIMIT))
            return false;
    return true;
}

// All values that count: every one passes `check`.
static bool each(const struct lw_obstacle *o, const double *vertex, int count,
                 bool (*check)(const double *values, int n))
{
    return check(o->p, 3) && check(o->quat, 4) && check(o->v, 3) && check(o->omega, 3) &&
           (o->shape == LW_HALFSPACE || check(&o->radius, 1)) && check(o->size, size_count(o->shape)) &&
           check(vertex, 3 * count);
}

enum lw_status lw_obstacle_check(const struct lw_obstacle *obstacle, const double *vertex, int count,
                                 const char **reason)
{
    static const double unknown[3] = {0};
    const char *unread = NULL, **text = reason != NULL ? reason : &unread;
    if (obstacle->id <= 0 || obstacle->shape < LW_SPHERE || obstacle->shape > LW_HALFSPACE) {
        *text = obstacle->id <= 0 ? "the id is not positive" : "there is no such shape";
        return LW_E_ARGUMENT;
    }
    if (count < 0 || count > LW_HULL_MAX || (count > 0 && obstacle->shape != LW_HULL)) {
        *text = "a hull, and nothing else, has 1 to 64 vertices";
        return LW_E_ARGUMENT;
    }
    if (!each(obstacle, vertex, count, lw_all_finite)) {
        *text = "a value is not a finite number";
        return LW_E_NOT_FINITE;
    }
    if (!each(obstacle, vertex, count, within_limit)) {
        *text = "a value is beyond 100 m, m/s or rad/s";
        return LW_E_ARGUMENT;
    }
    struct lw_pose pose;
    if (lw_pose_make(obstacle->p, obstacle->quat, &pose) != LW_OK) {
        *text = "the quaternion has not length 1";
        return LW_E_ARGUMENT;
    }
    double room[LW_HULL_ROOM];
    struct lw_shape shape;
    const struct lw_solid solid = lw_obstacle_solid(obstacle, count > 0 ? vertex : unknown, count > 0 ? count : 1);
    return lw_shape_make(&solid, &pose, room, &shape, text);
}

int64_t lw_change_expires_ns(const struct lw_obstacle_change *change)
{
    return change->valid_for_ms > 0 ? change->time_ns + change->valid_for_ms * ns_per_ms : 0;
}

enum lw_world_channel lw_change_channel(const struct lw_obstacle_change *change)
{
    return change->vertex_count > 0 ? LW_WORLD_HULL : LW_WORLD_OBSTACLES;
}
