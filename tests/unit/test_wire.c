// SPDX-License-Identifier: BSD-3-Clause
// Tests of the wire: types are pinned, values survive to the last bit, and what a hostile sender can do is refused.
//
// Units    those of lcmtypes/*.lcm.
// Frames   base frame.
// Arrays   see bus/wire.h.
// Memory   stack.
// Errors   cmocka's.
#include "bus/wire.h"
#include "helpers.h"
#include "wire_messages.h" // make, decode

#include <leeway_hull_t.h>          // constants
#include <leeway_joint_command_t.h> // the explanation, which lw_wire_decode leaves to logs
#include <leeway_obstacles_t.h>     // constants
#include <leeway_joint_state_t.h>   // constants
#include <leeway_scene_t.h>         // fingerprint

// Behind fingerprint and header.
enum { PLACE_OF_MODE = 8 + 4 * 8, PLACE_OF_OP = PLACE_OF_MODE + 2 * 8 + 4, PLACE_OF_SHAPE = PLACE_OF_OP + 1 + 4 + 4 };

// --- pins ---

// Any change of a type changes these numbers: then old logs and old programs no longer fit. Change them on purpose
// only.
static void sizes_and_fingerprints_are_pinned(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        uint32_t size;
        uint64_t fingerprint;
    } pins[LW_CHANNEL_COUNT] = {
        {"JOINT_STATE", 169, UINT64_C(0x81b22a7757065507)}, {"JOINT_COMMAND", 427, UINT64_C(0xbd32b14dc2d7235f)},
        {"OBSTACLES", 4577, UINT64_C(0xe6cf099fa8629ab6)},  {"HULL", 1741, UINT64_C(0xaa6598ee8beab4fd)},
        {"GOAL", 64, UINT64_C(0xe5b8f4c1200087cc)},         {"STOP", 40, UINT64_C(0xf578849c63c10feb)},
        {"WORLD", 4577, UINT64_C(0xe6cf099fa8629ab6)},      {"WORLD_HULL", 1741, UINT64_C(0xaa6598ee8beab4fd)},
        {"STATUS", 409, UINT64_C(0xef85fd1dcf2fe851)},      {"PLANT_STATUS", 409, UINT64_C(0xef85fd1dcf2fe851)}};
    for (int c = 0; c < LW_CHANNEL_COUNT; c++) {
        const enum lw_channel channel = (enum lw_channel)c;
        assert_string_equal(lw_wire_channel_name(channel), pins[c].name);
        assert_int_equal(lw_wire_size(channel), pins[c].size);
        assert_int_equal((uint64_t)lw_wire_fingerprint(channel), pins[c].fingerprint);
        assert_true(lw_wire_size(channel) <= LW_WIRE_MAX);
    }
    assert_int_equal((uint64_t)__leeway_scene_t_get_hash(), UINT64_C(0xe329f6c00fef69f7));
}

