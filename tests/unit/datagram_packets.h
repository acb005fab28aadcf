// SPDX-License-Identifier: BSD-3-Clause
// Packets on LCM's wire for the tests of the datagram.
//
// Units    bytes.
// Frames   none.
// Arrays   none.
// Memory   stack.
// Errors   none.
#ifndef LW_TESTS_DATAGRAM_PACKETS_H
#define LW_TESTS_DATAGRAM_PACKETS_H

#include "helpers.h"

enum { HEAD = 8, PACKET_MAX = 8192 };

#define NAME_63 "ABCDEFGHIJKLMNOPQRSTUVWXYZ_abcdefghijklmnopqrstuvwxyz_012345678"

struct packet {
    unsigned char bytes[PACKET_MAX];
    size_t size;
};

// Short message with a random sequence number and payload.
static inline struct packet make_packet(struct random *random, const char *channel, size_t payload)
{
    struct packet p = {.size = HEAD + strlen(channel) + 1 + payload};
    for (size_t i = 0; i < p.size; i++)
        p.bytes[i] = (unsigned char)random_bits(random);
    memcpy(p.bytes, "LC02", 4);
    memcpy(p.bytes + HEAD, channel, strlen(channel) + 1);
    return p;
}

#endif
