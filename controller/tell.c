// SPDX-License-Identifier: BSD-3-Clause
// Turning a world into messages.
//
// Units    see tell.h.
// Frames   see tell.h.
// Arrays   none.
// Memory   see tell.h.
// Errors   none.
#include "controller/tell.h"

#include <stddef.h> // size_t

static const int64_t ns_per_ms = 1000 * 1000;

static int compare(int64_t a, int64_t b)
{
    return (a > b) - (a < b);
}

// Order of two places, < 0 = a first. Hulls last, because each takes a message.
static int by_message(const struct lw_tell_place *a, const struct lw_tell_place *b)
{
    const int steps[] = {compare(a->hull, b->hull), compare(a->owner, b->owner), compare(a->time_ns, b->time_ns),
                         compare(a->expires_ns, b->expires_ns), compare(a->id, b->id)};
    for (size_t i = 0; i < sizeof steps / sizeof steps[0]; i++)
        if (steps[i] != 0)
            return steps[i];
    return 0;
}

static struct lw_tell_place place_of(const struct lw_world *world, int at)
{
    const struct lw_world_entry *entry = &world->entry[at];
    return (struct lw_tell_place){.owner = world->owner[at],
                                  .time_ns = entry->time_ns,
                                  .expires_ns = world->expires_ns[at],
                                  .id = entry->obstacle.id,
                                  .hull = entry->vertex_count > 0};
}

// Lets a place sink in a heap of n, where none stands above one that comes after it.
static void sink(struct lw_tell_place *heap, int at, int n)
{
    for (int child = 2 * at + 1; child < n; child = 2 * at + 1) {
        child += child + 1 < n && by_message(&heap[child], &heap[child + 1]) < 0;
        if (by_message(&heap[at], &heap[child]) >= 0)
            return;
        const struct lw_tell_place place = heap[at];
        heap[at] = heap[child];
        heap[child] = place;
        at = child;
    }
}

// In place: the library's sort takes memory from the heap.
static void sort(struct lw_tell_place *place, int n)
{
    for (int at = n / 2 - 1; at >= 0; at--)
        sink(place, at, n);
    for (int left = n - 1; left > 0; left--) {
        const struct lw_tell_place last = place[0];
        place[0] = place[left];
        place[left] = last;
        sink(place, 0, left);
    }
}

void lw_tell_begin(struct lw_tell *tell, const struct lw_world *world, int64_t now_ns)
{
    tell->count = tell->next = 0;
    for (int at = 0; at < world->count; at++) {
        const struct lw_tell_place place = place_of(world, at);
        if (now_ns == 0 || place.expires_ns == 0 || place.expires_ns > now_ns)
            tell->place[tell->count++] = place;
    }
    sort(tell->place, tell->count);
}

// Index of the next obstacle that is still there, -1 = none is left. What it is now counts, not what it was.
static int peek(struct lw_tell *tell, const struct lw_world *world)
{
    while (tell->next < tell->count) {
        const int at = lw_world_find(world, tell->place[tell->next].id);
        if (at >= 0)
            return at;
        tell->next++;
    }
    return -1;
}

static bool goes_with(const struct lw_tell_place *first, const struct lw_tell_place *next)
{
    return !first->hull && !next->hull && first->owner == next->owner && first->time_ns == next->time_ns &&
           first->expires_ns == next->expires_ns;
}

bool lw_tell_next(struct lw_tell *tell, const struct lw_world *world, struct lw_obstacle_change *change)
{
    int at = peek(tell, world);
    if (at < 0)
        return false;
    *change = (struct lw_obstacle_change){.op = LW_UPSERT};
    const struct lw_tell_place first = place_of(world, at);
    change->owner = first.owner;
    change->time_ns = first.time_ns;
    change->valid_for_ms = (int)(first.expires_ns > 0 ? (first.expires_ns - first.time_ns) / ns_per_ms : 0);
    change->vertex_count = lw_world_vertices(world, &world->entry[at], change->vertex);
    struct lw_tell_place next = first;
    do {
        change->obstacle[change->count++] = world->entry[at].obstacle;
        tell->next++;
        at = peek(tell, world);
        next = at >= 0 ? place_of(world, at) : next;
    } while (at >= 0 && change->count < LW_CHANGE_MAX && goes_with(&first, &next));
    return true;
}
