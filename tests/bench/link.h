// SPDX-License-Identifier: BSD-3-Clause
// Link: the line between the two ends of a ping-pong. Every kind carries datagrams of the same size: a JOINT_STATE
// there, a JOINT_COMMAND back, each with the header that LCM puts before it.
//
// Units    none.
// Frames   none.
// Arrays   none.
// Memory   one link a process, static; open may allocate, send and receive do not.
// Errors   open returns false and says why on stderr.
#ifndef LW_BENCH_LINK_H
#define LW_BENCH_LINK_H

#include <stdbool.h> // bool
#include <stddef.h>  // size_t
#include <stdint.h>  // int64_t

// A reply that takes longer is lost.
enum { LW_LINK_TIMEOUT_MS = 20 };

struct lw_link {
    const char *name;
    // Joins the line: ping sends states and hears commands, pong the other way round.
    bool (*open)(bool is_ping);
    // Sends one message that carries a number.
    bool (*send)(int64_t number);
    // Waits for a message until the timeout. False when none came.
    bool (*receive)(int64_t *number);
};

// UDP multicast and nothing else; LCM's wire received by LCM's threads, or by a socket of its own.
extern const struct lw_link lw_link_udp, lw_link_lcm, lw_link_own;

// Bytes of a datagram, there (ping's) or back.
size_t lw_link_bytes(bool from_ping);

#endif
