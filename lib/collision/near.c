// SPDX-License-Identifier: BSD-3-Clause
// Range and nearest queries: blocks of obstacles are culled by their bounding spheres, then obstacles by theirs, and
// what is left is measured exactly.
//
// Units    metres.
// Frames   see near.h.
// Arrays   see near.h.
// Memory   the slack of all blocks on the stack, 3 kB.
// Errors   see near.h.
#include "collision/near.h"

#include "base/vec.h"         // lw_vec_*
#include "collision/cull.h"   // lw_cull_*
#include "collision/moving.h" // lw_moving_*

#include <math.h>    // isnan, NAN, HUGE_VAL
#include <stdbool.h> // bool
#include <stddef.h>  // NULL
#include <string.h>  // memset

enum { BOXES = LW_WORLD_BLOCKS + LW_WORLD_GROUPS, FEW_BLOCKS = 3 };

// A query with what its time makes of the world: how far the members of each box may have moved.
struct sweep {
    const struct lw_near_query *query;
    const float *slack;
    float room[BOXES];
};

static void start(const struct lw_near_query *query, struct sweep *sweep)
{
    static const float still[BOXES];
    const struct lw_snapshot_boxes *box = &query->world->box;
    sweep->query = query;
    sweep->slack = still;
    if (query->world->extrapolated == 0)
        return;
    for (int i = 0; i < BOXES; i++)
        if (i < query->world->groups * LW_WORLD_BLOCK || i >= LW_WORLD_BLOCKS)
            sweep->room[i] = (float)(box->speed[i] * lw_moving_age(box->time_ns[i], query->time_ns) * (1 + 1e-6));
    sweep->slack = sweep->room;
}

static struct lw_boxes boxes_at(const struct sweep *sweep, int i)
{
    const struct lw_snapshot_boxes *b = &sweep->query->world->box;
    return (struct lw_boxes){
        &b->x[i], &b->y[i], &b->z[i], {&b->half[0][i], &b->half[1][i], &b->half[2][i]}, &sweep->slack[i]};
}

static struct lw_spheres spheres_at(const struct sweep *sweep, int block)
{
    const struct lw_snapshot_spheres *s = &sweep->query->world->sphere;
    const int i = block * LW_WORLD_BLOCK;
    return (struct lw_spheres){&s->x[i], &s->y[i], &s->z[i], &s->r[i]};
}

// A walk over the blocks that may be near a link; it may look less far as the walk goes on.
struct walk {
    const struct sweep *sweep;
    const struct lw_cull *link;
    unsigned groups, blocks; // left to visit, of sixteen each
    int first_group, first_block;
};

static struct walk walk_from(const struct sweep *sweep, const struct lw_cull *link)
{
    struct walk walk = {.sweep = sweep, .link = link, .first_group = -LW_WORLD_BLOCK};
    // Few blocks are visited all: asking their boxes first would cost more.
    const int blocks = sweep->query->world->blocks;
    if (blocks <= FEW_BLOCKS) {
        walk.first_group = sweep->query->world->groups;
        walk.blocks = (1U << blocks) - 1;
    }
    return walk;
}

static int lesser(int a, int b)
{
    return a < b ? a : b;
}

static int take_lowest(unsigned *bits)
{
    const int lowest = __builtin_ctz(*bits);
    *bits &= *bits - 1;
    return lowest;
}

// The next block, -1 at the end.
static int next_block(struct walk *walk)
{
    const struct lw_snapshot *world = walk->sweep->query->world;
    while (walk->blocks == 0) {
        while (walk->groups == 0) {
            walk->first_group += LW_WORLD_BLOCK;
            if (walk->first_group >= world->groups)
                return -1;
            const struct lw_boxes groups = boxes_at(walk->sweep, LW_WORLD_BLOCKS + walk->first_group);
            walk->groups = lw_cull_boxes(&groups, walk->link);
        }
        const int group = walk->first_group + take_lowest(&walk->groups);
        if (group >= world->groups)
            continue;
        walk->first_block = group * LW_WORLD_BLOCK;
        const struct lw_boxes blocks = boxes_at(walk->sweep, walk->first_block);
        walk->blocks = lw_cull_boxes(&blocks, walk->link);
    }
    const int block = walk->first_block + take_lowest(&walk->blocks);
    return block < world->blocks ? block : -1;
}

// --- one pair ---

