// SPDX-License-Identifier: BSD-3-Clause
// Tests of the wire against hostile packets: counts and ids that lie, unused bytes, random bytes. What is refused
// changes nothing, and what is accepted keeps every range that the rest of the code relies on.
//
// Units    those of lcmtypes/*.lcm.
// Frames   base frame.
// Arrays   see bus/wire.h.
// Memory   stack.
// Errors   cmocka's.
#include "bus/wire.h"
#include "helpers.h"
#include "wire_messages.h" // make, decode
#include "wire_ranges.h"   // keeps_its_ranges

#include <leeway_obstacles_t.h> // counts and unused entries that lw_wire_encode never writes

// --- obstacles ---

static leeway_obstacles_t valid_obstacles(int n)
{
    leeway_obstacles_t w = {.h = {.session = 5, .seq = 6}, .op = LEEWAY_OBSTACLES_T_UPSERT, .n = n};
    for (int i = 0; i < LEEWAY_OBSTACLES_T_MAX; i++)
        w.o[i] = (leeway_obstacle_t){.id = i + 1, .p = {i, 0, 1}, .radius = 0.5};
    return w;
}

static enum lw_status decode_obstacles(const leeway_obstacles_t *w, union lw_message *out)
{
    unsigned char data[LW_WIRE_MAX];
    const int size = leeway_obstacles_t_encode(data, 0, sizeof data, w);
    assert_true(size > 0);
    return decode(LW_CHANNEL_OBSTACLES, data, (uint32_t)size, out);
}

static void counts_are_checked_before_they_are_used(void **state)
{
    (void)state;
    const int counts[] = {INT32_MIN, -1, 0, 1, LW_CHANGE_MAX, LW_CHANGE_MAX + 1, 1000000, INT32_MAX};
    for (size_t i = 0; i < sizeof counts / sizeof counts[0]; i++) {
        const leeway_obstacles_t w = valid_obstacles(counts[i]);
        union lw_message out;
        const bool valid = counts[i] >= 0 && counts[i] <= LW_CHANGE_MAX;
        assert_int_equal(decode_obstacles(&w, &out), valid ? LW_OK : LW_E_ARGUMENT);
    }
}

// Ids are positive and stand once, wherever in the message; also where only ids are read.
static void ids_are_positive_and_unique(void **state)
{
    (void)state;
    union lw_message out;
    for (int op = 0; op <= LW_CLEAR; op++)
        for (int at = 0; at < LW_CHANGE_MAX; at++) {
            leeway_obstacles_t w = valid_obstacles(LW_CHANGE_MAX);
            w.op = (int8_t)op;
            const int32_t bad[] = {0, -1, INT32_MIN, 1 + (at + 7) % LW_CHANGE_MAX}; // the last one is another's
            for (int i = 0; i < 4; i++) {
                w.o[at].id = bad[i];
                assert_int_equal(decode_obstacles(&w, &out), LW_E_ARGUMENT);
            }
            w.o[at].id = 777;
            assert_int_equal(decode_obstacles(&w, &out), LW_OK);
        }
}

// Entries behind the count are ignored whatever they hold, and REMOVE looks at ids alone.
static void unused_values_are_ignored(void **state)
{
    (void)state;
    union lw_message out;
    leeway_obstacles_t w = valid_obstacles(2);
    for (int i = 2; i < LEEWAY_OBSTACLES_T_MAX; i++)
        w.o[i] = (leeway_obstacle_t){.id = -1, .p = {NO_NUMBER, 1e300, 0}, .radius = -1};
    assert_int_equal(decode_obstacles(&w, &out), LW_OK);
    assert_int_equal(out.obstacles.count, 2);
    w.o[1].radius = NO_NUMBER;
    w.o[0].p[2] = 1e300;
    assert_int_not_equal(decode_obstacles(&w, &out), LW_OK);
    w.op = LEEWAY_OBSTACLES_T_REMOVE;
    assert_int_equal(decode_obstacles(&w, &out), LW_OK);
    assert_near(out.obstacles.obstacle[0].p[2], 0, 0);
    assert_near(out.obstacles.obstacle[1].radius, 0, 0);
}

// --- joint state ---

