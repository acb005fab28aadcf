// SPDX-License-Identifier: BSD-3-Clause
// Tests of what a packet is: the parser, and the filter, which the kernel runs on a pair of Unix sockets.
//
// Units    bytes.
// Frames   none.
// Arrays   the parser sees packets in blocks of exactly their size, so that a sanitizer finds a read beyond the end.
// Memory   heap for those blocks.
// Errors   cmocka's.
#define _GNU_SOURCE // SO_ATTACH_FILTER
#include "bus/datagram.h"
#include "datagram_packets.h"

#include <sys/socket.h> // socketpair
#include <unistd.h>     // close

enum { UDP_HEAD = 8 };

// --- the parser ---

// Whether the parser takes a packet; then the payload has to be all that follows the name, else outputs are unchanged.
static bool parses(const struct packet *p, const char *channel)
{
    unsigned char *copy = malloc(p->size);
    assert_true(copy != NULL || p->size == 0);
    if (p->size > 0)
        memcpy(copy, p->bytes, p->size);
    const void *payload = p;
    uint32_t size = 12345;
    const bool taken = lw_datagram_parse(copy, p->size, channel, &payload, &size);
    const size_t head = HEAD + strlen(channel) + 1;
    const bool right = taken ? payload == copy + head && size == p->size - head : payload == p && size == 12345;
    free(copy);
    assert_true(right);
    return taken;
}

static void a_message_of_the_channel_is_taken(void **state)
{
    (void)state;
    struct random random = {1};
    const char *const names[] = {"A", "AB", "ABC", "GOAL", "JOINT_STATE", "UR5A_JOINT_STATE", NAME_63};
    static const size_t payloads[] = {0, 1, 7, 8, 217, 2048};
    for (size_t n = 0; n < sizeof names / sizeof names[0]; n++)
        for (size_t k = 0; k < sizeof payloads / sizeof payloads[0]; k++) {
            const struct packet p = make_packet(&random, names[n], payloads[k]);
            assert_true(parses(&p, names[n]));
        }
}

// No packet that ends inside the header or the name is taken, whatever stands in memory behind it.
static void a_truncated_packet_is_refused(void **state)
{
    (void)state;
    struct random random = {2};
    for (size_t length = 1; length < LW_DATAGRAM_NAME; length++) {
        char name[LW_DATAGRAM_NAME] = "";
        memcpy(name, NAME_63, length);
        struct packet p = make_packet(&random, name, 9);
        const size_t head = HEAD + length + 1;
        for (p.size = 0; p.size < head + 9; p.size++)
            assert_int_equal(parses(&p, name), p.size >= head);
    }
}

static void another_name_is_refused(void **state)
{
    (void)state;
    struct random random = {3};
    static const char *const others[] = {"JOINT_STAT",
                                         "JOINT_STATE_",
                                         "JOINT_STATES",
                                         "XJOINT_STATE",
                                         "joint_state",
                                         "JOINT_STATF",
                                         "KOINT_STATE",
                                         "J",
                                         ""};
    for (size_t i = 0; i < sizeof others / sizeof others[0]; i++) {
        const struct packet p = make_packet(&random, others[i], 40);
        assert_false(parses(&p, "JOINT_STATE"));
    }
    // A channel's name of no or of 64 bytes is none.
    char name_64[LW_DATAGRAM_NAME + 1] = "";
    memset(name_64, 'N', LW_DATAGRAM_NAME);
    const struct packet longest = make_packet(&random, name_64, 40), empty = make_packet(&random, "", 40);
    assert_false(parses(&longest, name_64));
    assert_false(parses(&longest, name_64 + 1));
    assert_false(parses(&empty, ""));
}

static void fragments_and_other_magics_are_refused(void **state)
{
    (void)state;
    struct random random = {4};
    static const char *const magics[] = {"LC03", "LC01", "lc02", "20CL", "\0\0\0\0"};
    for (size_t i = 0; i < sizeof magics / sizeof magics[0]; i++) {
        struct packet p = make_packet(&random, "GOAL", 40);
        memcpy(p.bytes, magics[i], 4);
        assert_false(parses(&p, "GOAL"));
    }
}

// No datagram is longer than 65535 bytes.
static void a_size_that_cannot_be_is_refused(void **state)
{
    (void)state;
    static unsigned char block[UINT16_MAX + 1] = "LC02....GOAL";
    const void *payload = NULL;
    uint32_t size = 0;
    assert_true(lw_datagram_parse(block, UINT16_MAX, "GOAL", &payload, &size));
    assert_false(lw_datagram_parse(block, UINT16_MAX + 1, "GOAL", &payload, &size));
}

// --- the filter, run by the kernel ---

struct filtered {
    int in, out;
};

static struct filtered start_filter(const char *channel)
{
    int pair[2];
    struct sock_filter code[LW_DATAGRAM_FILTER];
    const int count = lw_datagram_filter(channel, code, LW_DATAGRAM_FILTER);
    const struct sock_fprog program = {.len = (unsigned short)count, .filter = code};
    assert_int_equal(socketpair(AF_UNIX, SOCK_DGRAM, 0, pair), 0);
    // The kernel refuses a program that is empty or jumps out of bounds.
    assert_int_equal(setsockopt(pair[1], SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof program), 0);
    return (struct filtered){.in = pair[0], .out = pair[1]};
}