// Flags, modes and operations are the same numbers in the structs and on the wire.
static void constants_are_those_of_the_wire(void **state)
{
    (void)state;
    assert_int_equal(LW_NJ, LEEWAY_JOINT_COMMAND_T_NJ);
    assert_int_equal(LW_LIMIT_POSITION, LEEWAY_JOINT_COMMAND_T_LIMIT_POSITION);
    assert_int_equal(LW_LIMIT_VELOCITY, LEEWAY_JOINT_COMMAND_T_LIMIT_VELOCITY);
    assert_int_equal(LW_LIMIT_ACCELERATION, LEEWAY_JOINT_COMMAND_T_LIMIT_ACCELERATION);
    assert_int_equal(LW_STOPPED, LEEWAY_JOINT_COMMAND_T_STOPPED);
    assert_int_equal(LW_STALE, LEEWAY_JOINT_COMMAND_T_STALE);
    assert_int_equal(LW_NOT_FINITE, LEEWAY_JOINT_COMMAND_T_NOT_FINITE);
    assert_int_equal(LW_WAITING, LEEWAY_JOINT_COMMAND_T_WAITING);
    assert_int_equal(LW_FOREIGN, LEEWAY_JOINT_COMMAND_T_FOREIGN);
    assert_int_equal(LW_WARMING_UP, LEEWAY_JOINT_COMMAND_T_WARMING_UP);
    assert_int_equal(LW_LIMIT_CLEARANCE, LEEWAY_JOINT_COMMAND_T_LIMIT_CLEARANCE);
    assert_int_equal(LW_CONTACT, LEEWAY_JOINT_COMMAND_T_CONTACT);
    assert_int_equal(LW_COMMAND_IDLE, LEEWAY_JOINT_COMMAND_T_IDLE);
    assert_int_equal(LW_COMMAND_VELOCITY, LEEWAY_JOINT_COMMAND_T_VELOCITY);
    assert_int_equal(LW_LAW_NOT_ASKED, LEEWAY_JOINT_COMMAND_T_NOT_ASKED);
    assert_int_equal(LW_LAW_OK, LEEWAY_JOINT_COMMAND_T_OK);
    assert_int_equal(LW_LAW_NO_NUMBER, LEEWAY_JOINT_COMMAND_T_NO_NUMBER);
    assert_int_equal(LW_LAW_STUCK, LEEWAY_JOINT_COMMAND_T_STUCK);
    assert_int_equal(LW_LAW_ASIDE, LEEWAY_JOINT_COMMAND_T_ASIDE);
    assert_int_equal(LW_WORLD_NONE, LEEWAY_JOINT_COMMAND_T_NONE);
    assert_int_equal(LW_WORLD_OBSTACLES, LEEWAY_JOINT_COMMAND_T_OBSTACLES);
    assert_int_equal(LW_WORLD_HULL, LEEWAY_JOINT_COMMAND_T_HULL);
    assert_int_equal(LW_PLANT_HOLD, LEEWAY_JOINT_STATE_T_HOLD);
    assert_int_equal(LW_PLANT_MOVING, LEEWAY_JOINT_STATE_T_MOVING);
    assert_int_equal(LW_PLANT_STOPPING, LEEWAY_JOINT_STATE_T_STOPPING);
    assert_int_equal(LW_PLANT_ENDED, LEEWAY_JOINT_STATE_T_ENDED);
    assert_int_equal(LW_UPSERT, LEEWAY_OBSTACLES_T_UPSERT);
    assert_int_equal(LW_REMOVE, LEEWAY_OBSTACLES_T_REMOVE);
    assert_int_equal(LW_REPLACE, LEEWAY_OBSTACLES_T_REPLACE);
    assert_int_equal(LW_CLEAR, LEEWAY_OBSTACLES_T_CLEAR);
    assert_int_equal(LW_CHANGE_MAX, LEEWAY_OBSTACLES_T_MAX);
    assert_int_equal(LW_HULL_MAX, LEEWAY_HULL_T_MAX);
    assert_int_equal(LW_SPHERE, LEEWAY_OBSTACLE_T_SPHERE);
    assert_int_equal(LW_CAPSULE, LEEWAY_OBSTACLE_T_CAPSULE);
    assert_int_equal(LW_BOX, LEEWAY_OBSTACLE_T_BOX);
    assert_int_equal(LW_HULL, LEEWAY_OBSTACLE_T_HULL);
    assert_int_equal(LW_HALFSPACE, LEEWAY_OBSTACLE_T_HALFSPACE);
}

// --- what is valid survives ---

static void valid_messages_survive_to_the_last_bit(void **state)
{
    (void)state;
    struct random random = {81};
    for (int n = 0; n < 2000 * LW_CHANNEL_COUNT; n++) {
        const enum lw_channel channel = (enum lw_channel)(n % LW_CHANNEL_COUNT);
        const union lw_message in = make(&random, channel);
        union lw_message out;
        unsigned char data[LW_WIRE_MAX], again[LW_WIRE_MAX];
        const uint32_t size = lw_wire_encode(channel, &in, data);
        assert_int_equal(decode(channel, data, size, &out), LW_OK);
        assert_int_equal(lw_wire_encode(channel, &out, again), size);
        assert_same_bits(again, data, size);
        assert_same_bits(&out.stamp, &in.stamp, sizeof in.stamp);
    }
}

// Fields do not trade places: each arrives under its own name.
static void the_fields_of_a_state_keep_their_places(void **state)
{
    (void)state;
    struct random random = {88};
    for (int n = 0; n < 500; n++) {
        unsigned char data[LW_WIRE_MAX];
        union lw_message in = make(&random, LW_CHANNEL_JOINT_STATE), out;
        const uint32_t size = lw_wire_encode(LW_CHANNEL_JOINT_STATE, &in, data);
        assert_int_equal(decode(LW_CHANNEL_JOINT_STATE, data, size, &out), LW_OK);
        const struct lw_joint_state *a = &in.joint_state, *b = &out.joint_state;
        assert_same_bits(&a->stamp, &b->stamp, sizeof a->stamp);
        assert_true(a->mode == b->mode && a->command_session == b->command_session && a->command_seq == b->command_seq);
        assert_true(a->tick == b->tick && a->period_ns == b->period_ns);
        assert_same_bits(a->q, b->q, sizeof a->q);
        assert_same_bits(a->qd, b->qd, sizeof a->qd);
    }
}

