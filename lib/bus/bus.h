// SPDX-License-Identifier: BSD-3-Clause
// Bus: one LCM connection. Opens, subscribes with own checked handlers, publishes from its own buffer.
//
// Units    ms for timeouts.
// Frames   none.
// Arrays   none.
// Memory   open and subscribe allocate; publish and handle do not. One thread handles, one publishes.
// Errors   open and subscribe say what to do in struct lw_error; refused messages are counted by reason, not printed.
#ifndef LW_BUS_BUS_H
#define LW_BUS_BUS_H

#include "base/refusal.h" // struct lw_refusals
#include "base/schema.h"  // struct lw_error
#include "bus/wire.h"     // enum lw_channel, union lw_message

#include <stdint.h> // int64_t

// A robot's name is part of channel names, which LCM reads as regular expressions.
enum { LW_NAME_MAX = 30 };
#define LW_NAME_LETTERS "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-"

struct lw_bus;

// How to open a bus.
struct lw_bus_config {
    const char *url;              // NULL = LCM_DEFAULT_URL, else the default: multicast that stays on this host
    const char *name;             // robot's prefix of its channels (lw_wire_is_shared: the others); NULL = none
    int64_t session;              // from lw_clock_session, one per process
    struct lw_refusals *refusals; // counts what handlers never see
    bool own_socket; // receives by bus/datagram.h, a socket a channel, in the handling thread, without LCM's threads;
                     // cannot publish
};

typedef void (*lw_bus_handler)(void *user, enum lw_channel channel, const union lw_message *message);

// Opens a bus. Fails LW_E_BUS: no multicast route, bad URL.
LW_MUST_CHECK enum lw_status lw_bus_open(const struct lw_bus_config *config, struct lw_bus **bus,
                                         struct lw_error *error);
void lw_bus_close(struct lw_bus *bus);

// Calls handler(user, ...) from lw_bus_handle for every valid message of a channel. The first call of a bus starts
// LCM's read thread, which inherits the caller's scheduling. Fails LW_E_BUS when the bus does not hear itself. With
// own_socket there is no such thread.
LW_MUST_CHECK enum lw_status lw_bus_subscribe(struct lw_bus *bus, enum lw_channel channel, lw_bus_handler handler,
                                              void *user, struct lw_error *error);

// Waits up to timeout_ms for messages and hands all that came to their handlers, with own_socket one of each channel.
// False when the bus failed.
bool lw_bus_handle(struct lw_bus *bus, int timeout_ms);

// Stamps (session, next seq of the channel, clocks), encodes and sends a message. The stamp used is written back.
// Fails LW_E_BUS when the system refused to send. Cost: one system call, no allocation.
LW_MUST_CHECK enum lw_status lw_bus_publish(struct lw_bus *bus, enum lw_channel channel, union lw_message *message);

// What a process runs, for the log (lcmtypes/scene_t.lcm). Allocates: not for real-time threads.
struct lw_bus_scene {
    const char *program, *mode, *file, *yaml;
};
LW_MUST_CHECK enum lw_status lw_bus_publish_scene(struct lw_bus *bus, const struct lw_bus_scene *scene);

#endif
