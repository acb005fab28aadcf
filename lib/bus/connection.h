// SPDX-License-Identifier: BSD-3-Clause
// Connection: what bus.c and log.c know of a bus. For lib/bus alone.
//
// Units    none.
// Frames   none.
// Arrays   one entry a channel.
// Memory   allocated by lw_bus_open.
// Errors   none.
#ifndef LW_BUS_CONNECTION_H
#define LW_BUS_CONNECTION_H

#include "bus/bus.h"
#include "bus/datagram.h" // struct lw_datagram

#include <lcm/lcm.h> // lcm_t
#include <leeway_scene_t.h>

enum { LW_CHANNEL_NAME_MAX = 64 };

struct lw_subscription {
    struct lw_bus *bus;
    enum lw_channel channel;
    lw_bus_handler handler;
    void *user;
};

struct lw_bus {
    lcm_t *lcm; // NULL with own_socket
    struct sockaddr_in group;
    struct lw_datagram datagram[LW_CHANNEL_COUNT]; // with own_socket, of the channels subscribed
    int64_t session;
    char name[LW_NAME_MAX + 2]; // prefix of channels, with its underscore
    char channel_name[LW_CHANNEL_COUNT][LW_CHANNEL_NAME_MAX];
    char scene_channel[LW_CHANNEL_NAME_MAX];
    int64_t seq[LW_CHANNEL_COUNT];
    int64_t scene_seq;
    unsigned char buffer[LW_WIRE_MAX];
    struct lw_subscription subscription[LW_CHANNEL_COUNT];
    struct lw_refusals *refusals;
};

// The next SCENE message of a bus; points into `scene`.
leeway_scene_t lw_bus_scene_wire(struct lw_bus *bus, const struct lw_bus_scene *scene);

#endif
