// SPDX-License-Identifier: BSD-3-Clause
// World: the set of obstacles that the controller believes in, merged from messages of any number of sources.
//
// Units    metres; ns of the clock that the sources tell times by.
// Frames   base frame of the arm.
// Arrays   obstacles in no particular order; ids are unique.
// Memory   fixed capacity, 12 MB of plain data, never on a stack; all zeros = nothing heard. What was never needed was
//          never touched.
// Errors   enum lw_status; a change is taken whole or not at all.
#ifndef LW_COLLISION_WORLD_H
#define LW_COLLISION_WORLD_H

#include "base/status.h"        // enum lw_status
#include "collision/obstacle.h" // struct lw_obstacle, struct lw_obstacle_change
#include "collision/snapshot.h" // LW_WORLD_MAX, LW_WORLD_VERTICES

// Vertices are kept in chunks of four, as many as a snapshot pads a hull to. The table of ids is a power of two.
enum { LW_SENDERS_MAX = 64, LW_WORLD_SLOTS = 1 << 15, LW_CHUNK = 4, LW_WORLD_CHUNKS = LW_WORLD_VERTICES / LW_CHUNK };

// Newest message of a sender on a channel.
struct lw_sender {
    int64_t session;
    int64_t seq;
    int channel;   // enum lw_world_channel
    int64_t heard; // number of its newest message among all that the world heard, 0 = free place
};

struct lw_world_entry {
    struct lw_obstacle obstacle;
    int64_t time_ns;        // when it was there, 0 = not told
    uint64_t digest;        // of all the above, of its expiry and its vertices
    uint64_t vertex_digest; // 0 = no hull
    int vertex_count;       // 0 = no hull
    int chunk;              // number of its first chunk, from 1
    uint32_t generation;    // another one for every set of vertices
};

struct lw_world_chunk {
    double vertex[3 * LW_CHUNK]; // m, x y z of each
    int next;                    // number of the next one, 0 = none
};

struct lw_world {
    int64_t version;      // number of changes of the set so far; 0 = nothing heard
    struct lw_stamp last; // of the newest message taken in
    int last_channel;     // enum lw_world_channel of that message
    int64_t digest;       // of the set: the sum of those of its obstacles
    int64_t heard;        // messages taken in, those that came again too
    int count;
    uint32_t generation;                     // newest one
    int64_t earliest_ns;                     // nothing expires before
    int chunks_touched;                      // chunks in use, and those given back
    int chunks_used;                         // those in use
    int chunk_free;                          // first of those given back
    struct lw_sender sender[LW_SENDERS_MAX]; // those heard last; the one unheard for longest makes room
    int slot[LW_WORLD_SLOTS];                // where an id is: index + 1, 0 = free
    int64_t owner[LW_WORLD_MAX];             // session that sent the obstacle last
    int64_t expires_ns[LW_WORLD_MAX];        // 0 = never
    struct lw_world_entry entry[LW_WORLD_MAX];
    struct lw_world_chunk chunk[LW_WORLD_CHUNKS];
};

// Applies a change of checked obstacles (lw_obstacle_check), their ids unique. The version grows only when the set
// really differs. An id belongs to the source that sent it last; REMOVE and CLEAR reach obstacles of every source.
//   hulls    a hull that is named without vertices keeps those it has
//   expiry   a change that tells its time drops what its own source sent and what has expired by then. In a full world
//            others' expired ones make room for it, too, the oldest first and no more than it needs; else nobody's
//            clock judges the obstacles of another
//   order    numbers count by sender and channel; a message that comes again is noted as the newest one heard, because
//            its sender waits for that, and changes nothing
// Fails LW_E_OLD when its source has sent a newer message already, LW_E_FULL when there would be more than LW_WORLD_MAX
// obstacles or LW_WORLD_VERTICES vertices, LW_E_UNKNOWN for a hull that is named without vertices and has none; the
// world is unchanged then. Cost: that of the obstacles it names; a REPLACE, and a message after something has
// expired, also look at the owner of each obstacle there is.
LW_MUST_CHECK enum lw_status lw_world_apply(struct lw_world *world, const struct lw_obstacle_change *change);

// The world as the tick sees it: every obstacle, and what commands echo. Fails as lw_snapshot_add, which checked
// obstacles do not. Cost: n log n.
LW_MUST_CHECK enum lw_status lw_world_build(const struct lw_world *world, struct lw_snapshot *snapshot);

// Copies what is used.
//   to  out  all zeros, or a world
void lw_world_copy(const struct lw_world *from, struct lw_world *to);

// Place of an id among the entries; -1 = it is not there. Cost: fixed, on the whole.
int lw_world_find(const struct lw_world *world, int id);

// Vertices of an entry.
//   vertex  out  [3 * LW_HULL_MAX] m, x y z of each, as they were told
// Returns their number, 0 = no hull.
int lw_world_vertices(const struct lw_world *world, const struct lw_world_entry *entry, double vertex[3 * LW_HULL_MAX]);

#endif
