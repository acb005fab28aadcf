// SPDX-License-Identifier: BSD-3-Clause
// Live: what the threads of the controller's process share. Hand-over is by single-writer mailboxes and one ring;
// nothing else is shared.
//   rt     (FIFO P)    sleeps to its deadline, ticks, publishes on a connection of its own        realtime.c
//   rx     (FIFO P-1)  joint states                                                               listen.c
//   world  (normal)    obstacles and requests, merged into a snapshot; publishes WORLD            gather.c
//   main   (normal)    statistics, STATUS and SCENE, signals                                      live.c
//
// Units    ns of CLOCK_MONOTONIC.
// Frames   see tick.h.
// Arrays   none.
// Memory   static, touched and locked before the threads start.
// Errors   see control.h.
#ifndef LW_CONTROLLER_LIVE_H
#define LW_CONTROLLER_LIVE_H

#include "base/mailbox.h" // struct lw_mailbox
#include "controller/control.h"
#include "controller/postmortem.h" // struct lw_heard
#include "controller/tell.h"       // struct lw_tell

#include <stdatomic.h> // atomic_bool

// A joint state, when it came, and what had become of the stream then.
struct lw_arrival {
    struct lw_joint_state joint;
    int64_t arrival_ns;
    struct lw_lease lease;
};

struct lw_live {
    struct lw_control *control;
    struct lw_bus *rt_bus, *rx_bus, *world_rx_bus, *world_bus, *status_bus;
    struct lw_mailbox state_box;   // rx -> rt: struct lw_arrival
    struct lw_mailbox world_box;   // world -> rt: struct lw_snapshot
    struct lw_mailbox request_box; // world -> rt: struct lw_request
    _Alignas(LW_CACHE_LINE) struct lw_arrival state_slots[LW_MAILBOX_SLOTS];
    _Alignas(LW_CACHE_LINE) struct lw_snapshot world_slots[LW_MAILBOX_SLOTS];
    _Alignas(LW_CACHE_LINE) struct lw_request request_slots[LW_MAILBOX_SLOTS];
    struct lw_health health;            // rt -> main
    struct lw_heard heard;              // world -> main
    struct lw_postmortem postmortem;    // main
    struct lw_lease lease;              // rx: the plant heard
    struct lw_world world;              // world: all that was heard, merged
    struct lw_tell tell;                // world: what is told of it
    atomic_int_fast64_t world_heard_ns; // world -> main: when the newest message about obstacles came, 0 = none
    struct lw_request_memory requests;  // world: those put into the mailbox
    atomic_bool stopping;               // main -> rt: brake, then end
    atomic_bool abandoned;              // main -> rt: end now, a second signal came
    atomic_bool rt_done;                // rt -> all: at rest, or never moved
    atomic_bool bus_failed;             // rx, world -> main
};

// The threads; `user` is the struct lw_live.
void *lw_live_realtime(void *user);
void *lw_live_receive(void *user);
void *lw_live_world(void *user);

// Subscribes what the two listening threads handle, or only the world thread.
LW_MUST_CHECK enum lw_status lw_live_subscribe(struct lw_live *live);
LW_MUST_CHECK enum lw_status lw_live_subscribe_world(struct lw_live *live);

#endif
