// SPDX-License-Identifier: BSD-3-Clause
// Building a snapshot: obstacles are placed as they come; at the end they are sorted along a Morton curve, so that
// neighbours stand together, and bounded in blocks.
//
// Units    metres.
// Frames   base frame.
// Arrays   see snapshot.h.
// Memory   the snapshot's own room to sort in.
// Errors   see snapshot.h.
#include "collision/snapshot.h"

#include "base/vec.h" // lw_vec_*, lw_all_finite

#include <math.h>    // fabs, fmax, INFINITY
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

// --- order ---

// The lowest ten bits of a number, three places apart.
static uint64_t spread(uint64_t x)
{
    x = (x | x << 16) & 0x30000ff;
    x = (x | x << 8) & 0x300f00f;
    x = (x | x << 4) & 0x30c30c3;
    return (x | x << 2) & 0x9249249;
}

// Sorts by key, stably, between the two rooms; returns the sorted one.
static const struct lw_snapshot_order *sort(struct lw_snapshot_order room[2][LW_WORLD_MAX], int n)
{
    int from = 0;
    for (int run = 1; run < n; run *= 2, from = !from) {
        const struct lw_snapshot_order *in = room[from];
        struct lw_snapshot_order *out = room[!from];
        for (int left = 0; left < n; left += 2 * run) {
            const int middle = left + run < n ? left + run : n, right = middle + run < n ? middle + run : n;
            for (int i = left, j = middle, k = left; k < right; k++)
                out[k] = i < middle && (j == right || in[i].key <= in[j].key) ? in[i++] : in[j++];
        }
    }
    return room[from];
}

// The box that holds the centres of the bounded obstacles.
static void find_extent(const struct lw_snapshot *s, double low[3], double high[3])
{
    for (int k = 0; k < 3; k++) {
        low[k] = INFINITY;
        high[k] = -INFINITY;
    }
    for (int i = 0; i < s->count; i++)
        for (int k = 0; k < 3 && s->item[i].shape.kind != LW_HALFSPACE; k++) {
            low[k] = fmin(low[k], s->item[i].shape.c[k]);
            high[k] = fmax(high[k], s->item[i].shape.c[k]);
        }
}

// Key of an obstacle: half-spaces last, cell of its centre along the curve, id.
static uint64_t key_of(const struct lw_shape *shape, const double low[3], const double high[3])
{
    uint64_t cell = 0;
    if (shape->kind == LW_HALFSPACE)
        return UINT64_C(1) << 61 | shape->id;
    for (int k = 0; k < 3; k++) {
        const double size = high[k] - low[k];
        cell |= spread(size > 0 ? (uint64_t)(1023 * ((shape->c[k] - low[k]) / size)) : 0) << k;
    }
    return cell << 31 | shape->id;
}

// Moves every item to its place, along the cycles of the permutation.
static void permute(struct lw_snapshot *s, struct lw_snapshot_order *order)
{
    for (int start = 0; start < s->count; start++) {
        if (order[start].from < 0)
            continue;
        const struct lw_snapshot_item first = s->item[start];
        int at = start;
        while (order[at].from != start) {
            const int from = order[at].from;
            s->item[at] = s->item[from];
            order[at].from = -1;
            at = from;
        }
        s->item[at] = first;
        order[at].from = -1;
    }
}

static void put_in_order(struct lw_snapshot *s)
{
    double low[3], high[3];
    find_extent(s, low, high);
    for (int i = 0; i < s->count; i++) {
        s->bounded += s->item[i].shape.kind != LW_HALFSPACE;
        s->order[0][i] = (struct lw_snapshot_order){key_of(&s->item[i].shape, low, high), i};
    }
    permute(s, s->order[sort(s->order, s->count) != s->order[0]]);
}

static void list_expiries(struct lw_snapshot *s)
{
    int n = 0;
    for (int i = 0; i < s->count; i++)
        if (s->item[i].traits & LW_TRAIT_EXPIRES)
            s->order[0][n++].key = (uint64_t)s->item[i].motion.expires_ns;
    const struct lw_snapshot_order *sorted = sort(s->order, n);
    for (int i = 0; i < n; i++)
        s->expiry[i] = (int64_t)sorted[i].key;
}

// --- bounding ---

// Radius of a sphere of single precision about a rounded centre that holds one of double precision.
static float inflate(double r, const double c[3])
{
    return (float)(r * (1 + 1e-6) + 1e-6 + 4e-7 * (fabs(c[0]) + fabs(c[1]) + fabs(c[2])));
}

