// SPDX-License-Identifier: BSD-3-Clause
// The rules of collision/world.h once more, as plainly as can be: one record for each of a few ids, no table, no sums.
//
// Units    metres, ns.
// Frames   base frame.
// Arrays   records by id 0..MODEL_IDS-1; lw_world knows them by model_id.
// Memory   the caller's.
// Errors   none.
#ifndef LW_TESTS_WORLD_MODEL_H
#define LW_TESTS_WORLD_MODEL_H

#include "collision/world.h"

#include <stdbool.h> // bool
#include <stdint.h>  // int64_t
#include <string.h>  // memcmp

enum { MODEL_IDS = 40 };

// What is known of an id; owner 0 = it is not there.
struct record {
    struct lw_obstacle obstacle;
    int64_t owner, time_ns, expires_ns;
    int64_t vertex_count;
};

// Ids that want to stand in one another's place in the table of ids: their homes are three slots at its end.
static inline int model_id(int i)
{
    static int ids[MODEL_IDS];
    for (int id = 1, n = 0; n < MODEL_IDS && ids[MODEL_IDS - 1] == 0; id++)
        if (((uint32_t)id * UINT32_C(2654435769)) >> 17 >= LW_WORLD_SLOTS - 3)
            ids[n++] = id;
    return ids[i];
}

static inline struct record *model_of(struct record *records, int id)
{
    for (int i = 0; i < MODEL_IDS; i++)
        if (model_id(i) == id)
            return &records[i];
    return &records[0]; // no change names another id
}

static inline bool model_adds(const struct lw_obstacle_change *change)
{
    return change->op == LW_UPSERT || change->op == LW_REPLACE;
}

// Whether a change names a hull without vertices that has none.
static inline bool model_is_unknown(struct record *records, const struct lw_obstacle_change *change)
{
    for (int i = 0; model_adds(change) && i < change->count; i++)
        if (change->obstacle[i].shape == LW_HULL && change->vertex_count == 0 &&
            model_of(records, change->obstacle[i].id)->vertex_count == 0)
            return true;
    return false;
}

// Whether what stands under an id outlives a change.
static inline bool model_keeps(const struct record *r, const struct lw_obstacle_change *change, bool listed)
{
    const bool own = r->owner == change->stamp.session;
    const bool over = own && r->expires_ns != 0 && change->time_ns != 0 && r->expires_ns <= change->time_ns;
    if (change->op == LW_CLEAR)
        return false;
    if (listed)
        return change->op != LW_REMOVE;
    return !over && !(change->op == LW_REPLACE && own);
}

// What a change does.
static inline void model_apply(struct record *records, const struct lw_obstacle_change *change)
{
    bool listed[MODEL_IDS] = {false};
    for (int i = 0; i < change->count; i++)
        listed[model_of(records, change->obstacle[i].id) - records] = true;
    for (int id = 0; id < MODEL_IDS; id++)
        if (!model_keeps(&records[id], change, listed[id]))
            records[id] = (struct record){.owner = 0};
    for (int i = 0; model_adds(change) && i < change->count; i++) {
        struct record *r = model_of(records, change->obstacle[i].id);
        const bool hull = change->obstacle[i].shape == LW_HULL;
        const int64_t vertices = !hull ? 0 : change->vertex_count > 0 ? change->vertex_count : r->vertex_count;
        *r = (struct record){change->obstacle[i], change->stamp.session, change->time_ns, lw_change_expires_ns(change),
                             vertices};
    }
}

struct model_sum {
    int count, chunks;
    uint64_t digest; // of those that the world has
};

static inline bool model_is(const struct lw_world *world, int at, const struct record *r)
{
    const struct lw_world_entry *entry = &world->entry[at];
    return memcmp((const void *)&entry->obstacle, (const void *)&r->obstacle, sizeof r->obstacle) == 0 &&
           world->owner[at] == r->owner && world->expires_ns[at] == r->expires_ns && entry->time_ns == r->time_ns &&
           entry->vertex_count == r->vertex_count;
}

// Whether the world has what the records say, id by id; and what that amounts to.
static inline bool model_matches(const struct lw_world *world, const struct record *records, struct model_sum *sum)
{
    *sum = (struct model_sum){.count = 0};
    for (int id = 0; id < MODEL_IDS; id++) {
        const struct record *r = &records[id];
        const int at = lw_world_find(world, model_id(id));
        if ((at >= 0) != (r->owner != 0) || (at >= 0 && !model_is(world, at, r)))
            return false;
        sum->count += at >= 0;
        sum->chunks += (int)(r->vertex_count + LW_CHUNK - 1) / LW_CHUNK;
        sum->digest += at >= 0 ? world->entry[at].digest : 0;
    }
    return true;
}

#endif
