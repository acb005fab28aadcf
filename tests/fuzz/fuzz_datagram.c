// SPDX-License-Identifier: BSD-3-Clause
// Fuzz target: finding a message in a packet from the network. The first byte chooses the channel, the second how many
// bytes of a right head stand before the rest, so that what comes behind a head is reached too. The socket filter, run
// here as the kernel would, passes the same packets.
//
// Units    bytes.
// Frames   none.
// Arrays   none.
// Memory   the packet is a block of its own, so that a read beyond its end is found.
// Errors   see fuzz.h.
#include "bus/datagram.h"
#include "fuzz.h"

#include <string.h> // memcpy

enum { MAGIC_AND_NUMBER = 8, UDP_HEADER = 8, HEAD_MAX = MAGIC_AND_NUMBER + LW_DATAGRAM_NAME };

static const char *const channels[] = {"J", "GOAL", "ARM1_JOINT_STATE",
                                       "ABCDEFGHIJKLMNOPQRSTUVWXYZ_abcdefghijklmnopqrstuvwxyz_012345678"};

// --- filter ---

// A word or byte of what the filter sees: UDP's header, then the packet. False when it ends before.
static bool load(const unsigned char *packet, size_t size, const struct sock_filter *at, uint32_t *value)
{
    const size_t width = BPF_SIZE(at->code) == BPF_W ? 4 : 1;
    CHECK(at->k >= UDP_HEADER);
    if (at->k + width > UDP_HEADER + size)
        return false;
    *value = 0;
    for (size_t i = 0; i < width; i++)
        *value = *value << 8 | packet[at->k - UDP_HEADER + i];
    return true;
}

// Runs a filter; false drops the packet.
static bool passes(const struct sock_filter *code, int count, const unsigned char *packet, size_t size)
{
    uint32_t value = 0;
    for (int at = 0; at < count; at++) {
        switch (BPF_CLASS(code[at].code)) {
        case BPF_LD:
            if (!load(packet, size, &code[at], &value))
                return false;
            break;
        case BPF_JMP: at += value == code[at].k ? code[at].jt : code[at].jf; break;
        case BPF_RET: return code[at].k != 0;
        default: CHECK(false);
        }
    }
    CHECK(false); // every path ends in a return
    return false;
}

// --- entry ---

static void check_packet(const char *channel, const unsigned char *packet, size_t size)
{
    const void *payload = channel;
    uint32_t payload_size = 77;
    struct sock_filter code[LW_DATAGRAM_FILTER];
    const size_t head = MAGIC_AND_NUMBER + strlen(channel) + 1;
    const bool found = lw_datagram_parse(packet, size, channel, &payload, &payload_size);
    CHECK(!found || (size >= head && payload == packet + head && payload_size == size - head));
    CHECK(found || (payload == channel && payload_size == 77));
    const int count = lw_datagram_filter(channel, code, LW_DATAGRAM_FILTER);
    CHECK(count > 0 && passes(code, count, packet, size) == found);
    // Every byte of the payload is there to be read.
    uint32_t sum = 0;
    for (uint32_t i = 0; found && i < payload_size; i++)
        sum += ((const unsigned char *)payload)[i];
    CHECK(sum <= payload_size * 255);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct bytes in = {data, size};
    const char *channel = channels[next_byte(&in) % (int)(sizeof channels / sizeof channels[0])];
    unsigned char head[HEAD_MAX] = {'L', 'C', '0', '2'};
    memcpy(head + MAGIC_AND_NUMBER, channel, strlen(channel) + 1);
    const size_t given = (size_t)next_byte(&in) % (MAGIC_AND_NUMBER + strlen(channel) + 2);
    if (given + in.size == 0)
        return 0;
    unsigned char *packet = malloc(given + in.size);
    CHECK(packet != NULL);
    memcpy(packet, head, given);
    if (in.size > 0)
        memcpy(packet + given, in.data, in.size);
    check_packet(channel, packet, given + in.size);
    free(packet);
    return 0;
}