// Sphere around the spheres first..last-1 of a block.
static void bound_block(struct lw_snapshot *s, int block, int first, int last)
{
    double c[3], r = 0, away[3];
    for (int k = 0; k < 3; k++) {
        double low = INFINITY, high = -INFINITY;
        for (int i = first; i < last; i++) {
            low = fmin(low, s->item[i].shape.c[k] - s->item[i].shape.bound);
            high = fmax(high, s->item[i].shape.c[k] + s->item[i].shape.bound);
        }
        c[k] = 0.5 * low + 0.5 * high;
    }
    for (int i = first; i < last; i++) {
        lw_vec_sub(s->item[i].shape.c, c, away);
        r = fmax(r, lw_vec_norm(away) + s->item[i].shape.bound);
    }
    s->block.x[block] = (float)c[0];
    s->block.y[block] = (float)c[1];
    s->block.z[block] = (float)c[2];
    s->block.r[block] = inflate(r, c);
}

// How far the members of a block may have moved: not farther than the fastest in the time of the oldest.
static void note_block_motion(struct lw_snapshot *s, int block, int first, int last)
{
    s->block.speed[block] = 0;
    s->block.time_ns[block] = INT64_MAX;
    for (int i = first; i < last; i++) {
        const struct lw_snapshot_item *item = &s->item[i];
        if (!(item->traits & LW_TRAIT_EXTRAPOLATED))
            continue;
        s->block.speed[block] = fmax(s->block.speed[block], item->speed);
        if (item->motion.time_ns < s->block.time_ns[block])
            s->block.time_ns[block] = item->motion.time_ns;
    }
}

static void bound_all(struct lw_snapshot *s)
{
    for (int i = 0; i < s->bounded; i++) {
        const struct lw_shape *shape = &s->item[i].shape;
        s->sphere.x[i] = (float)shape->c[0];
        s->sphere.y[i] = (float)shape->c[1];
        s->sphere.z[i] = (float)shape->c[2];
        s->sphere.r[i] = inflate(shape->bound, shape->c);
    }
    s->blocks = (s->bounded + LW_WORLD_BLOCK - 1) / LW_WORLD_BLOCK;
    for (int block = 0; block < s->blocks; block++) {
        const int first = block * LW_WORLD_BLOCK, end = first + LW_WORLD_BLOCK;
        const int last = end < s->bounded ? end : s->bounded;
        bound_block(s, block, first, last);
        note_block_motion(s, block, first, last);
    }
}

// Fills the last block, and the last sixteen blocks, with spheres that nothing is near.
static void pad(struct lw_snapshot *s)
{
    for (int i = s->bounded; i % LW_WORLD_BLOCK != 0; i++) {
        s->sphere.x[i] = s->sphere.y[i] = s->sphere.z[i] = 1e18F;
        s->sphere.r[i] = 0;
    }
    for (int i = s->blocks; i % LW_WORLD_BLOCK != 0; i++) {
        s->block.x[i] = s->block.y[i] = s->block.z[i] = 1e18F;
        s->block.r[i] = 0;
        s->block.speed[i] = 0;
        s->block.time_ns[i] = INT64_MAX;
    }
}

void lw_snapshot_end(struct lw_snapshot *s)
{
    put_in_order(s);
    list_expiries(s);
    bound_all(s);
    pad(s);
}

// --- using ---

// Copies the first n values of each of the arrays that stand one after another in a struct.
static void copy_spheres(const struct lw_snapshot *from, struct lw_snapshot *to)
{
    const size_t spheres = (size_t)from->blocks * LW_WORLD_BLOCK * sizeof(float);
    const size_t blocks = ((size_t)from->blocks + LW_WORLD_BLOCK - 1) / LW_WORLD_BLOCK * LW_WORLD_BLOCK;
    memcpy(to->sphere.x, from->sphere.x, spheres);
    memcpy(to->sphere.y, from->sphere.y, spheres);
    memcpy(to->sphere.z, from->sphere.z, spheres);
    memcpy(to->sphere.r, from->sphere.r, spheres);
    memcpy(to->block.x, from->block.x, blocks * sizeof(float));
    memcpy(to->block.y, from->block.y, blocks * sizeof(float));
    memcpy(to->block.z, from->block.z, blocks * sizeof(float));
    memcpy(to->block.r, from->block.r, blocks * sizeof(float));
    memcpy(to->block.speed, from->block.speed, blocks * sizeof from->block.speed[0]);
    memcpy(to->block.time_ns, from->block.time_ns, blocks * sizeof from->block.time_ns[0]);
}

void lw_snapshot_copy(const struct lw_snapshot *from, struct lw_snapshot *to)
{
    memcpy(to, from, offsetof(struct lw_snapshot, item) + (size_t)from->count * sizeof from->item[0]);
    copy_spheres(from, to);
    memcpy(to->expiry, from->expiry, (size_t)from->expiring * sizeof from->expiry[0]);
    memcpy(to->arena, from->arena, 3 * (size_t)from->vertices * sizeof from->arena[0]);
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
