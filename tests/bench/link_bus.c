// SPDX-License-Identifier: BSD-3-Clause
// lib/bus as the programs use it: one connection that only sends, one that only hears, either by LCM's threads one
// below the real-time thread or by a socket of its own.
//
// Units    none.
// Frames   none.
// Arrays   none.
// Memory   static, and what lib/bus allocates.
// Errors   see link.h.
#include "link.h"

#include "base/clock.h"   // lw_clock_session
#include "base/refusal.h" // struct lw_refusals
#include "base/thread.h"  // lw_thread_set_priority
#include "bus/bus.h"      // lw_bus_*

#include <stdio.h>  // fprintf
#include <string.h> // strlen

// As in controller/live.c.
enum { RX_PRIORITY = 79, NUMBER_PERIOD_NS = 1000000 };

static struct {
    struct lw_bus *in, *out;
    enum lw_channel sends;
    int64_t heard; // newest number
    bool fresh;
} end;

size_t lw_link_bytes(bool from_ping)
{
    static const char magic_and_sequence[] = "LC02....";
    const enum lw_channel channel = from_ping ? LW_CHANNEL_JOINT_STATE : LW_CHANNEL_JOINT_COMMAND;
    return strlen(magic_and_sequence) + strlen(lw_wire_channel_name(channel)) + 1 + lw_wire_size(channel);
}

static void on_message(void *user, enum lw_channel channel, const union lw_message *message)
{
    (void)user;
    end.heard = channel == LW_CHANNEL_JOINT_STATE ? message->joint_state.tick : message->joint_command.state_tick;
    end.fresh = true;
}

// Opens both connections; the thread that subscribes hands its priority to LCM's, where there are any.
static bool open_bus(bool is_ping, bool own_socket)
{
    static struct lw_refusals refusals;
    struct lw_error error;
    const struct lw_bus_config out = {.session = lw_clock_session(), .refusals = &refusals};
    struct lw_bus_config in = out;
    in.own_socket = own_socket;
    const enum lw_channel hears = is_ping ? LW_CHANNEL_JOINT_COMMAND : LW_CHANNEL_JOINT_STATE;
    end.sends = is_ping ? LW_CHANNEL_JOINT_STATE : LW_CHANNEL_JOINT_COMMAND;
    (void)lw_thread_set_priority(RX_PRIORITY); // the ping-pong says itself when the system refuses
    if (lw_bus_open(&out, &end.out, &error) == LW_OK && lw_bus_open(&in, &end.in, &error) == LW_OK &&
        lw_bus_subscribe(end.in, hears, on_message, NULL, &error) == LW_OK)
        return true;
    fprintf(stderr, "pingpong: %s\n", error.text);
    return false;
}

static bool open_lcm(bool is_ping)
{
    return open_bus(is_ping, false);
}

static bool open_own(bool is_ping)
{
    return open_bus(is_ping, true);
}

static bool send_bus(int64_t number)
{
    union lw_message message;
    if (end.sends == LW_CHANNEL_JOINT_STATE)
        message.joint_state = (struct lw_joint_state){.tick = number, .period_ns = NUMBER_PERIOD_NS};
    else
        message.joint_command = (struct lw_joint_command){.state_tick = number};
    return lw_bus_publish(end.out, end.sends, &message) == LW_OK;
}

static bool receive_bus(int64_t *number)
{
    end.fresh = false;
    if (!lw_bus_handle(end.in, LW_LINK_TIMEOUT_MS) || !end.fresh)
        return false;
    *number = end.heard;
    return true;
}

const struct lw_link lw_link_lcm = {"lcm", open_lcm, send_bus, receive_bus};
const struct lw_link lw_link_own = {"own", open_own, send_bus, receive_bus};
