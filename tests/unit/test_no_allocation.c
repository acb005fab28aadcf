// SPDX-License-Identifier: BSD-3-Clause
// The real-time path allocates nothing: neither tick nor plant, gate, wire, ring or phase lock. lib/program counts the
// calls, shared libraries' too (test_allocations.c proves it).
//
// Units    none.
// Frames   base frame.
// Arrays   none.
// Memory   counted.
// Errors   cmocka's. Sanitizers bring allocators of their own: there the program ends with 77, skipped.
#include "base/phase.h" // lw_phase_correct
#include "base/ring.h"  // lw_ring_push
#include "bus/datagram.h"
#include "bus/gate.h" // lw_gate_judge
#include "controller/tick.h"
#include "datagram_packets.h" // make_packet
#include "balls.h"
#include "collision/world.h" // lw_world_apply
#include "helpers.h"
#include "program/allocations.h" // lw_allocations_*
#include "simulator/plant.h"
#include "wire_messages.h" // make

#include <sys/socket.h> // socketpair
#include <unistd.h>     // close

enum { SKIPPED = 77 };

// --- the real-time path ---

struct rig {
    struct lw_scene scene;
    struct lw_controller config;
    struct lw_controller_state state;
    struct lw_plant plant;
    struct lw_plant_state arm;
    struct lw_snapshot world;
    struct lw_request request;
    struct lw_gate gate;
    struct lw_lease lease;
    struct lw_ring ring;
    struct lw_phase phase;
    struct lw_joint_command slots[2];
};

// One period of the live programs without their sockets: state over the wire, tick, command over the wire, gate, plant.
// Returns whether the command was taken.
static bool one_period(struct rig *rig, int64_t seq)
{
    unsigned char data[LW_WIRE_MAX];
    union lw_message m, heard;
    lw_plant_report(&rig->plant, &rig->arm, &m.joint_state);
    m.stamp.seq = seq;
    const uint32_t state_size = lw_wire_encode(LW_CHANNEL_JOINT_STATE, &m, data);
    enum lw_status status = lw_wire_decode(LW_CHANNEL_JOINT_STATE, data, state_size, &heard);
    const struct lw_tick_input in = {.joint = &heard.joint_state, .world = &rig->world, .request = &rig->request};
    lw_tick(&rig->config, &rig->state, &in, &m.joint_command);
    m.stamp = (struct lw_stamp){.session = 2, .seq = seq};
    const uint32_t size = lw_wire_encode(LW_CHANNEL_JOINT_COMMAND, &m, data);
    if (status == LW_OK)
        status = lw_wire_decode(LW_CHANNEL_JOINT_COMMAND, data, size, &heard);
    (void)lw_phase_correct(&rig->phase, seq * 2000, seq * 1999, 2000, seq % 2);
    const bool kept = lw_ring_push(&rig->ring, &heard.joint_command) && lw_ring_pop(&rig->ring, &heard.joint_command);
    const enum lw_verdict verdict = lw_gate_judge(&rig->gate, &rig->lease, &heard.joint_command, seq, seq);
    lw_plant_obey(&rig->arm, &heard.joint_command, seq);
    lw_plant_step(&rig->plant, &rig->arm, seq);
    return status == LW_OK && kept && verdict == LW_TAKEN;
}

static void tick_plant_and_wire_allocate_nothing(void **state)
{
    (void)state;
    static struct rig rig;
    rig.scene = lw_scene_defaults(LW_UR5);
    rig.scene.plant.rate_hz = rig.scene.rate_hz;
    assert_int_equal(lw_controller_init(&rig.config, &rig.state, &rig.scene, 2), LW_OK);
    lw_plant_init(&rig.plant, &rig.arm, &rig.scene, 1);
    const double at[3][3] = {{-0.5, -0.6, 0.3}, {-0.2, -0.6, 0.3}, {0.1, -0.6, 0.3}};
    rig.world.version = 1;
    put_balls(&rig.world, 1, at, 3, 0.05);
    rig.gate = (struct lw_gate){.plant_session = 1, .velocity = {9, 9, 9, 9, 9, 9}};
    lw_ring_init(&rig.ring, rig.slots, sizeof rig.slots[0], 2);
    int refused = 0;
    assert_true(lw_allocations_watch());
    for (int64_t seq = 1; seq <= 100000; seq++) {
        rig.request = (struct lw_request){.stamp = {.session = 9, .seq = seq / 1000},
                                          .goal = {0.4, 0.1, 0.0001 * (double)(seq % 5000)}};
        refused += !one_period(&rig, seq);
    }
    assert_int_equal(lw_allocations_count(), 0);
    lw_allocations_unwatch();
    assert_int_equal(refused, 0);
    assert_int_equal(rig.arm.tick, 100000); // it did run
}

// Encoding, decoding and merging every kind of message, valid or damaged.
static void every_channel_allocates_nothing(void **state)
{
    (void)state;
    struct random random = {101};
    static struct lw_world world;
    int taken = 0, refused = 0;
    assert_true(lw_allocations_watch());
    for (int n = 0; n < 100000; n++) {
        const enum lw_channel channel = (enum lw_channel)(n % LW_CHANNEL_COUNT);
        const union lw_message m = make(&random, channel);
        unsigned char data[LW_WIRE_MAX];
        union lw_message out;
        const uint32_t size = lw_wire_encode(channel, &m, data);
        if (n % 3 == 0)
            data[random_below(&random, (int)size)] ^= 0x55;
        const bool ok = lw_wire_decode(channel, data, size, &out) == LW_OK;
        if (ok && (channel == LW_CHANNEL_OBSTACLES || channel == LW_CHANNEL_HULL))
            (void)(lw_world_apply(&world, &out.obstacles) == LW_OK);
        *(ok ? &taken : &refused) += 1;
    }
    assert_int_equal(lw_allocations_count(), 0);
    lw_allocations_unwatch();
    assert_true(taken > 1000 && refused > 1000 && world.version > 10);
}

// Receiving: messages, foreign packets, waits of several lengths that end with nothing.
static void reception_allocates_nothing(void **state)
{
    (void)state;
    struct random random = {102};
    int pair[2];
    assert_int_equal(socketpair(AF_UNIX, SOCK_DGRAM, 0, pair), 0);
    static struct lw_datagram d;
    d = (struct lw_datagram){.channel = "GOAL", .fd = pair[1], .timeout_ms = -1};
    int heard = 0, nothing = 0;
    assert_true(lw_allocations_watch());
    for (int n = 0; n < 10000; n++) {
        const void *payload = NULL;
        uint32_t size = 0;
        const struct packet p = make_packet(&random, n % 3 == 0 ? "GOALS" : "GOAL", 200);
        if (n % 1000 != 0 && send(pair[0], p.bytes, p.size, 0) < 0)
            break;
        *(lw_datagram_receive(&d, n % 4, &payload, &size) == 1 ? &heard : &nothing) += 1;
    }
    assert_int_equal(lw_allocations_count(), 0);
    lw_allocations_unwatch();
    assert_true(heard > 6000 && nothing > 3000 && d.refused > 3000);
    lw_datagram_close(&d);
    close(pair[0]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tick_plant_and_wire_allocate_nothing),
        cmocka_unit_test(every_channel_allocates_nothing),
        cmocka_unit_test(reception_allocates_nothing),
    };
    if (!LW_ALLOCATIONS_COUNTED)
        return SKIPPED;
    return cmocka_run_group_tests_name("no_allocation", tests, NULL, NULL);
}
