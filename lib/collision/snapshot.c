// SPDX-License-Identifier: BSD-3-Clause
// Filling, copying and reading a snapshot; order.c sorts it.
//
// Units    metres.
// Frames   base frame.
// Arrays   see snapshot.h.
// Memory   see snapshot.h.
// Errors   see snapshot.h.
#include "collision/snapshot.h"

#include "base/vec.h"        // lw_vec_*, lw_all_finite
#include "collision/order.h" // lw_order_*

#include <stdbool.h> // bool
#include <stddef.h>  // NULL, offsetof
#include <string.h>  // memcpy

// Turning half-spaces are fast somewhere; this near the base their speed counts, m.
static const double arm_reach = 3;

// --- adding ---

void lw_snapshot_begin(struct lw_snapshot *s)
{
    memset(s, 0, offsetof(struct lw_snapshot, item));
}

static bool is_moving(const struct lw_motion *motion)
{
    for (int k = 0; k < 3; k++)
        if (motion->v[k] != 0 || motion->omega[k] != 0)
            return true;
    return false;
}

// What the motion of a placed shape amounts to: traits, speed of the centre, speed_max.
static void note_motion(struct lw_snapshot *s, struct lw_snapshot_item *item)
{
    const struct lw_motion *motion = &item->motion;
    const bool moves = is_moving(motion), extrapolated = moves && motion->time_ns != 0;
    item->traits = (moves ? LW_TRAIT_MOVES : 0) | (extrapolated ? LW_TRAIT_EXTRAPOLATED : 0) |
                   (motion->expires_ns != 0 ? LW_TRAIT_EXPIRES : 0);
    double arm[3];
    lw_vec_sub(item->shape.c, item->p, arm);
    const double linear = lw_vec_norm(motion->v), turn = lw_vec_norm(motion->omega), offset = lw_vec_norm(arm);
    const double reach =
        item->shape.kind == LW_HALFSPACE ? lw_vec_norm(item->p) + arm_reach : offset + item->shape.bound;
    const double fastest = linear + turn * reach;
    item->speed = extrapolated ? linear + turn * offset : 0;
    s->speed_max = fastest > s->speed_max ? fastest : s->speed_max;
    s->extrapolated += extrapolated;
    s->expiring += motion->expires_ns != 0;
}

enum lw_status lw_snapshot_add(struct lw_snapshot *s, int id, uint32_t generation, const struct lw_solid *solid,
                               const struct lw_pose *pose, const struct lw_motion *motion)
{
    static const struct lw_motion at_rest = {.time_ns = 0};
    struct lw_snapshot_item item = {.motion = motion != NULL ? *motion : at_rest};
    if (id <= 0 || item.motion.time_ns < 0 || item.motion.expires_ns < 0)
        return LW_E_ARGUMENT;
    if (!lw_all_finite(item.motion.v, 3) || !lw_all_finite(item.motion.omega, 3))
        return LW_E_NOT_FINITE;
    const bool hull = solid->kind == LW_HULL && solid->count >= 1 && solid->count <= LW_HULL_MAX;
    const int padded = hull ? lw_hull_padded(solid->count) : 0;
    if (s->count == LW_WORLD_MAX || s->vertices + padded > LW_WORLD_VERTICES)
        return LW_E_FULL;
    const enum lw_status status = lw_shape_make(solid, pose, s->arena + 3 * s->vertices, &item.shape, NULL);
    if (status != LW_OK)
        return status;
    item.shape.id = (uint32_t)id;
    item.shape.generation = generation;
    memcpy(item.p, pose->p, sizeof item.p);
    if (hull) {
        item.shape.hull.vertex = NULL;
        item.vertex_at = 3 * s->vertices;
        s->vertices += padded;
    }
    note_motion(s, &item);
    s->item[s->count++] = item;
    return LW_OK;
}

void lw_snapshot_end(struct lw_snapshot *s)
{
    lw_order_obstacles(s);
    lw_order_boxes(s);
}

// --- using ---

#define COPY(array, n) memcpy(to->array, from->array, (size_t)(n) * sizeof from->array[0])

// The boxes at..at+n-1.
static void copy_boxes(const struct lw_snapshot_boxes *from, int at, int n, struct lw_snapshot_boxes *to)
{
    const size_t size = (size_t)n * sizeof(float);
    memcpy(&to->x[at], &from->x[at], size);
    memcpy(&to->y[at], &from->y[at], size);
    memcpy(&to->z[at], &from->z[at], size);
    for (int k = 0; k < 3; k++)
        memcpy(&to->half[k][at], &from->half[k][at], size);
    memcpy(&to->speed[at], &from->speed[at], (size_t)n * sizeof from->speed[at]);
    memcpy(&to->time_ns[at], &from->time_ns[at], (size_t)n * sizeof from->time_ns[at]);
}

void lw_snapshot_copy(const struct lw_snapshot *from, struct lw_snapshot *to)
{
    memcpy(to, from, offsetof(struct lw_snapshot, item));
    COPY(item, from->count);
    COPY(sphere.x, from->blocks * LW_WORLD_BLOCK);
    COPY(sphere.y, from->blocks * LW_WORLD_BLOCK);
    COPY(sphere.z, from->blocks * LW_WORLD_BLOCK);
    COPY(sphere.r, from->blocks * LW_WORLD_BLOCK);
    copy_boxes(&from->box, 0, from->groups * LW_WORLD_BLOCK, &to->box);
    copy_boxes(&from->box, LW_WORLD_BLOCKS, LW_WORLD_GROUPS, &to->box);
    COPY(expiry, from->expiring);
    COPY(arena, 3 * from->vertices);
}

int lw_snapshot_present(const struct lw_snapshot *s, int64_t time_ns)
{
    int low = 0, high = s->expiring;
    while (low < high) {
        const int middle = (low + high) / 2;
        if (s->expiry[middle] <= time_ns)
            low = middle + 1;
        else
            high = middle;
    }
    return s->count - low;
}

struct lw_shape lw_snapshot_shape(const struct lw_snapshot *s, int i)
{
    struct lw_shape shape = s->item[i].shape;
    if (shape.kind == LW_HULL)
        shape.hull.vertex = s->arena + s->item[i].vertex_at;
    return shape;
}
