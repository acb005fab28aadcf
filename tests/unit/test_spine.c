// SPDX-License-Identifier: BSD-3-Clause
// Property test of the spine in one process: plant, gate and two controllers' ticks, joined by channels that lose,
// duplicate, delay and reorder. The arm never accelerates beyond its limit, one controller moves it at a time, and it
// is at rest in time whenever commands cease.
//
// Units    radians, seconds; ns where a name says so.
// Frames   base frame.
// Arrays   one entry a joint.
// Memory   static.
// Errors   cmocka's.
#include "bus/gate.h"
#include "controller/tick.h"
#include "balls.h"
#include "helpers.h"
#include "simulator/plant.h"

enum { CONTROLLERS = 2, UNDER_WAY = 64, PERIODS = 6000, SEEDS = 20, PLANT = 100 };
static const int64_t ms = 1000000, period_ns = 2000000, lease_ns = 100000000;

// --- the channel ---

struct packet {
    int64_t due_ns; // 0 = free place
    int to;         // controller for states, -1 = the plant
    union {
        struct lw_joint_state state;
        struct lw_joint_command command;
    };
};

struct channel {
    struct random random;
    struct packet packet[UNDER_WAY];
    double loss, duplication, late;
    bool cut; // nothing gets through
};

static void put(struct channel *channel, struct packet packet, int64_t now_ns)
{
    struct random *random = &channel->random;
    int copies = 1 - (random_in(random, 0, 1) < channel->loss) + (random_in(random, 0, 1) < channel->duplication);
    for (int i = 0; i < UNDER_WAY && copies > 0 && !channel->cut; i++)
        if (channel->packet[i].due_ns == 0) {
            const bool late = random_in(random, 0, 1) < channel->late;
            packet.due_ns = now_ns + 1 + (int64_t)random_in(random, 0, late ? 30e6 : 0.9e6);
            channel->packet[i] = packet;
            copies--;
        }
}

// The packet due next, up to a time; NULL when there is none.
static struct packet *next_due(struct channel *channel, int64_t until_ns)
{
    struct packet *first = NULL;
    for (int i = 0; i < UNDER_WAY; i++) {
        struct packet *p = &channel->packet[i];
        if (p->due_ns != 0 && p->due_ns <= until_ns && (first == NULL || p->due_ns < first->due_ns))
            first = p;
    }
    return first;
}

// --- both ends ---

struct control {
    bool alive;
    struct lw_controller config;
    struct lw_controller_state state;
    struct lw_lease lease;
    struct lw_joint_state joint; // newest heard
    int64_t arrival_ns, seq;
    struct lw_request request;
};

struct spine {
    struct channel channel;
    struct lw_scene scene;
    struct lw_plant plant;
    struct lw_plant_state arm;
    struct lw_gate gate;
    struct lw_lease lease;
    struct lw_snapshot world;
    struct control control[CONTROLLERS];
    int64_t now_ns, state_seq, next_session;
    struct lw_joint_command command; // newest taken
    bool fresh;
    // What was seen.
    int64_t owner, last_ns, taken, moved, takeovers;
};

static void start_controller(struct spine *s, int which)
{
    struct control *c = &s->control[which];
    *c = (struct control){.alive = true};
    assert_int_equal(lw_controller_init(&c->config, &c->state, &s->scene, s->next_session++), LW_OK);
}

static struct spine *start(uint64_t seed)
{
    static struct spine s;
    s = (struct spine){.channel = {.random = {seed * UINT64_C(0x9e3779b97f4a7c15)}}, .next_session = 200};
    s.now_ns = 1000 * ms;
    s.scene = lw_scene_defaults(LW_UR5);
    s.scene.plant.rate_hz = s.scene.rate_hz = 500;
    const double q0[LW_NJ] = {0, -1.2, 1.6, -0.4, 0.3, 0};
    memcpy(s.scene.q0, q0, sizeof q0);
    lw_plant_init(&s.plant, &s.arm, &s.scene, PLANT);
    s.gate =
        (struct lw_gate){.plant_session = PLANT, .open_ns = s.now_ns + 250 * ms, .lease_ns = lease_ns, .max_lag = 20};
    memcpy(s.gate.velocity, s.plant.velocity, sizeof s.gate.velocity);
    const double at[1][3] = {{-0.35, -0.5, 0.36}};
    s.world.version = 1;
    put_balls(&s.world, 1, at, 1, 0.08);
    for (int i = 0; i < CONTROLLERS; i++)
        start_controller(&s, i);
    return &s;
}