// Whether the bounding sphere of a shape is farther than d_max for certain.
static bool beyond(const struct lw_capsule *capsule, const struct lw_shape *shape, double d_max)
{
    double u[3], v[3];
    lw_vec_sub(capsule->b, capsule->a, u);
    lw_vec_sub(capsule->a, shape->c, v);
    const double square = lw_vec_dot(u, u), reach = (shape->bound + capsule->r + d_max) * (1 + 1e-9) + 1e-9;
    const double t = square > 0 ? -lw_vec_dot(u, v) / square : 0;
    lw_vec_add_scaled(t < 0 ? 0 : t > 1 ? 1 : t, u, v);
    return lw_vec_dot(v, v) > reach * reach;
}

// A tool hull against a shape; the tool is moved back to where the shape was seen.
static void measure_tool(const struct lw_near_query *query, const struct lw_shape *shape,
                         const struct lw_moving *moving, struct lw_distance *out)
{
    double room[LW_HULL_ROOM];
    struct lw_shape tool = lw_body_tool_shape(query->body, query->placed);
    if (moving != NULL)
        lw_moving_back(moving, tool.c, tool.c);
    if (moving != NULL && moving->turns) {
        const int padded = tool.hull.padded;
        for (int i = 0; i < padded; i++) {
            const double *x = tool.hull.vertex + i, now[3] = {x[0], x[padded], x[2 * padded]};
            double then[3];
            lw_moving_turn_back(moving, now, then);
            for (int k = 0; k < 3; k++)
                room[k * padded + i] = then[k];
        }
        tool.hull.vertex = room;
    }
    if (lw_distance_shapes(&tool, shape, out) != LW_OK)
        *out = (struct lw_distance){.d = (double)NAN, .flags = LW_DISTANCE_NO_NORMAL}; // of no two of these kinds
}

// Distance of a part to obstacle i, where it was seen or moved on from there. False when it is farther than d_max.
static bool find_distance(const struct lw_near_query *query, const struct lw_moving *moving, int i, double d_max,
                          struct lw_near *out)
{
    const struct lw_snapshot_item *item = &query->world->item[i];
    const struct lw_shape *shape = &item->shape;
    struct lw_capsule capsule = query->placed->capsule[out->part];
    struct lw_shape hull;
    if (moving != NULL) {
        lw_moving_back(moving, capsule.a, capsule.a);
        lw_moving_back(moving, capsule.b, capsule.b);
        if (beyond(&capsule, shape, d_max))
            return false;
    }
    if (shape->kind == LW_HULL) {
        hull = lw_snapshot_shape(query->world, i);
        shape = &hull;
    }
    struct lw_warm *warm = query->warm != NULL ? &query->warm->entry[out->part][shape->id & (LW_WARM_SLOTS - 1)] : NULL;
    if (out->part == query->body->tool_part && query->body->tool.kind == LW_TOOL_HULL)
        measure_tool(query, shape, moving, &out->distance);
    else
        lw_distance_link(&capsule, shape, d_max, warm, &out->distance);
    return !(out->distance.d > d_max);
}

// Measures a part and obstacle i of the snapshot. False when that has expired or is farther than d_max.
static bool measure(const struct lw_near_query *query, int part, int i, double d_max, struct lw_near *out)
{
    const struct lw_snapshot_item *item = &query->world->item[i];
    if ((item->traits & LW_TRAIT_EXPIRES) && query->time_ns >= item->motion.expires_ns)
        return false;
    out->part = part;
    out->obstacle = (int)item->shape.id;
    out->other = -1;
    out->fixed = false;
    struct lw_moving since;
    const struct lw_moving *moving = NULL;
    if (item->traits & LW_TRAIT_EXTRAPOLATED) {
        since = lw_moving_since(item, query->time_ns);
        moving = &since;
    }
    if (!find_distance(query, moving, i, d_max, out))
        return false;
    if (moving != NULL)
        lw_moving_forth(moving, &out->distance);
    memset(out->velocity, 0, sizeof out->velocity);
    if (item->traits & LW_TRAIT_MOVES)
        lw_moving_velocity(item, moving, out->distance.pb, out->velocity);
    return true;
}

// --- all in range ---

