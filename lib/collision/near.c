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

#include <math.h>    // isnan, NAN, INFINITY
#include <stdbool.h> // bool
#include <stddef.h>  // NULL

// A query with what its time makes of the world: how far the members of each block may have moved.
struct sweep {
    const struct lw_near_query *query;
    struct lw_snapshot_blocks const *block;
    float slack[LW_WORLD_BLOCKS];
    float radius[LW_WORLD_BLOCKS]; // of the blocks, slack included
};

static void start(const struct lw_near_query *query, struct sweep *sweep)
{
    const struct lw_snapshot *world = query->world;
    sweep->query = query;
    sweep->block = &world->block;
    for (int i = 0; i < world->blocks; i++) {
        const double age = lw_moving_age(world->block.time_ns[i], query->time_ns);
        sweep->slack[i] = (float)(world->block.speed[i] * age * (1 + 1e-6));
        sweep->radius[i] = world->block.r[i] + sweep->slack[i] * (1 + 1e-6F);
    }
    for (int i = world->blocks; i % LW_WORLD_BLOCK != 0; i++)
        sweep->radius[i] = 0;
}

static struct lw_sixteen blocks_at(const struct sweep *sweep, int i)
{
    return (struct lw_sixteen){&sweep->block->x[i], &sweep->block->y[i], &sweep->block->z[i], &sweep->radius[i]};
}

static struct lw_sixteen spheres_at(const struct sweep *sweep, int block)
{
    const struct lw_snapshot_spheres *s = &sweep->query->world->sphere;
    const int i = block * LW_WORLD_BLOCK;
    return (struct lw_sixteen){&s->x[i], &s->y[i], &s->z[i], &s->r[i]};
}

// --- one pair ---

static struct lw_near none(int part, double d_max)
{
    return (struct lw_near){.distance = {.d = d_max, .flags = LW_DISTANCE_NO_NORMAL}, .part = part, .other = -1};
}

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
        *out = (struct lw_distance){.d = NAN, .flags = LW_DISTANCE_NO_NORMAL}; // of no two of these kinds
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
    for (int k = 0; k < 3; k++)
        out->velocity[k] = 0;
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
    const struct lw_sixteen spheres = spheres_at(sweep, block);
    for (unsigned near = lw_cull_near(&spheres, link, sweep->slack[block]); near != 0; near &= near - 1) {
        const int i = block * LW_WORLD_BLOCK + __builtin_ctz(near);
        if (i < sweep->query->world->bounded)
            list(sweep, part, i, out);
    }
}

void lw_near_range(const struct lw_near_query *query, struct lw_near_list *out)
{
    const struct lw_snapshot *world = query->world;
    struct sweep sweep;
    start(query, &sweep);
    out->count = out->needed = 0;
    for (int part = 0; part < query->body->count; part++) {
        const struct lw_cull link = lw_cull_link(&query->placed->capsule[part], query->d_max);
        for (int first = 0; first < world->blocks; first += LW_WORLD_BLOCK) {
            const struct lw_sixteen blocks = blocks_at(&sweep, first);
            for (unsigned near = lw_cull_near(&blocks, &link, 0); near != 0; near &= near - 1) {
                const int block = first + __builtin_ctz(near);
                if (block < world->blocks)
                    list_block(&sweep, part, &link, block, out);
            }
        }
        for (int i = world->bounded; i < world->count; i++)
            list(&sweep, part, i, out);
    }
}

// --- self pairs ---

static void measure_self(const struct lw_body *body, const struct lw_placed *placed, struct lw_body_pair pair,
                         struct lw_near *out)
{
    *out = (struct lw_near){.part = pair.part, .other = pair.other};
    if (pair.other != body->tool_part || body->tool.kind != LW_TOOL_HULL) {
        lw_distance_capsules(&placed->capsule[pair.part], &placed->capsule[pair.other], &out->distance);
        return;
    }
    const struct lw_shape tool = lw_body_tool_shape(body, placed);
    lw_distance_link(&placed->capsule[pair.part], &tool, (double)INFINITY, NULL, &out->distance);
}

void lw_near_self(const struct lw_body *body, const struct lw_placed *placed, double d_max, struct lw_near_list *out)
{
    for (int i = 0; i < body->pair_count; i++) {
        struct lw_near spare, *near = out->count < LW_NEAR_MAX ? &out->pair[out->count] : &spare;
        measure_self(body, placed, body->pair[i], near);
        if (near->distance.d > d_max)
            continue;
        out->needed++;
        out->count += near != &spare;
    }
}