static void the_fields_of_obstacles_and_requests_keep_their_places(void **state)
{
    (void)state;
    struct random random = {82};
    for (int n = 0; n < 500; n++) {
        unsigned char data[LW_WIRE_MAX];
        union lw_message in, out;
        uint32_t size = 0;
        in = make(&random, LW_CHANNEL_OBSTACLES);
        size = lw_wire_encode(LW_CHANNEL_OBSTACLES, &in, data);
        assert_int_equal(decode(LW_CHANNEL_OBSTACLES, data, size, &out), LW_OK);
        assert_same_bits(&out.obstacles, &in.obstacles, sizeof in.obstacles); // no padding, unused ones are 0
        in = make(&random, LW_CHANNEL_HULL);
        size = lw_wire_encode(LW_CHANNEL_HULL, &in, data);
        assert_int_equal(decode(LW_CHANNEL_HULL, data, size, &out), LW_OK);
        assert_same_bits(&out.obstacles, &in.obstacles, sizeof in.obstacles);
        in = make(&random, LW_CHANNEL_GOAL);
        size = lw_wire_encode(LW_CHANNEL_GOAL, &in, data);
        assert_int_equal(decode(LW_CHANNEL_GOAL, data, size, &out), LW_OK);
        assert_int_equal(out.request.kind, LW_REQUEST_GOAL);
        assert_same_bits(out.request.goal, in.request.goal, sizeof in.request.goal);
        size = lw_wire_encode(LW_CHANNEL_STOP, &in, data);
        assert_int_equal(decode(LW_CHANNEL_STOP, data, size, &out), LW_OK);
        assert_int_equal(out.request.kind, LW_REQUEST_STOP);
    }
}

// Every field another number.
static const union lw_message told = {.joint_command = {.stamp = {1, 2, 3, 4},
                                                        .plant_session = 5,
                                                        .state_seq = 6,
                                                        .state_tick = 7,
                                                        .state_mono_ns = 8,
                                                        .mode = LW_COMMAND_VELOCITY,
                                                        .flags = 2047,
                                                        .law_outcome = LW_LAW_NO_NUMBER,
                                                        .qd = {1, 2, 3, 4, 5, 6},
                                                        .qd_law = {7, 8, 9, 10, 11, 12},
                                                        .q = {-1, -2, -3, -4, -5, -6},
                                                        .goal = {21, 22, 23},
                                                        .request = {91, 92, 31, 32},
                                                        .world = {93, 94, 33, 34},
                                                        .world_channel = 2,
                                                        .world_version = 35,
                                                        .obstacle_count = 36,
                                                        .deviation = 37,
                                                        .nearest = {38, 39, 40},
                                                        .self_clearance = 49,
                                                        .self_link = {50, 51},
                                                        .stuck_since_ns = 52,
                                                        .circulation = {53, 54, 55},
                                                        .tick = 41,
                                                        .tick_ns = 42,
                                                        .state_age_ns = 43,
                                                        .input_digest = 44,
                                                        .compute_ns = 45,
                                                        .wake_late_ns = 46,
                                                        .previous_exec_ns = 47,
                                                        .skipped = 48}};