// Measures a part and obstacle i straight into the list.
static void list(const struct sweep *sweep, int part, int i, struct lw_near_list *out)
{
    struct lw_near spare, *near = out->count < LW_NEAR_MAX ? &out->pair[out->count] : &spare;
    if (!measure(sweep->query, part, i, sweep->query->d_max, near))
        return;
    out->needed++;
    out->count += near != &spare;
}

static void list_block(const struct sweep *sweep, int part, const struct lw_cull *link, int block,
                       struct lw_near_list *out)
{
    const struct lw_spheres spheres = spheres_at(sweep, block);
    const int first = block * LW_WORLD_BLOCK, count = lesser(sweep->query->world->bounded - first, LW_WORLD_BLOCK);
    unsigned near = lw_cull_spheres(&spheres, count, link, sweep->slack[block]);
    while (near != 0) {
        const int i = take_lowest(&near);
        if (i < count)
            list(sweep, part, first + i, out);
    }
}

void lw_near_range(const struct lw_near_query *query, struct lw_near_list *out)
{
    struct sweep sweep;
    start(query, &sweep);
    out->count = out->needed = 0;
    for (int part = 0; part < query->body->count; part++) {
        struct lw_cull link = query->placed->cull[part];
        lw_cull_look(&link, query->d_max);
        struct walk walk = walk_from(&sweep, &link);
        for (int block = next_block(&walk); block >= 0; block = next_block(&walk))
            list_block(&sweep, part, &link, block, out);
        for (int i = query->world->bounded; i < query->world->count; i++)
            list(&sweep, part, i, out);
    }
}

// --- self pairs ---

static void measure_self(const struct lw_body *body, const struct lw_placed *placed, struct lw_body_pair pair,
                         struct lw_near *out)
{
    out->part = pair.part;
    out->other = pair.other;
    out->obstacle = 0;
    out->fixed = false;
    memset(out->velocity, 0, sizeof out->velocity);
    if (pair.other != body->tool_part || body->tool.kind != LW_TOOL_HULL) {
        lw_distance_capsules(&placed->capsule[pair.part], &placed->capsule[pair.other], &out->distance);
        return;
    }
    const struct lw_shape tool = lw_body_tool_shape(body, placed);
    lw_distance_link(&placed->capsule[pair.part], &tool, HUGE_VAL, NULL, &out->distance);
}

void lw_near_self(const struct lw_body *body, const struct lw_placed *placed, double d_max, struct lw_near_list *out)
{
    for (int i = 0; i < body->pair_count; i++) {
        if (!lw_cull_pair(&placed->cull[body->pair[i].part], &placed->cull[body->pair[i].other], d_max))
            continue;
        struct lw_near spare, *near = out->count < LW_NEAR_MAX ? &out->pair[out->count] : &spare;
        measure_self(body, placed, body->pair[i], near);
        if (near->distance.d > d_max)
            continue;
        out->needed++;
        out->count += near != &spare;
    }
}

// --- nearest ---

// A search for the nearest obstacle, of one part or of all.
struct nearest {
    struct lw_near best; // so far; obstacle 0: its d is where to look at most
    int index;           // of its obstacle; -1 = none
};

static struct nearest nothing(int part, double d_max)
{
    return (struct nearest){
        .best = {.distance = {.d = d_max, .flags = LW_DISTANCE_NO_NORMAL}, .part = part, .other = -1}, .index = -1};
}

// Of equally near pairs the first part's, and of one part's the one with the lowest id.
static bool comes_first(const struct lw_near *found, const struct lw_near *best)
{
    if (best->obstacle == 0 || found->part != best->part)
        return best->obstacle == 0 || found->part < best->part;
    return found->obstacle < best->obstacle;
}

// Takes obstacle i of the snapshot if it is nearer to the part than the best so far; returns whether it was. Distances
// beyond that one are not followed up, but equal ones are.
static bool improve(const struct sweep *sweep, int part, int i, struct nearest *nearest)
{
    struct lw_near found;
    const double bound = nearest->best.distance.d;
    if (!measure(sweep->query, part, i, bound + 1e-9, &found))
        return false;
    const double d = found.distance.d;
    if (!(d < bound) && !(d == bound && comes_first(&found, &nearest->best)) && !isnan(d))
        return false;
    nearest->best = found;
    nearest->index = i;
    return true;
}

