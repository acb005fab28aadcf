// SPDX-License-Identifier: BSD-3-Clause
// Tests of the wire against hostile packets: times that are none, random bytes. What is refused changes nothing, and
// what is accepted keeps every range that the rest of the code relies on. test_wire_obstacles.c has those of obstacles.
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
        cmocka_unit_test(ticks_that_are_no_time_are_refused),
        cmocka_unit_test(commands_from_before_time_are_refused),
        cmocka_unit_test(random_bytes_are_never_accepted),
        cmocka_unit_test(damaged_messages_are_refused_or_harmless),
    };
    return cmocka_run_group_tests_name("wire_hostile", tests, NULL, NULL);
}
