// SPDX-License-Identifier: BSD-3-Clause
// Tests of the datagram beside LCM, in a network of their own: what LCM publishes arrives, floods do not matter, the
// port is shared.
//
// Units    ms of timeouts, bytes.
// Frames   none.
// Arrays   none.
// Memory   static.
// Errors   cmocka's; where the system allows no network of one's own, 77: skipped.
#define _GNU_SOURCE // unshare
#include "bus/bus.h"
#include "datagram_network.h"
#include "wire_messages.h" // make

#include <pthread.h>   // pthread_create
#include <stdatomic.h> // atomic_bool

enum { FLOOD = 50000, PLENTY = 1 << 20 };

static void flood(lcm_t *lcm, int count)
{
    static const char *const channels[] = {"OBSTACLES", "JOINT_STATE_", "JOINT_STAT", "joint_state"};
    for (int i = 0; i < count; i++)
        say(lcm, channels[i % 4], -7);
}

// What the bus publishes arrives byte for byte, in order, none lost, amid other channels and fragments of its own name.
static void what_the_bus_publishes_arrives(void **state)
{
    (void)state;
    static struct lw_datagram d;
    static unsigned char large[100000];
    struct random random = {1};
    struct lw_bus *bus = NULL;
    struct lw_error error = {""};
    const struct lw_bus_config config = {.url = URL, .session = 5};
    assert_int_equal(lw_bus_open(&config, &bus, &error), LW_OK);
    lcm_t *other = open_lcm();
    open_datagram(&d, "JOINT_STATE", PLENTY);
    for (int round = 0; round < 100; round++) {
        union lw_message sent[20];
        for (int i = 0; i < 20; i++) {
            flood(other, 8);
            sent[i] = make(&random, LW_CHANNEL_JOINT_STATE);
            assert_int_equal(lw_bus_publish(bus, LW_CHANNEL_JOINT_STATE, &sent[i]), LW_OK);
        }
        assert_int_equal(publish(other, "JOINT_STATE", large, sizeof large), 0);
        for (int i = 0; i < 20; i++) {
            const void *payload = NULL;
            uint32_t size = 0;
            unsigned char expected[LW_WIRE_MAX];
            assert_int_equal(sent[i].stamp.seq, 20 * round + i + 1);
            assert_int_equal(lw_datagram_receive(&d, SOON, &payload, &size), 1);
            assert_int_equal(size, lw_wire_encode(LW_CHANNEL_JOINT_STATE, &sent[i], expected));
            assert_memory_equal(payload, expected, size);
            union lw_message heard;
            assert_int_equal(decode(LW_CHANNEL_JOINT_STATE, payload, size, &heard), LW_OK);
        }
    }
    assert_int_equal(hear(&d, 0), -1);
    assert_int_equal(d.refused + d.errors, 0);
    lw_datagram_close(&d);
    lcm_destroy(other);
    lw_bus_close(bus);
}

static void count_state(void *user, enum lw_channel channel, const union lw_message *message)
{
    *(int *)user += channel == LW_CHANNEL_JOINT_STATE && message->stamp.seq == 3;
}

// A bus that listens by its own socket hands on what decodes and counts the rest: too short, too long for the buffer.
static void a_bus_counts_what_it_refuses(void **state)
{
    (void)state;
    static const unsigned char junk[LW_WIRE_MAX + 1000] = {0};
    struct random random = {2};
    struct lw_refusals refusals = {0};
    struct lw_error error = {""};
    struct lw_bus *bus = NULL;
    int heard = 0;
    const struct lw_bus_config config = {.url = URL, .session = 5, .refusals = &refusals, .own_socket = true};
    assert_int_equal(lw_bus_open(&config, &bus, &error), LW_OK);
    assert_int_equal(lw_bus_subscribe(bus, LW_CHANNEL_JOINT_STATE, count_state, &heard, &error), LW_OK);
    lcm_t *lcm = open_lcm();
    unsigned char data[LW_WIRE_MAX];
    union lw_message sent = make(&random, LW_CHANNEL_JOINT_STATE);
    sent.stamp.seq = 3;
    const uint32_t size = lw_wire_encode(LW_CHANNEL_JOINT_STATE, &sent, data);
    assert_int_equal(publish(lcm, "JOINT_STATE", data, size - 1), 0);
    assert_int_equal(publish(lcm, "JOINT_STATE", junk, sizeof junk), 0);
    assert_int_equal(publish(lcm, "JOINT_STATE", data, size), 0);
    for (int i = 0; i < 3; i++)
        assert_true(lw_bus_handle(bus, SOON));
    assert_int_equal(heard, 1);
    assert_int_equal(lw_refusals_of(&refusals, LW_REFUSED_SIZE), 2);
    assert_int_equal(lw_refusals_total(&refusals), 2);
    lcm_destroy(lcm);
    lw_bus_close(bus);
}

