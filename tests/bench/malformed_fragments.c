// SPDX-License-Identifier: BSD-3-Clause
// Malformed fragments of long messages, which LCM puts together in every program on the bus.
//
// Units    bytes.
// Frames   none.
// Arrays   none.
// Memory   the caller's.
// Errors   none.
#include "bus/wire.h" // lw_wire_encode
#include "malformed.h"

#include <stdbool.h> // bool
#include <string.h>  // memcpy

enum { HEAD = 20, BODY_MAX = 1400 };

// Header of a fragment.
struct fragment {
    uint32_t number, total, offset; // of the message, its bytes, this fragment's first byte
    int index, count;
};

static void start(const struct fragment *f, struct packet *out)
{
    memcpy(out->bytes, "LC03", 4);
    put(out->bytes + 4, f->number, 4);
    put(out->bytes + 8, f->total, 4);
    put(out->bytes + 12, f->offset, 4);
    put(out->bytes + 16, (uint64_t)f->index, 2);
    put(out->bytes + 18, (uint64_t)f->count, 2);
    out->size = HEAD;
}

// Body of `size` bytes; of a first fragment it starts with the channel.
static void add_body(struct malformer *m, const char *channel, size_t size, struct packet *out)
{
    unsigned char *body = out->bytes + out->size;
    for (size_t i = 0; i < size; i++)
        body[i] = (unsigned char)(random_bits(&m->random) >> 40);
    if (channel != NULL && strlen(channel) < size)
        memcpy(body, channel, strlen(channel) + 1);
    out->size += size;
}

static size_t some(struct malformer *m)
{
    return 64 + (size_t)random_below(&m->random, BODY_MAX - 64);
}

static uint32_t number(struct malformer *m)
{
    return (uint32_t)random_bits(&m->random);
}

// --- kinds ---

void make_short_fragment(struct malformer *m, struct packet *out)
{
    start(&(struct fragment){.number = number(m), .total = 100, .count = 2}, out);
    out->size = 4 + (size_t)random_below(&m->random, HEAD - 4);
}

// Offset and size together are beyond 2^32.
void make_wrapping_fragment(struct malformer *m, struct packet *out)
{
    const uint32_t back = (uint32_t)random_below(&m->random, 2000);
    start(&(struct fragment){.number = number(m), .total = 5000, .offset = UINT32_MAX - back, .index = 1, .count = 4},
          out);
    add_body(m, NULL, some(m), out);
}

void make_zero_fragment(struct malformer *m, struct packet *out)
{
    const bool no_bytes = random_below(&m->random, 2) != 0;
    const int count = no_bytes ? random_below(&m->random, 3) : 0;
    start(&(struct fragment){.number = number(m), .total = no_bytes ? 0 : 5000, .count = count}, out);
    add_body(m, "GOAL", some(m), out);
}

// Never the first fragment, so that the message never gets a channel.
void make_headless_fragment(struct malformer *m, struct packet *out)
{
    const int index = 1 + random_below(&m->random, 3);
    start(
        &(struct fragment){
            .number = number(m), .total = 5000, .offset = 1000 * (uint32_t)index, .index = index, .count = 5},
        out);
    add_body(m, NULL, some(m), out);
}

// The first fragment of a message that would fill the memory.
void make_huge_fragment(struct malformer *m, struct packet *out)
{
    static const uint32_t totals[] = {1u << 20, 1u << 24, 1u << 28, 1u << 31, UINT32_MAX};
    start(&(struct fragment){.number = number(m), .total = totals[random_below(&m->random, 5)], .count = 40000}, out);
    add_body(m, "OBSTACLES", some(m), out);
}

// A later fragment whose place is outside its message.
void make_misplaced_fragment(struct malformer *m, struct packet *out)
{
    const uint32_t n = (uint32_t)(m->made / 2);
    const bool first = m->made % 2 == 0;
    const uint32_t offsets[] = {4999, 5000, 5001, 1u << 20, 1u << 31};
    start(&(struct fragment){.number = n,
                             .total = 5000,
                             .offset = first ? 0 : offsets[random_below(&m->random, 5)],
                             .index = !first,
                             .count = 2},
          out);
    add_body(m, first ? "JOINT_COMMAND" : NULL, some(m), out);
}

// A first fragment that ends before its channel does.
void make_bodiless_fragment(struct malformer *m, struct packet *out)
{
    start(&(struct fragment){.number = number(m), .total = 5000, .count = 1 + random_below(&m->random, 3)}, out);
    memcpy(out->bytes + HEAD, "JOINT_COMMAND", 13);
    out->size += (size_t)random_below(&m->random, 14);
}

// The first half of a foreign command twice, then the second: LCM counts fragments, and delivers the first two as a
// whole message.
void make_duplicated_fragment(struct malformer *m, struct packet *out)
{
    static const char channel[] = "JOINT_COMMAND";
    unsigned char payload[LW_WIRE_MAX];
    union lw_message message;
    memset(&message, 0, sizeof message);
    message.stamp = (struct lw_stamp){.session = 1 + m->made / 3, .seq = INT64_MAX};
    message.joint_command.mode = LW_COMMAND_VELOCITY;
    const uint32_t size = lw_wire_encode(LW_CHANNEL_JOINT_COMMAND, &message, payload), half = size / 2;
    const bool last = m->made % 3 == 2;
    start(
        &(struct fragment){
            .number = (uint32_t)(m->made / 3), .total = size, .offset = last ? half : 0, .index = last, .count = 2},
        out);
    if (!last) {
        memcpy(out->bytes + out->size, channel, sizeof channel);
        out->size += sizeof channel;
    }
    memcpy(out->bytes + out->size, payload + (last ? half : 0), last ? size - half : half);
    out->size += last ? size - half : half;
}