// The plant takes what it needs of a command; the explanation reaches the log field by field.
static void the_explanation_of_a_command_reaches_the_log(void **state)
{
    (void)state;
    const struct lw_joint_command *c = &told.joint_command;
    unsigned char data[LW_WIRE_MAX];
    leeway_joint_command_t w;
    const int size = (int)lw_wire_encode(LW_CHANNEL_JOINT_COMMAND, &told, data);
    assert_int_equal(leeway_joint_command_t_decode(data, 0, size, &w), size);
    // In the order of the numbers above.
    const int64_t counts[] = {w.h.utime,
                              w.h.mono_ns,
                              w.h.session,
                              w.h.seq,
                              w.plant_session,
                              w.state_seq,
                              w.state_tick,
                              w.state_mono_ns,
                              w.mode,
                              w.flags,
                              w.law_outcome,
                              w.request_session,
                              w.request_seq,
                              w.world_session,
                              w.world_seq,
                              w.world_version,
                              w.obstacle_count,
                              w.clearance_link,
                              w.clearance_obstacle,
                              w.tick,
                              w.tick_ns,
                              w.state_age_ns,
                              w.input_digest,
                              w.compute_ns,
                              w.wake_late_ns,
                              w.previous_exec_ns,
                              w.skipped,
                              w.self_link[0],
                              w.self_link[1],
                              w.stuck_since_ns,
                              w.world_channel};
    const int64_t expected[] = {1,  2,  3,  4,  5,  6,  7,  8,  1,  2047, 2,  31, 32, 33, 34, 35,
                                36, 39, 40, 41, 42, 43, 44, 45, 46, 47,   48, 50, 51, 52, 2};
    assert_same_bits(counts, expected, sizeof expected);
    assert_same_bits(w.qd, c->qd, sizeof w.qd);
    assert_same_bits(w.qd_law, c->qd_law, sizeof w.qd_law);
    assert_same_bits(w.q, c->q, sizeof w.q);
    assert_same_bits(w.goal, c->goal, sizeof w.goal);
    assert_near(w.deviation, 37, 0);
    assert_near(w.clearance, 38, 0);
    assert_near(w.self_clearance, 49, 0);
    assert_same_bits(w.circulation, c->circulation, sizeof w.circulation);
}

// What the plant and its lockstep take of a command.
static void the_plant_hears_all_it_needs_of_a_command(void **state)
{
    (void)state;
    struct random random = {89};
    for (int n = 0; n < 500; n++) {
        unsigned char data[LW_WIRE_MAX];
        union lw_message in = make(&random, LW_CHANNEL_JOINT_COMMAND), out;
        const uint32_t size = lw_wire_encode(LW_CHANNEL_JOINT_COMMAND, &in, data);
        assert_int_equal(decode(LW_CHANNEL_JOINT_COMMAND, data, size, &out), LW_OK);
        const struct lw_joint_command *a = &in.joint_command, *b = &out.joint_command;
        assert_same_bits(a->qd, b->qd, sizeof a->qd);
        assert_true(a->mode == b->mode && a->flags == b->flags && a->plant_session == b->plant_session);
        assert_true(a->state_seq == b->state_seq && a->state_tick == b->state_tick);
        assert_true(a->state_mono_ns == b->state_mono_ns && a->world.session == b->world.session);
    }
}

// --- what is not is refused ---

// Any size but the right one, before a byte is read: a packet without a channel name comes with a size near 2^32.
static void every_wrong_size_is_refused(void **state)
{
    (void)state;
    struct random random = {83};
    for (int c = 0; c < LW_CHANNEL_COUNT; c++) {
        const enum lw_channel channel = (enum lw_channel)c;
        const union lw_message m = make(&random, channel);
        unsigned char data[LW_WIRE_MAX] = {0};
        union lw_message out;
        const uint32_t size = lw_wire_encode(channel, &m, data);
        for (uint32_t wrong = 0; wrong < LW_WIRE_MAX; wrong++)
            assert_int_equal(decode(channel, data, wrong, &out), wrong == size ? LW_OK : LW_E_SIZE);
        const uint32_t huge[] = {0xfffffff5u, 0xffffffffu, 0x80000000u, 0x80000000u + size, 65536u + size};
        for (size_t i = 0; i < sizeof huge / sizeof huge[0]; i++)
            assert_int_equal(decode(channel, NULL, huge[i], &out), LW_E_SIZE);
    }
}

static void every_wrong_fingerprint_is_refused(void **state)
{
    (void)state;
    struct random random = {84};
    for (int c = 0; c < LW_CHANNEL_COUNT; c++)
        for (int bit = 0; bit < 64; bit++) {
            const union lw_message m = make(&random, (enum lw_channel)c);
            unsigned char data[LW_WIRE_MAX];
            union lw_message out;
            const uint32_t size = lw_wire_encode((enum lw_channel)c, &m, data);
            data[bit / 8] = (unsigned char)(data[bit / 8] ^ (1u << (bit % 8)));
            assert_int_equal(decode((enum lw_channel)c, data, size, &out), LW_E_DECODE);
        }
}