static void count_by_channel(void *user, enum lw_channel channel, const union lw_message *message)
{
    ((int *)user)[channel] += message->stamp.seq == 3;
}

// One bus, several channels: a flood on one, fragments and all, does not keep a message of another waiting.
static void a_bus_hears_several_channels(void **state)
{
    (void)state;
    static const unsigned char large[100000] = {0};
    const enum lw_channel channels[] = {LW_CHANNEL_OBSTACLES, LW_CHANNEL_GOAL, LW_CHANNEL_STOP};
    struct random random = {4};
    struct lw_refusals refusals = {0};
    struct lw_error error = {""};
    struct lw_bus *bus = NULL;
    int heard[LW_CHANNEL_COUNT] = {0};
    const struct lw_bus_config config = {.url = URL, .session = 5, .refusals = &refusals, .own_socket = true};
    assert_int_equal(lw_bus_open(&config, &bus, &error), LW_OK);
    for (int i = 0; i < 3; i++)
        assert_int_equal(lw_bus_subscribe(bus, channels[i], count_by_channel, heard, &error), LW_OK);
    lcm_t *lcm = open_lcm();
    assert_true(lw_bus_handle(bus, 0)); // nothing came
    flood(lcm, 200);
    assert_int_equal(publish(lcm, "GOAL", large, sizeof large), 0);
    for (int i = 0; i < 3; i++) {
        unsigned char data[LW_WIRE_MAX];
        union lw_message sent = make(&random, channels[i]);
        sent.stamp.seq = 3;
        const uint32_t size = lw_wire_encode(channels[i], &sent, data);
        assert_int_equal(publish(lcm, lw_wire_channel_name(channels[i]), data, size), 0);
    }
    // One message of the flood on OBSTACLES, and at once the only ones of the others.
    assert_true(lw_bus_handle(bus, SOON));
    assert_int_equal(lw_refusals_total(&refusals), 1);
    assert_true(heard[LW_CHANNEL_OBSTACLES] == 0 && heard[LW_CHANNEL_GOAL] == 1 && heard[LW_CHANNEL_STOP] == 1);
    for (int i = 0; i < 50; i++)
        assert_true(lw_bus_handle(bus, SOON));
    assert_int_equal(heard[LW_CHANNEL_OBSTACLES], 1);
    assert_int_equal(lw_refusals_total(&refusals), 50);
    lcm_destroy(lcm);
    lw_bus_close(bus);
}

// What is handed on, by channel and number.
struct heard {
    int count;
    struct {
        enum lw_channel channel;
        int64_t seq;
    } message[300];
};

static void note_order(void *user, enum lw_channel channel, const union lw_message *message)
{
    struct heard *heard = user;
    heard->message[heard->count].channel = channel;
    heard->message[heard->count++].seq = message->stamp.seq;
}

// A sender's hulls and obstacles are handed on in the order in which it sent them, however many wait.
static void hulls_and_obstacles_keep_their_order(void **state)
{
    (void)state;
    struct random random = {6};
    struct lw_error error = {""};
    struct lw_refusals refusals = {0};
    struct lw_bus *bus = NULL, *sender = NULL;
    struct heard sent = {0}, heard = {0};
    const struct lw_bus_config listens = {.url = URL, .session = 5, .refusals = &refusals, .own_socket = true};
    const struct lw_bus_config sends = {.url = URL, .session = 6};
    assert_int_equal(lw_bus_open(&listens, &bus, &error), LW_OK);
    assert_int_equal(lw_bus_open(&sends, &sender, &error), LW_OK);
    assert_int_equal(lw_bus_subscribe(bus, LW_CHANNEL_OBSTACLES, note_order, &heard, &error), LW_OK);
    assert_int_equal(lw_bus_subscribe(bus, LW_CHANNEL_HULL, note_order, &heard, &error), LW_OK);
    while (sent.count < 300) {
        const enum lw_channel channel = random_below(&random, 2) ? LW_CHANNEL_HULL : LW_CHANNEL_OBSTACLES;
        for (int run = 1 + random_below(&random, 9); run > 0 && sent.count < 300; run--) {
            union lw_message m = make(&random, channel);
            assert_int_equal(lw_bus_publish(sender, channel, &m), LW_OK);
            note_order(&sent, channel, &m);
        }
    }
    for (int i = 0; i < 300 && heard.count < 300; i++)
        assert_true(lw_bus_handle(bus, SOON));
    assert_int_equal(heard.count, 300);
    for (int i = 0; i < 300; i++)
        assert_true(heard.message[i].channel == sent.message[i].channel && heard.message[i].seq == sent.message[i].seq);
    lw_bus_close(sender);
    lw_bus_close(bus);
}