static void stop_filter(const struct filtered *f)
{
    close(f->in);
    close(f->out);
}

// Whether a packet behind any eight bytes, where a UDP socket has its header, comes through whole.
static bool passes(const struct filtered *f, struct random *random, const struct packet *p)
{
    unsigned char bytes[UDP_HEAD + PACKET_MAX], back[UDP_HEAD + PACKET_MAX];
    const uint64_t header = random_bits(random);
    memcpy(bytes, &header, UDP_HEAD);
    memcpy(bytes + UDP_HEAD, p->bytes, p->size);
    assert_int_equal(send(f->in, bytes, UDP_HEAD + p->size, 0), UDP_HEAD + p->size);
    const ssize_t n = recv(f->out, back, sizeof back, MSG_DONTWAIT);
    if (n < 0)
        return false;
    assert_int_equal(n, UDP_HEAD + p->size);
    assert_memory_equal(back, bytes, (size_t)n);
    return true;
}

// For names of every length: each byte of magic, name and NUL counts, none of the sequence number and the payload does,
// and no shorter packet comes through. The parser agrees on each.
static void the_filter_compares_every_byte(void **state)
{
    (void)state;
    struct random random = {5};
    for (size_t length = 1; length < LW_DATAGRAM_NAME; length++) {
        char name[LW_DATAGRAM_NAME] = "";
        memcpy(name, NAME_63, length);
        const struct filtered f = start_filter(name);
        struct packet p = make_packet(&random, name, 3);
        const size_t head = HEAD + length + 1, whole = p.size;
        for (size_t at = 0; at < whole; at++) {
            const bool free_byte = (at >= 4 && at < HEAD) || at >= head;
            for (unsigned bit = 1; bit < 256; bit <<= 1) {
                p.bytes[at] ^= (unsigned char)bit;
                assert_int_equal(passes(&f, &random, &p), free_byte);
                assert_int_equal(parses(&p, name), free_byte);
                p.bytes[at] ^= (unsigned char)bit;
            }
        }
        for (p.size = 0; p.size <= whole; p.size++)
            assert_int_equal(passes(&f, &random, &p), p.size >= head);
        stop_filter(&f);
    }
}

// One change in a thousand ways: cut, other magic, other name, noise in the head, all noise.
static struct packet damage(struct random *random, const char *channel)
{
    struct packet p = make_packet(random, channel, (size_t)random_below(random, 300));
    switch (random_below(random, 6)) {
    case 0: p.size = (size_t)random_below(random, (int)p.size + 1); break;
    case 1: memcpy(p.bytes, "LC03", 4); break;
    case 2: p.bytes[HEAD + strlen(channel)] = 'X'; break;
    case 3: p.bytes[random_below(random, (int)p.size)] ^= (unsigned char)(1 + random_below(random, 255)); break;
    case 4:
        for (size_t i = 0; i < p.size; i++)
            p.bytes[i] = (unsigned char)random_bits(random);
        break;
    default: break;
    }
    return p;
}

static void filter_and_parser_agree_on_anything(void **state)
{
    (void)state;
    struct random random = {6};
    const char *const names[] = {"A", "WORLD", "JOINT_STATE", "UR5A_JOINT_COMMAND", NAME_63};
    int taken = 0, refused = 0;
    for (size_t n = 0; n < sizeof names / sizeof names[0]; n++) {
        const struct filtered f = start_filter(names[n]);
        for (int i = 0; i < 20000; i++) {
            const struct packet p = damage(&random, names[n]);
            const bool parsed = parses(&p, names[n]);
            assert_int_equal(passes(&f, &random, &p), parsed);
            *(parsed ? &taken : &refused) += 1;
        }
        stop_filter(&f);
    }
    assert_true(taken > 20000 && refused > 20000);
}

// A filter is made for names of 1 to 63 bytes and never exceeds the room it is given.
static void a_filter_fits_or_is_not_made(void **state)
{
    (void)state;
    int longest = 0;
    for (size_t length = 0; length <= LW_DATAGRAM_NAME; length++) {
        char name[LW_DATAGRAM_NAME + 1] = "";
        memset(name, 'N', length);
        struct sock_filter code[LW_DATAGRAM_FILTER];
        const int count = lw_datagram_filter(name, code, LW_DATAGRAM_FILTER);
        assert_int_equal(count > 0, length >= 1 && length < LW_DATAGRAM_NAME);
        for (int max = -1; max < count; max++)
            assert_int_equal(lw_datagram_filter(name, NULL, max), 0);
        longest = count > longest ? count : longest;
    }
    assert_int_equal(longest, LW_DATAGRAM_FILTER);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_message_of_the_channel_is_taken),
        cmocka_unit_test(a_truncated_packet_is_refused),
        cmocka_unit_test(another_name_is_refused),
        cmocka_unit_test(fragments_and_other_magics_are_refused),
        cmocka_unit_test(a_size_that_cannot_be_is_refused),
        cmocka_unit_test(the_filter_compares_every_byte),
        cmocka_unit_test(filter_and_parser_agree_on_anything),
        cmocka_unit_test(a_filter_fits_or_is_not_made),
    };
    return cmocka_run_group_tests_name("datagram", tests, NULL, NULL);
}