// The plant hears a command; two owners within one lease would fail here.
static void hear_command(struct spine *s, const struct lw_joint_command *command)
{
    if (lw_gate_judge(&s->gate, &s->lease, command, s->state_seq, s->now_ns) != LW_TAKEN)
        return;
    if (command->stamp.session != s->owner) {
        assert_true(s->owner == 0 || s->now_ns - s->last_ns >= lease_ns);
        s->takeovers += s->owner != 0;
    } else {
        assert_true(command->stamp.seq > s->command.stamp.seq);
    }
    s->owner = command->stamp.session;
    s->last_ns = s->now_ns;
    s->taken++;
    s->command = *command;
    s->fresh = true;
}

static void hear_state(struct spine *s, struct control *c, const struct lw_joint_state *state)
{
    if (!c->alive || lw_lease_take(&c->lease, &state->stamp, s->now_ns, lease_ns) != LW_TAKEN)
        return;
    c->joint = *state;
    c->arrival_ns = s->now_ns;
}

static void deliver(struct spine *s, int64_t until_ns)
{
    for (struct packet *p; (p = next_due(&s->channel, until_ns)) != NULL; p->due_ns = 0) {
        s->now_ns = p->due_ns;
        if (p->to < 0)
            hear_command(s, &p->command);
        else
            hear_state(s, &s->control[p->to], &p->state);
    }
    s->now_ns = until_ns;
}

static void step_controller(struct spine *s, struct control *c)
{
    struct packet packet = {.to = -1};
    const struct lw_tick_input in = {.time_ns = s->now_ns,
                                     .state_age_ns = s->now_ns - c->arrival_ns,
                                     .joint = &c->joint,
                                     .world = &s->world,
                                     .request = &c->request};
    lw_tick(&c->config, &c->state, &in, &packet.command);
    packet.command.stamp = (struct lw_stamp){.session = c->config.session, .seq = ++c->seq};
    put(&s->channel, packet, s->now_ns);
}

// One plant step, checked: no joint accelerates or goes faster than it may, and its position follows.
static void step_plant(struct spine *s)
{
    const struct lw_plant_state before = s->arm;
    if (s->fresh)
        lw_plant_obey(&s->arm, &s->command, s->last_ns);
    s->fresh = false;
    lw_plant_step(&s->plant, &s->arm, s->now_ns);
    for (int j = 0; j < LW_NJ; j++) {
        assert_true(fabs(s->arm.qd[j] - before.qd[j]) <= s->plant.acceleration[j] * s->plant.period_s + 1e-12);
        assert_true(fabs(s->arm.qd[j]) <= s->plant.velocity[j]);
        assert_near(s->arm.q[j], before.q[j] + s->plant.period_s * s->arm.qd[j], 0);
        assert_true(fabs(s->arm.q[j]) < 7);
    }
    s->moved += !lw_plant_at_rest(&s->arm);
    struct packet packet = {0};
    lw_plant_report(&s->plant, &s->arm, &packet.state);
    packet.state.stamp = (struct lw_stamp){.session = PLANT, .seq = ++s->state_seq, .mono_ns = s->now_ns};
    for (packet.to = 0; packet.to < CONTROLLERS; packet.to++)
        put(&s->channel, packet, s->now_ns);
}

// At rest within timeout + v/a + one period of the last command taken, whatever still arrives and is refused.
static void check_rest(const struct spine *s, const struct lw_plant_state *at_last)
{
    double ramp_s = 0;
    for (int j = 0; j < LW_NJ; j++)
        ramp_s = fmax(ramp_s, fabs(at_last->qd[j]) / s->plant.acceleration[j]);
    const double silent_s = (double)(s->now_ns - s->last_ns) * 1e-9;
    if (silent_s > (double)s->plant.timeout_ns * 1e-9 + ramp_s + s->plant.period_s + 1e-9)
        assert_true(lw_plant_at_rest(&s->arm));
}

