// SPDX-License-Identifier: BSD-3-Clause
// Fuzz target: decoding a message of any channel. The first byte is the channel, the second says whether the rest is
// taken as it is or made to pass the checks of size and fingerprint, so that values are reached.
//
// Units    those of lcmtypes/*.lcm.
// Frames   base frame.
// Arrays   see bus/wire.h.
// Memory   the packet is a block of its own, so that a read beyond its end is found.
// Errors   see fuzz.h.
#include "bus/wire.h"
#include "fuzz.h"
#include "tests/unit/wire_ranges.h" // keeps_its_ranges

#include <string.h> // memcpy, memcmp

enum { FINGERPRINT_BYTES = 8 };

// A block of the channel's exact size with its fingerprint, filled from the bytes as far as they reach.
static void repair(enum lw_channel channel, const struct bytes *from, unsigned char *packet)
{
    const uint32_t size = lw_wire_size(channel), room = size - FINGERPRINT_BYTES;
    const uint64_t fingerprint = (uint64_t)lw_wire_fingerprint(channel);
    memset(packet, 0, size);
    for (int i = 0; i < FINGERPRINT_BYTES; i++)
        packet[i] = (unsigned char)(fingerprint >> (8 * (FINGERPRINT_BYTES - 1 - i)));
    if (from->size > 0)
        memcpy(packet + FINGERPRINT_BYTES, from->data, from->size < room ? from->size : room);
}

// Channels whose decoder takes every byte: what is sent on is what came.
static bool is_whole(enum lw_channel channel)
{
    return channel == LW_CHANNEL_JOINT_STATE || channel == LW_CHANNEL_GOAL || channel == LW_CHANNEL_STOP;
}

// Encodes what was decoded, decodes that, and encodes again: the same bytes.
static void check_round_trip(enum lw_channel channel, const union lw_message *message, const unsigned char *packet)
{
    unsigned char first[LW_WIRE_MAX], second[LW_WIRE_MAX];
    union lw_message again;
    const uint32_t size = lw_wire_encode(channel, message, first);
    CHECK(size == lw_wire_size(channel));
    CHECK(!is_whole(channel) || memcmp(first, packet, size) == 0);
    CHECK(lw_wire_decode(channel, first, size, &again) == LW_OK);
    CHECK(lw_wire_encode(channel, &again, second) == size);
    CHECK(memcmp(first, second, size) == 0);
}

// What is refused leaves the message as it was.
static void check_refusal(const union lw_message *message)
{
    const unsigned char *bytes = (const unsigned char *)message;
    for (size_t i = 0; i < sizeof *message; i++)
        CHECK(bytes[i] == 0x5a);
}

static void check_packet(enum lw_channel channel, const unsigned char *packet, uint32_t size)
{
    union lw_message message;
    memset(&message, 0x5a, sizeof message);
    if (lw_wire_decode(channel, packet, size, &message) == LW_OK) {
        CHECK(keeps_its_ranges(channel, &message));
        check_round_trip(channel, &message, packet);
    } else {
        check_refusal(&message);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct bytes in = {data, size};
    const enum lw_channel channel = (enum lw_channel)(next_byte(&in) % LW_CHANNEL_COUNT);
    const bool raw = next_byte(&in) % 2;
    const uint32_t length = raw ? (uint32_t)in.size : lw_wire_size(channel);
    unsigned char *packet = malloc(length);
    CHECK(packet != NULL);
    if (!raw)
        repair(channel, &in, packet);
    else if (length > 0)
        memcpy(packet, in.data, length);
    check_packet(channel, packet, length);
    // A packet without a channel name comes with a size of nearly 2^32.
    CHECK(!raw || lw_wire_decode(channel, packet, 0u - length - 1, &(union lw_message){0}) == LW_E_SIZE);
    free(packet);
    return 0;
}
