// SPDX-License-Identifier: BSD-3-Clause
// Merging obstacle messages into the world.
//
// Units    metres.
// Frames   base frame.
// Arrays   see world.h.
// Memory   the caller's; one working copy on the stack.
// Errors   see world.h.
#include "collision/world.h"

#include "base/digest.h" // lw_digest_*

#include <stdbool.h> // bool
#include <stddef.h>  // NULL
#include <string.h>  // memcpy

static int find(const struct lw_world *world, int id)
{
    for (int i = 0; i < world->count; i++)
        if (world->obstacle[i].id == id)
            return i;
    return -1;
}

static bool equal(const double *a, const double *b, int n)
{
    for (int i = 0; i < n; i++)
        if (a[i] != b[i])
            return false;
    return true;
}

static bool same(const struct lw_obstacle *a, const struct lw_obstacle *b)
{
    return a->id == b->id && a->shape == b->shape && a->radius == b->radius && equal(a->p, b->p, 3) &&
           equal(a->quat, b->quat, 4) && equal(a->size, b->size, 3) && equal(a->v, b->v, 3) &&
           equal(a->omega, b->omega, 3);
}

static bool mentions(const struct lw_obstacle_change *change, int id)
{
    for (int i = 0; i < change->count; i++)
        if (change->obstacle[i].id == id)
            return true;
    return false;
}

static void keep(struct lw_world *world, int from, int to)
{
    world->obstacle[to] = world->obstacle[from];
    world->owner[to] = world->owner[from];
}

// Drops every obstacle that the change removes; returns how many. The order of the others is kept.
static int drop(struct lw_world *world, const struct lw_obstacle_change *change)
{
    int kept = 0;
    for (int i = 0; i < world->count; i++) {
        const struct lw_obstacle *o = &world->obstacle[i];
        const bool listed = change->op != LW_CLEAR && mentions(change, o->id);
        const bool gone = change->op == LW_CLEAR || (change->op == LW_REMOVE && listed) ||
                          (change->op == LW_REPLACE && world->owner[i] == change->stamp.session && !listed);
        if (!gone)
            keep(world, i, kept++);
    }
    const int dropped = world->count - kept;
    world->count = kept;
    return dropped;
}

// Adds or overwrites one obstacle. Returns whether the world differs now; *full when there was no room.
static bool put(struct lw_world *world, struct lw_obstacle obstacle, int64_t session, bool *full)
{
    int at = find(world, obstacle.id);
    if (at >= 0 && world->owner[at] == session && same(&world->obstacle[at], &obstacle))
        return false;
    if (at < 0 && world->count == LW_REGISTRY_MAX) {
        *full = true;
        return false;
    }
    if (at < 0)
        at = world->count++;
    world->obstacle[at] = obstacle;
    world->owner[at] = session;
    return true;
}

// Place in the table of senders of a session; a new one takes the place of the oldest.
static struct lw_sender *find_sender(struct lw_world *world, int64_t session)
{
    for (int i = 0; i < LW_SENDERS_MAX; i++)
        if (world->sender[i].session == session)
            return &world->sender[i];
    struct lw_sender *sender = &world->sender[world->next_sender];
    world->next_sender = (world->next_sender + 1) % LW_SENDERS_MAX;
    *sender = (struct lw_sender){.session = session};
    return sender;
}

static int64_t digest(const struct lw_world *world)
{
    uint64_t digest = lw_digest_int(LW_DIGEST_START, world->count);
    for (int i = 0; i < world->count; i++) {
        const struct lw_obstacle *o = &world->obstacle[i];
        digest = lw_digest_doubles(lw_digest_int(digest, o->id), o->p, 3);
        digest = lw_digest_doubles(digest, &o->radius, 1);
    }
    return (int64_t)digest;
}

// Whether a change names a hull, without vertices, that is not there.
static bool names_unknown_hull(const struct lw_world *world, const struct lw_obstacle_change *change)
{
    if (change->op == LW_REMOVE || change->op == LW_CLEAR || change->vertex_count > 0)
        return false;
    for (int i = 0; i < change->count; i++) {
        const int at = change->obstacle[i].shape == LW_HULL ? find(world, change->obstacle[i].id) : -1;
        if (change->obstacle[i].shape == LW_HULL && (at < 0 || world->obstacle[at].shape != LW_HULL))
            return true;
    }
    return false;
}

enum lw_status lw_world_apply(struct lw_world *world, const struct lw_obstacle_change *change)
{
    struct lw_world next = *world;
    struct lw_sender *sender = find_sender(&next, change->stamp.session);
    int64_t *newest = &sender->seq[lw_change_channel(change)];
    if (change->stamp.seq < *newest)
        return LW_E_OLD;
    if (change->stamp.seq == *newest) {
        world->last = change->stamp;
        world->last_channel = (int)lw_change_channel(change);
        return LW_OK;
    }
    if (names_unknown_hull(world, change))
        return LW_E_UNKNOWN;
    *newest = change->stamp.seq;
    bool changed = drop(&next, change) > 0;

    bool full = false;
    if (change->op == LW_UPSERT || change->op == LW_REPLACE)
        for (int i = 0; i < change->count; i++)
            changed |= put(&next, change->obstacle[i], change->stamp.session, &full);
    if (full)
        return LW_E_FULL;

    // Hearing anything at all is version 1: an empty world is known, not unheard of.
    next.version += changed || next.version == 0;
    next.last = change->stamp;
    next.last_channel = (int)lw_change_channel(change);
    next.digest = digest(&next);
    *world = next;
    return LW_OK;
}

void lw_world_build(const struct lw_world *world, struct lw_snapshot *snapshot)
{
    lw_snapshot_begin(snapshot);
    for (int i = 0; i < world->count; i++) {
        const struct lw_obstacle *o = &world->obstacle[i];
        const struct lw_solid solid = lw_obstacle_solid(o, NULL, 0);
        struct lw_pose pose;
        struct lw_motion motion = {0};
        memcpy(motion.v, o->v, sizeof motion.v);
        memcpy(motion.omega, o->omega, sizeof motion.omega);
        if (lw_pose_make(o->p, o->quat, &pose) == LW_OK)
            (void)(lw_snapshot_add(snapshot, o->id, 1, &solid, &pose, &motion) == LW_OK);
    }
    lw_snapshot_end(snapshot);
    snapshot->version = world->version;
    snapshot->last = world->last;
    snapshot->last_channel = world->last_channel;
    snapshot->digest = world->digest;
}