static void one_period(struct spine *s)
{
    static struct lw_plant_state at_last; // when the timeout after the last command ran out
    deliver(s, s->now_ns + period_ns / 2);
    for (int i = 0; i < CONTROLLERS; i++)
        if (s->control[i].alive)
            step_controller(s, &s->control[i]);
    deliver(s, s->now_ns + period_ns / 2);
    step_plant(s);
    if (s->arm.mode != LW_PLANT_STOPPING)
        at_last = s->arm;
    check_rest(s, &at_last);
}

// --- properties ---

// Goals and stops at random, controllers that die and are replaced, cuts of the channel, any quality of it.
static void disturb(struct spine *s, int k)
{
    struct random *random = &s->channel.random;
    if (k % 500 == 0) {
        s->channel.loss = random_below(random, 3) * 0.15;
        s->channel.duplication = random_below(random, 3) * 0.1;
        s->channel.late = random_below(random, 4) * 0.1;
    }
    if (random_below(random, 400) == 0)
        s->channel.cut = !s->channel.cut;
    struct control *c = &s->control[random_below(random, CONTROLLERS)];
    if (random_below(random, 700) == 0)
        c->alive = false;
    else if (!c->alive && random_below(random, 100) == 0)
        start_controller(s, (int)(c - s->control));
    if (random_below(random, 100) == 0)
        c->request = (struct lw_request){
            .stamp = {.session = 9, .seq = k + 1},
            .kind = random_below(random, 4) ? LW_REQUEST_GOAL : LW_REQUEST_STOP,
            .goal = {random_in(random, -0.6, 0.6), random_in(random, -0.6, 0.6), random_in(random, 0.1, 0.6)}};
}

static void nothing_makes_the_arm_step(void **state)
{
    (void)state;
    int64_t moved = 0;
    for (uint64_t seed = 1; seed <= SEEDS; seed++) {
        struct spine *s = start(seed);
        for (int k = 0; k < PERIODS; k++) {
            disturb(s, k);
            one_period(s);
        }
        assert_true(s->taken > PERIODS / 10 && s->moved > 0 && s->takeovers > 0);
        moved += s->moved;
    }
    assert_true(moved > SEEDS * PERIODS / 5); // it was not at rest most of the time
}

// Every message lost from some moment on: the arm comes to rest, and moves on when they come again.
static void a_cut_channel_brings_the_arm_to_rest(void **state)
{
    (void)state;
    for (uint64_t seed = 1; seed <= 20; seed++) {
        struct spine *s = start(seed);
        const int cut_at = 200 + random_below(&s->channel.random, 300);
        for (int k = 0; k < cut_at; k++)
            one_period(s);
        assert_false(lw_plant_at_rest(&s->arm));
        s->channel.cut = true;
        for (int k = 0; k < 300; k++)
            one_period(s); // check_rest looks on
        assert_true(lw_plant_at_rest(&s->arm));
        assert_int_equal(s->arm.mode, LW_PLANT_STOPPING);
        s->channel.cut = false;
        for (int k = 0; k < 20; k++)
            one_period(s);
        assert_int_equal(s->arm.mode, LW_PLANT_MOVING);
        assert_false(lw_plant_at_rest(&s->arm));
    }
}

// Two controllers from the start: the second is never heard while the first lives, and brakes its own command; when the
// first dies it takes over after the lease.
static void the_second_controller_waits_for_the_first_to_die(void **state)
{
    (void)state;
    struct spine *s = start(3);
    for (int k = 0; k < 1000; k++)
        one_period(s);
    const int first = s->owner == s->control[1].config.session;
    const int64_t second = s->control[!first].config.session;
    assert_int_equal(s->takeovers, 0);
    assert_int_equal(s->owner, s->control[first].config.session);
    assert_true(s->control[!first].joint.command_session == s->owner);
    s->control[first].alive = false;
    int waited = 0;
    for (; s->owner != second; waited++) {
        assert_true(waited < 100);
        one_period(s);
    }
    assert_true(waited * period_ns >= lease_ns - period_ns && waited * period_ns <= lease_ns + 3 * period_ns);
    assert_int_equal(s->takeovers, 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_makes_the_arm_step),
        cmocka_unit_test(a_cut_channel_brings_the_arm_to_rest),
        cmocka_unit_test(the_second_controller_waits_for_the_first_to_die),
    };
    return cmocka_run_group_tests_name("spine", tests, NULL, NULL);
}
