// SPDX-License-Identifier: BSD-3-Clause
// Sorting and bounding the obstacles of a snapshot.
//
// Units    metres.
// Frames   base frame.
// Arrays   see snapshot.h.
// Memory   the snapshot's own room to sort in.
// Errors   none.
#include "collision/order.h"

#include <math.h>    // fabs, HUGE_VAL
#include <stdbool.h> // bool

// Of finite numbers, without the calls of fmin and fmax.
static double lower(double a, double b)
{
    return a < b ? a : b;
}

static double higher(double a, double b)
{
    return a > b ? a : b;
}

// --- sorting ---

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
        low[k] = HUGE_VAL;
        high[k] = -HUGE_VAL;
    }
    for (int i = 0; i < s->count; i++)
        for (int k = 0; k < 3 && s->item[i].shape.kind != LW_HALFSPACE; k++) {
            low[k] = lower(low[k], s->item[i].shape.c[k]);
            high[k] = higher(high[k], s->item[i].shape.c[k]);
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

void lw_order_obstacles(struct lw_snapshot *s)
{
    put_in_order(s);
    list_expiries(s);
}

// --- bounding ---

// Up to the next multiple of the size of a block.
static int fill_up(int n)
{
    return (n + LW_WORLD_BLOCK - 1) / LW_WORLD_BLOCK * LW_WORLD_BLOCK;
}

// Radius of a sphere of single precision about a rounded centre that holds one of double precision.
static float inflate(double r, const double c[3])
{
    return (float)(r * (1 + 1e-6) + 1e-6 + 4e-7 * (fabs(c[0]) + fabs(c[1]) + fabs(c[2])));
}

// Sphere i; beyond the last obstacle one that nothing is near, to fill its block.
static void set_sphere(struct lw_snapshot *s, int i)
{
    static const double nowhere[3] = {1e18, 1e18, 1e18};
    const bool real = i < s->bounded;
    const double *c = real ? s->item[i].shape.c : nowhere;
    s->sphere.x[i] = (float)c[0];
    s->sphere.y[i] = (float)c[1];
    s->sphere.z[i] = (float)c[2];
    s->sphere.r[i] = real ? inflate(s->item[i].shape.bound, c) : 0;
}

// Box `at` around the obstacles first..last-1; around none one that nothing is near. Its members have not moved farther
// than the fastest of them would have in the time of the oldest.
static void set_box(struct lw_snapshot *s, int at, int first, int last)
{
    float *c[3] = {&s->box.x[at], &s->box.y[at], &s->box.z[at]};
    double middle[3] = {1e18, 1e18, 1e18}, half[3] = {0, 0, 0};
    for (int k = 0; k < 3 && first < last; k++) {
        double low = HUGE_VAL, high = -HUGE_VAL;
        for (int i = first; i < last; i++) {
            low = lower(low, s->item[i].shape.c[k] - s->item[i].shape.bound);
            high = higher(high, s->item[i].shape.c[k] + s->item[i].shape.bound);
        }
        middle[k] = 0.5 * low + 0.5 * high;
        half[k] = higher(high - middle[k], middle[k] - low);
    }
    for (int k = 0; k < 3; k++) {
        *c[k] = (float)middle[k];
        s->box.half[k][at] = first < last ? inflate(half[k], middle) : 0;
    }
    s->box.speed[at] = 0;
    s->box.time_ns[at] = INT64_MAX;
    for (int i = first; i < last; i++) {
        const struct lw_snapshot_item *item = &s->item[i];
        if (!(item->traits & LW_TRAIT_EXTRAPOLATED))
            continue;
        s->box.speed[at] = higher(s->box.speed[at], item->speed);
        if (item->motion.time_ns < s->box.time_ns[at])
            s->box.time_ns[at] = item->motion.time_ns;
    }
}

static int lesser(int a, int b)
{
    return a < b ? a : b;
}

void lw_order_boxes(struct lw_snapshot *s)
{
    const int size = LW_WORLD_BLOCK;
    s->blocks = fill_up(s->bounded) / size;
    s->groups = fill_up(s->blocks) / size;
    for (int i = 0; i < fill_up(s->bounded); i++)
        set_sphere(s, i);
    for (int i = 0; i < fill_up(s->blocks); i++)
        set_box(s, i, lesser(i * size, s->bounded), lesser((i + 1) * size, s->bounded));
    for (int i = 0; i < LW_WORLD_GROUPS; i++)
        set_box(s, LW_WORLD_BLOCKS + i, lesser(i * size * size, s->bounded), lesser((i + 1) * size * size, s->bounded));
}