// A flood of other channels leaves no trace in a receive buffer of a few messages. Without the filter it fills it: the
// message behind the flood is lost, which shows that the filter is what keeps it.
static void a_flood_does_not_reach_a_small_buffer(void **state)
{
    (void)state;
    static struct lw_datagram d;
    const int nothing = 0;
    lcm_t *lcm = open_lcm();
    open_datagram(&d, "JOINT_STATE", 4096);
    say(lcm, "JOINT_STATE", 1);
    flood(lcm, FLOOD);
    say(lcm, "JOINT_STATE", 2);
    assert_int_equal(hear(&d, SOON), 1);
    assert_int_equal(hear(&d, SOON), 2);
    assert_int_equal(d.refused, 0);
    // The same with the kernel's help taken away.
    assert_int_equal(setsockopt(d.fd, SOL_SOCKET, SO_DETACH_FILTER, &nothing, sizeof nothing), 0);
    say(lcm, "JOINT_STATE", 3);
    flood(lcm, FLOOD);
    say(lcm, "JOINT_STATE", 4);
    assert_int_equal(hear(&d, SOON), 3);
    assert_int_equal(hear(&d, SILENCE), -1);
    assert_true(d.refused > 0 && d.refused < FLOOD / 100);
    // Overflow is no state that stays.
    say(lcm, "JOINT_STATE", 5);
    assert_int_equal(hear(&d, SOON), 5);
    lw_datagram_close(&d);
    lcm_destroy(lcm);
}

static atomic_bool flood_ends;

static void *flood_until_told(void *user)
{
    while (!atomic_load(&flood_ends))
        flood(user, 8);
    return NULL;
}

// Opened in the middle of a flood, a socket has nothing foreign in its queue from the time before its filter.
static void a_flood_does_not_slip_in_while_opening(void **state)
{
    (void)state;
    static struct lw_datagram d;
    pthread_t thread;
    lcm_t *lcm = open_lcm(), *other = open_lcm();
    open_datagram(&d, "GOAL", 0); // the group is joined on lo: another socket hears it from its bind on
    assert_int_equal(pthread_create(&thread, NULL, flood_until_told, other), 0);
    int64_t refused = 0;
    int lost = 0;
    for (int i = 0; i < 1000; i++) {
        static struct lw_datagram opened;
        open_datagram(&opened, "JOINT_STATE", 0);
        say(lcm, "JOINT_STATE", i);
        lost += hear(&opened, SOON) != i;
        refused += opened.refused;
        lw_datagram_close(&opened);
    }
    atomic_store(&flood_ends, true);
    assert_int_equal(pthread_join(thread, NULL), 0);
    assert_int_equal(lost, 0);
    assert_int_equal(refused, 0);
    lw_datagram_close(&d);
    lcm_destroy(other);
    lcm_destroy(lcm);
}

static void count_message(const lcm_recv_buf_t *buf, const char *channel, void *user)
{
    (void)buf;
    (void)channel;
    ++*(int *)user;
}

// LCM's sockets that were there before and that come after, and two of ours: all hear the same message.
static void the_port_is_shared(void **state)
{
    (void)state;
    static struct lw_datagram one, two, goal;
    int heard[2] = {0};
    lcm_t *lcm[2] = {open_lcm(), open_lcm()};
    assert_non_null(lcm_subscribe(lcm[0], "JOINT_STATE", count_message, &heard[0]));
    open_datagram(&one, "JOINT_STATE", 0);
    open_datagram(&goal, "GOAL", 0);
    assert_non_null(lcm_subscribe(lcm[1], "JOINT_STATE", count_message, &heard[1]));
    open_datagram(&two, "JOINT_STATE", 0);
    for (int i = 1; i <= 100; i++) {
        say(lcm[0], "JOINT_STATE", i);
        say(lcm[1], "GOAL", 1000 + i);
        for (int k = 0; k < 2; k++) {
            assert_int_equal(lcm_handle_timeout(lcm[k], SOON), 1);
            assert_int_equal(heard[k], i);
        }
        assert_int_equal(hear(&one, SOON), i);
        assert_int_equal(hear(&two, SOON), i);
        assert_int_equal(hear(&goal, SOON), 1000 + i);
    }
    lw_datagram_close(&one);
    lw_datagram_close(&two);
    lw_datagram_close(&goal);
    lcm_destroy(lcm[0]);
    lcm_destroy(lcm[1]);
}

int main(void)
{
    if (!enter_network("datagram_bus"))
        return 77;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_the_bus_publishes_arrives),
        cmocka_unit_test(a_bus_counts_what_it_refuses),
        cmocka_unit_test(a_bus_hears_several_channels),
        cmocka_unit_test(hulls_and_obstacles_keep_their_order),
        cmocka_unit_test(a_flood_does_not_reach_a_small_buffer),
        cmocka_unit_test(a_flood_does_not_slip_in_while_opening),
        cmocka_unit_test(the_port_is_shared),
    };
    return cmocka_run_group_tests_name("datagram_bus", tests, NULL, NULL);
}