// Starts from what was nearest last time; returns whether it is still there.
static bool improve_by_last(const struct sweep *sweep, const struct lw_warm_pair *last, struct nearest *nearest)
{
    const struct lw_snapshot *world = sweep->query->world;
    if (last == NULL || last->id <= 0 || last->part < 0 || last->part >= sweep->query->body->count || last->index < 0 ||
        last->index >= world->count || world->item[last->index].shape.id != (uint32_t)last->id)
        return false;
    return improve(sweep, last->part, last->index, nearest);
}

static void keep_for_next(const struct nearest *nearest, struct lw_warm_pair *last)
{
    if (last != NULL)
        *last = (struct lw_warm_pair){nearest->best.part, nearest->index, nearest->best.obstacle};
}

// An obstacle that is likely to be near: of the nearest box of the nearest group the nearest one. -1 = there is none.
static int guess(const struct sweep *sweep, const struct lw_cull *link)
{
    const struct lw_snapshot *world = sweep->query->world;
    if (world->bounded == 0)
        return -1;
    const struct lw_boxes groups = boxes_at(sweep, LW_WORLD_BLOCKS);
    const int group = lw_cull_nearest_box(&groups, link, lesser(world->groups, LW_WORLD_BLOCK)) * LW_WORLD_BLOCK;
    const struct lw_boxes blocks = boxes_at(sweep, group);
    const int block = group + lw_cull_nearest_box(&blocks, link, lesser(world->blocks - group, LW_WORLD_BLOCK));
    const struct lw_spheres spheres = spheres_at(sweep, block);
    const int first = block * LW_WORLD_BLOCK;
    return first + lw_cull_nearest_sphere(&spheres, link, lesser(world->bounded - first, LW_WORLD_BLOCK));
}

static void search_block(const struct sweep *sweep, int part, struct lw_cull *link, int block, struct nearest *nearest)
{
    const struct lw_spheres spheres = spheres_at(sweep, block);
    const int first = block * LW_WORLD_BLOCK, known = nearest->best.part == part ? nearest->index : -1;
    const int count = lesser(sweep->query->world->bounded - first, LW_WORLD_BLOCK);
    unsigned near = lw_cull_spheres(&spheres, count, link, sweep->slack[block]);
    while (near != 0) {
        const int i = first + take_lowest(&near);
        if (i >= first + count || i == known || !improve(sweep, part, i, nearest))
            continue;
        // Nothing beyond the new best is worth a look.
        lw_cull_look(link, nearest->best.distance.d);
        near &= lw_cull_spheres(&spheres, count, link, sweep->slack[block]);
    }
}

// Branch and bound over the obstacles of one part.
//   seeded  in  whether the best so far is a good one
static void search(const struct sweep *sweep, int part, bool seeded, struct nearest *nearest)
{
    const struct lw_snapshot *world = sweep->query->world;
    struct lw_cull link = sweep->query->placed->cull[part];
    lw_cull_look(&link, nearest->best.distance.d);
    for (int i = world->bounded; i < world->count; i++)
        (void)improve(sweep, part, i, nearest);
    const int seed = seeded ? -1 : guess(sweep, &link);
    if (seed >= 0)
        (void)improve(sweep, part, seed, nearest);
    lw_cull_look(&link, nearest->best.distance.d);
    struct walk walk = walk_from(sweep, &link);
    for (int block = next_block(&walk); block >= 0; block = next_block(&walk))
        search_block(sweep, part, &link, block, nearest);
}

void lw_near_each(const struct lw_near_query *query, struct lw_near out[LW_BODY_MAX])
{
    struct sweep sweep;
    start(query, &sweep);
    for (int part = 0; part < query->body->count; part++) {
        struct lw_warm_pair *last = query->warm != NULL ? &query->warm->each[part] : NULL;
        struct nearest nearest = nothing(part, query->d_max);
        search(&sweep, part, improve_by_last(&sweep, last, &nearest), &nearest);
        keep_for_next(&nearest, last);
        out[part] = nearest.best;
    }
}

void lw_near_smallest(const struct lw_near_query *query, struct lw_near *out)
{
    struct lw_warm_pair *last = query->warm != NULL ? &query->warm->smallest : NULL;
    struct nearest nearest = nothing(0, query->d_max);
    struct sweep sweep;
    start(query, &sweep);
    bool seeded = improve_by_last(&sweep, last, &nearest);
    for (int part = 0; part < query->body->count; part++)
        search(&sweep, part, seeded, &nearest);
    keep_for_next(&nearest, last);
    *out = nearest.best;
}