// tick * period_ns is a time: what would not fit into 64 bits, or runs backwards from 0, is refused before anyone
// multiplies.
static void ticks_that_are_no_time_are_refused(void **state)
{
    (void)state;
    struct random random = {91};
    const struct {
        int64_t tick, period_ns;
        enum lw_status status;
    } cases[] = {{0, 2000000, LW_OK},
                 {-1, 2000000, LW_E_ARGUMENT},
                 {INT64_MIN, 1, LW_E_ARGUMENT},
                 {INT64_MAX, 1, LW_OK},
                 {INT64_MAX, 2, LW_E_ARGUMENT},
                 {INT64_MAX / 2000000, 2000000, LW_OK},
                 {INT64_MAX / 2000000 + 1, 2000000, LW_E_ARGUMENT},
                 {2, INT64_MAX, LW_E_ARGUMENT}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        unsigned char data[LW_WIRE_MAX];
        union lw_message m = make(&random, LW_CHANNEL_JOINT_STATE), out;
        m.joint_state.tick = cases[i].tick;
        m.joint_state.period_ns = cases[i].period_ns;
        const uint32_t size = lw_wire_encode(LW_CHANNEL_JOINT_STATE, &m, data);
        assert_int_equal(decode(LW_CHANNEL_JOINT_STATE, data, size, &out), cases[i].status);
    }
}

// A command from before the first state is no answer to any, and its age would overflow.
static void commands_from_before_time_are_refused(void **state)
{
    (void)state;
    struct random random = {92};
    static const int64_t bad[] = {-1, INT64_MIN};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        unsigned char data[LW_WIRE_MAX];
        union lw_message m = make(&random, LW_CHANNEL_JOINT_COMMAND), out;
        m.joint_command.state_tick = bad[i];
        const uint32_t size = lw_wire_encode(LW_CHANNEL_JOINT_COMMAND, &m, data);
        assert_int_equal(decode(LW_CHANNEL_JOINT_COMMAND, data, size, &out), LW_E_ARGUMENT);
    }
}

// --- random bytes ---

static void fill_random(struct random *random, unsigned char *data, uint32_t size)
{
    for (uint32_t done = 0; done < size; done += 8) {
        const uint64_t bits = random_bits(random);
        memcpy(data + done, &bits, size - done < 8 ? size - done : 8);
    }
}

// Random bytes of the right size never pass for a message.
static void random_bytes_are_never_accepted(void **state)
{
    (void)state;
    struct random random = {92};
    for (int n = 0; n < 100000; n++) {
        const enum lw_channel channel = (enum lw_channel)(n % LW_CHANNEL_COUNT);
        unsigned char data[LW_WIRE_MAX];
        union lw_message out;
        const uint32_t size = lw_wire_size(channel);
        fill_random(&random, data, size);
        assert_int_equal(decode(channel, data, size, &out), LW_E_DECODE);
    }
}

// Random bytes behind the right fingerprint, and valid messages with a few bytes changed: refused without a trace, or
// taken with every range kept.
static void damaged_messages_are_refused_or_harmless(void **state)
{
    (void)state;
    struct random random = {93};
    int taken = 0, refused = 0;
    for (int n = 0; n < 100000; n++) {
        const enum lw_channel channel = (enum lw_channel)(n % LW_CHANNEL_COUNT);
        const union lw_message m = make(&random, channel);
        unsigned char data[LW_WIRE_MAX];
        union lw_message out;
        const uint32_t size = lw_wire_encode(channel, &m, data);
        if (random_below(&random, 2))
            fill_random(&random, data + 8, size - 8);
        else
            for (int damage = random_below(&random, 4); damage >= 0; damage--)
                data[8 + random_below(&random, (int)size - 8)] = (unsigned char)(random_bits(&random) >> 56);
        const bool ok = decode(channel, data, size, &out) == LW_OK;
        assert_true(!ok || keeps_its_ranges(channel, &out));
        *(ok ? &taken : &refused) += 1;
    }
    assert_true(taken > 10000 && refused > 10000); // both branches were seen
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(counts_are_checked_before_they_are_used),
        cmocka_unit_test(ids_are_positive_and_unique),
        cmocka_unit_test(unused_values_are_ignored),
        cmocka_unit_test(ticks_that_are_no_time_are_refused),
        cmocka_unit_test(commands_from_before_time_are_refused),
        cmocka_unit_test(random_bytes_are_never_accepted),
        cmocka_unit_test(damaged_messages_are_refused_or_harmless),
    };
    return cmocka_run_group_tests_name("wire_hostile", tests, NULL, NULL);
}