// --- nearest ---

// Takes obstacle i of the snapshot if it is nearer to the part than the best so far. Distances beyond that one are not
// followed up, but equal ones are.
static void improve(const struct sweep *sweep, int part, int i, struct lw_near *best)
{
    struct lw_near found;
    const double bound = best->distance.d;
    if (!measure(sweep->query, part, i, bound + 1e-9, &found))
        return;
    const double d = found.distance.d;
    const bool equal = d == bound && (best->obstacle == 0 || (best->part == part && found.obstacle < best->obstacle));
    if (d < bound || equal || isnan(d))
        *best = found;
}

// Index of the least of sixteen bounds, of the ones that are not numbers the first.
static int least(const float bound[16], int count)
{
    int at = 0;
    for (int i = 0; i < count; i++) {
        if (isnan(bound[i]))
            return i;
        at = bound[i] < bound[at] ? i : at;
    }
    return at;
}

// The obstacle of the least lower bound in the block of the least lower bound, -1 = there is none: a first guess.
static int guess(const struct sweep *sweep, const struct lw_cull *link)
{
    const struct lw_snapshot *world = sweep->query->world;
    float bound[LW_WORLD_BLOCK], lowest = INFINITY;
    int best = -1;
    for (int first = 0; first < world->blocks; first += LW_WORLD_BLOCK) {
        const struct lw_sixteen blocks = blocks_at(sweep, first);
        const int left = world->blocks - first;
        lw_cull_bounds(&blocks, link, bound);
        const int at = least(bound, left < LW_WORLD_BLOCK ? left : LW_WORLD_BLOCK);
        if (best < 0 || !(bound[at] >= lowest)) {
            lowest = bound[at];
            best = first + at;
        }
    }
    if (best < 0)
        return -1;
    const struct lw_sixteen spheres = spheres_at(sweep, best);
    const int left = world->bounded - best * LW_WORLD_BLOCK;
    lw_cull_bounds(&spheres, link, bound);
    return best * LW_WORLD_BLOCK + least(bound, left < LW_WORLD_BLOCK ? left : LW_WORLD_BLOCK);
}

static void search_block(const struct sweep *sweep, struct lw_cull *link, int block, int measured, struct lw_near *best,
                         int part)
{
    const struct lw_sixteen spheres = spheres_at(sweep, block);
    for (unsigned near = lw_cull_near(&spheres, link, sweep->slack[block]); near != 0; near &= near - 1) {
        const int i = block * LW_WORLD_BLOCK + __builtin_ctz(near);
        if (i < sweep->query->world->bounded && i != measured)
            improve(sweep, part, i, best);
    }
    lw_cull_look(link, best->distance.d);
}

// Branch and bound over the obstacles of one part.
static void search(const struct sweep *sweep, int part, struct lw_near *best)
{
    const struct lw_snapshot *world = sweep->query->world;
    struct lw_cull link = lw_cull_link(&sweep->query->placed->capsule[part], best->distance.d);
    for (int i = world->bounded; i < world->count; i++)
        improve(sweep, part, i, best);
    const int first_guess = guess(sweep, &link);
    if (first_guess >= 0)
        improve(sweep, part, first_guess, best);
    lw_cull_look(&link, best->distance.d);
    for (int first = 0; first < world->blocks; first += LW_WORLD_BLOCK) {
        const struct lw_sixteen blocks = blocks_at(sweep, first);
        for (unsigned near = lw_cull_near(&blocks, &link, 0); near != 0; near &= near - 1) {
            const int block = first + __builtin_ctz(near);
            if (block < world->blocks)
                search_block(sweep, &link, block, first_guess, best, part);
        }
    }
}

void lw_near_each(const struct lw_near_query *query, struct lw_near out[LW_BODY_MAX])
{
    struct sweep sweep;
    start(query, &sweep);
    for (int part = 0; part < query->body->count; part++) {
        out[part] = none(part, query->d_max);
        search(&sweep, part, &out[part]);
    }
}

void lw_near_smallest(const struct lw_near_query *query, struct lw_near *out)
{
    struct sweep sweep;
    start(query, &sweep);
    *out = none(0, query->d_max);
    for (int part = 0; part < query->body->count; part++)
        search(&sweep, part, out);
}