// Session and seq are positive on every channel.
static void every_stamp_is_checked(void **state)
{
    (void)state;
    struct random random = {85};
    const int64_t bad[] = {0, -1, INT64_MIN};
    for (int c = 0; c < LW_CHANNEL_COUNT; c++)
        for (int i = 0; i < 6; i++) {
            union lw_message m = make(&random, (enum lw_channel)c);
            *(i % 2 ? &m.stamp.session : &m.stamp.seq) = bad[i / 2];
            check_message((enum lw_channel)c, &m, LW_E_ARGUMENT);
        }
}

static void every_double_is_checked(void **state)
{
    (void)state;
    struct random random = {86};
    union lw_message s = make(&random, LW_CHANNEL_JOINT_STATE), c = make(&random, LW_CHANNEL_JOINT_COMMAND);
    union lw_message g = make(&random, LW_CHANNEL_GOAL);
    for (int j = 0; j < LW_NJ; j++) {
        check_double(LW_CHANNEL_JOINT_STATE, &s, &s.joint_state.q[j], 1e6);
        check_double(LW_CHANNEL_JOINT_STATE, &s, &s.joint_state.qd[j], 1e6);
        check_double(LW_CHANNEL_JOINT_COMMAND, &c, &c.joint_command.qd[j], 1e6);
    }
    for (int i = 0; i < 3; i++)
        check_double(LW_CHANNEL_GOAL, &g, &g.request.goal[i], 100);
}

// Modes and operations out of their lists, every one of the 256 bytes; a period that is not positive.
static void every_choice_is_checked(void **state)
{
    (void)state;
    struct random random = {87};
    const struct {
        enum lw_channel channel;
        int place, choices;
    } fields[] = {{LW_CHANNEL_JOINT_STATE, PLACE_OF_MODE, 4}, {LW_CHANNEL_JOINT_COMMAND, PLACE_OF_MODE + 32, 2},
                  {LW_CHANNEL_OBSTACLES, PLACE_OF_OP, 4},     {LW_CHANNEL_WORLD, PLACE_OF_OP, 4},
                  {LW_CHANNEL_OBSTACLES, PLACE_OF_SHAPE, 5},  {LW_CHANNEL_WORLD, PLACE_OF_SHAPE, 5},
                  {LW_CHANNEL_STATUS, PLACE_OF_MODE, 5},      {LW_CHANNEL_PLANT_STATUS, PLACE_OF_MODE, 5}};
    for (size_t f = 0; f < sizeof fields / sizeof fields[0]; f++)
        for (int value = 0; value < 256; value++) {
            unsigned char data[LW_WIRE_MAX];
            union lw_message m = make(&random, fields[f].channel), out;
            if (fields[f].channel == LW_CHANNEL_OBSTACLES || fields[f].channel == LW_CHANNEL_WORLD) {
                m.obstacles.op = LW_UPSERT;
                m.obstacles.count = 1;
                m.obstacles.obstacle[0] = any_obstacle(&random, 1, LW_BOX); // its sizes do for all shapes
            }
            const uint32_t size = lw_wire_encode(fields[f].channel, &m, data);
            data[fields[f].place] = (unsigned char)value;
            assert_int_equal(decode(fields[f].channel, data, size, &out),
                             value < fields[f].choices ? LW_OK : LW_E_ARGUMENT);
        }
    for (int64_t period = -1; period <= 1; period++) {
        union lw_message m = make(&random, LW_CHANNEL_JOINT_STATE);
        m.joint_state.period_ns = period;
        check_message(LW_CHANNEL_JOINT_STATE, &m, period > 0 ? LW_OK : LW_E_ARGUMENT);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sizes_and_fingerprints_are_pinned),
        cmocka_unit_test(constants_are_those_of_the_wire),
        cmocka_unit_test(valid_messages_survive_to_the_last_bit),
        cmocka_unit_test(the_fields_of_a_state_keep_their_places),
        cmocka_unit_test(the_fields_of_obstacles_and_requests_keep_their_places),
        cmocka_unit_test(the_explanation_of_a_command_reaches_the_log),
        cmocka_unit_test(the_plant_hears_all_it_needs_of_a_command),
        cmocka_unit_test(every_wrong_size_is_refused),
        cmocka_unit_test(every_wrong_fingerprint_is_refused),
        cmocka_unit_test(every_stamp_is_checked),
        cmocka_unit_test(every_double_is_checked),
        cmocka_unit_test(every_choice_is_checked),
    };
    return cmocka_run_group_tests_name("wire", tests, NULL, NULL);
}
