// SPDX-License-Identifier: BSD-3-Clause
// Property test of the gate: several controllers that come and go, plants that restart, and a channel that loses,
// duplicates, delays and reorders. Never two owners within one lease, no command twice, no refusal without a cause.
//
// Units    ns.
// Frames   none.
// Arrays   messages under way, in no order.
// Memory   static.
// Errors   cmocka's.
#include "bus/gate.h"
#include "helpers.h"

enum { CONTROLLERS = 4, UNDER_WAY = 256, LAG = 20, STEPS = 40000, SESSIONS = 4096 };
static const int64_t ms = 1000000, period_ns = 2000000;

struct controller {
    int64_t session, seq;
    bool alive;
    int64_t plant_session, state_seq; // heard last
};

struct packet {
    int64_t due_ns; // 0 = free slot
    struct lw_joint_command command;
};

struct traffic {
    struct random random;
    int64_t now_ns, next_session;
    struct lw_gate gate;
    struct lw_lease lease;
    int64_t state_seq;
    struct controller controller[CONTROLLERS];
    struct packet packet[UNDER_WAY];
    // The test's own account.
    int64_t owner, owner_ns, owner_seq, taken, missed, takeovers;
    int64_t highest[SESSIONS]; // number taken from each session
    int64_t verdicts[1 + LW_REFUSED_COUNT];
};

// A new plant knows no controller.
static void restart_plant(struct traffic *t)
{
    t->gate = (struct lw_gate){.plant_session = t->next_session++,
                               .open_ns = t->now_ns + 250 * ms,
                               .lease_ns = 100 * ms,
                               .max_lag = LAG,
                               .velocity = {3, 3, 3, 3, 3, HUGE_VAL}};
    t->lease = (struct lw_lease){0};
    t->state_seq = 1;
    t->owner = t->owner_ns = t->owner_seq = t->taken = t->missed = t->takeovers = 0;
}

// A controller dies, or another takes its place; mostly they live.
static void come_and_go(struct traffic *t, struct controller *c)
{
    if (c->alive && random_below(&t->random, 400) == 0)
        c->alive = false;
    else if (!c->alive && random_below(&t->random, 100) == 0)
        *c = (struct controller){.session = t->next_session++, .alive = true};
}

static void put_under_way(struct traffic *t, const struct lw_joint_command *command, int64_t delay_ns)
{
    for (int i = 0; i < UNDER_WAY; i++)
        if (t->packet[i].due_ns == 0) {
            t->packet[i] = (struct packet){t->now_ns + delay_ns, *command};
            return;
        }
}

// Mostly quick; some late enough to be overtaken, some later than any lease.
static int64_t any_delay(struct random *random)
{
    const int64_t longest[] = {ms, ms, ms, 6 * ms, 60 * ms, 400 * ms};
    return 1 + (int64_t)random_in(random, 0, (double)longest[random_below(random, 6)]);
}

static void send(struct traffic *t, struct controller *c)
{
    struct random *random = &t->random;
    if (random_below(random, 4)) { // hears the plant
        c->plant_session = t->gate.plant_session;
        c->state_seq = t->state_seq;
    }
    struct lw_joint_command command = {.stamp = {.session = c->session, .seq = ++c->seq},
                                       .plant_session = c->plant_session,
                                       .state_seq = c->state_seq,
                                       .mode = random_below(random, 10) ? LW_COMMAND_VELOCITY : LW_COMMAND_IDLE};
    random_fill(random, -2, 2, command.qd, LW_NJ);
    if (random_below(random, 30) == 0)
        command.qd[random_below(random, LW_NJ)] = random_below(random, 2) ? NO_NUMBER : -HUGE_VAL;
    for (int copies = random_below(random, 10) == 0 ? 2 : random_below(random, 10) != 0; copies > 0; copies--)
        put_under_way(t, &command, any_delay(random));
}

static bool all_finite(const double values[LW_NJ])
{
    bool finite = true;
    for (int j = 0; j < LW_NJ; j++)
        finite = finite && isfinite(values[j]);
    return finite;
}

// Whether the reason given for a refusal is true.
static bool is_cause(const struct traffic *t, const struct lw_joint_command *c, enum lw_verdict verdict)
{
    const int64_t lag = t->state_seq - c->state_seq;
    const bool held = t->owner != 0 && t->now_ns - t->owner_ns < t->gate.lease_ns;
    switch (verdict) {
    case LW_REFUSED_RANGE: return !all_finite(c->qd);
    case LW_REFUSED_GUARD: return t->now_ns < t->gate.open_ns;
    case LW_REFUSED_OTHER_PLANT: return c->plant_session != t->gate.plant_session;
    case LW_REFUSED_IDLE: return c->mode == LW_COMMAND_IDLE;
    case LW_REFUSED_STALE: return lag < 0 || lag > LAG;
    case LW_REFUSED_FOREIGN: return held && c->stamp.session != t->owner;
    case LW_REFUSED_DUPLICATE: return c->stamp.session == t->owner && c->stamp.seq == t->owner_seq;
    case LW_REFUSED_BACKWARDS: return c->stamp.session == t->owner && c->stamp.seq < t->owner_seq;
    default: return false;
    }
}

// Notes a command that was taken, after checking that it might be.
static void take(struct traffic *t, const struct lw_joint_command *c)
{
    for (int reason = 0; reason < LW_REFUSED_COUNT; reason++)
        assert_false(is_cause(t, c, (enum lw_verdict)reason));
    assert_true(c->stamp.seq > t->highest[c->stamp.session]); // once, and in order, whoever spoke between
    t->highest[c->stamp.session] = c->stamp.seq;
    const bool other = c->stamp.session != t->owner;
    t->takeovers += other && t->owner != 0;
    t->missed += other ? 0 : c->stamp.seq - t->owner_seq - 1;
    t->taken++;
    t->owner = c->stamp.session;
    t->owner_seq = c->stamp.seq;
    t->owner_ns = t->now_ns;
}

static void arrive(struct traffic *t, struct packet *packet)
{
    const struct lw_joint_command *c = &packet->command;
    struct lw_lease before;
    memcpy(&before, &t->lease, sizeof before);
    const enum lw_verdict verdict = lw_gate_judge(&t->gate, &t->lease, c, t->state_seq, t->now_ns);
    t->verdicts[1 + verdict]++;
    if (verdict == LW_TAKEN) {
        take(t, c);
    } else {
        assert_true(is_cause(t, c, verdict));
        assert_same_bits(&t->lease, &before, sizeof before);
    }
    const struct lw_lease expected = {t->owner, t->owner_seq, t->owner_ns, t->taken, t->missed, t->takeovers};
    assert_same_bits(&t->lease, &expected, sizeof expected);
    packet->due_ns = 0;
}

// One plant period: controllers act, what is due arrives in the order in which it is due.
static void one_period(struct traffic *t)
{
    const int64_t end_ns = t->now_ns + period_ns;
    for (int i = 0; i < CONTROLLERS; i++) {
        come_and_go(t, &t->controller[i]);
        if (t->controller[i].alive)
            send(t, &t->controller[i]);
    }
    for (;;) {
        struct packet *first = NULL;
        for (int i = 0; i < UNDER_WAY; i++) {
            struct packet *p = &t->packet[i];
            if (p->due_ns != 0 && p->due_ns <= end_ns && (first == NULL || p->due_ns < first->due_ns))
                first = p;
        }
        if (first == NULL)
            break;
        t->now_ns = first->due_ns;
        arrive(t, first);
    }
    t->now_ns = end_ns;
    t->state_seq++;
    if (random_below(&t->random, 3000) == 0)
        restart_plant(t);
}

static void no_traffic_gives_two_controllers_one_arm(void **state)
{
    (void)state;
    static struct traffic t;
    int64_t takeovers = 0;
    for (uint64_t seed = 1; seed <= 10; seed++) {
        t = (struct traffic){.random = {seed}, .now_ns = 5000 * ms, .next_session = 1};
        restart_plant(&t);
        for (int k = 0; k < STEPS / 10; k++) {
            const int64_t before = t.takeovers;
            one_period(&t);
            takeovers += t.takeovers > before ? t.takeovers - before : 0;
            assert_true(t.next_session < SESSIONS);
        }
        // Every branch was taken in every run.
        const enum lw_verdict seen[] = {LW_TAKEN,           LW_REFUSED_RANGE,       LW_REFUSED_GUARD,
                                        LW_REFUSED_IDLE,    LW_REFUSED_OTHER_PLANT, LW_REFUSED_STALE,
                                        LW_REFUSED_FOREIGN, LW_REFUSED_DUPLICATE,   LW_REFUSED_BACKWARDS};
        for (size_t i = 0; i < sizeof seen / sizeof seen[0]; i++)
            assert_true(t.verdicts[1 + seen[i]] > 0);
    }
    assert_true(takeovers > 20);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_traffic_gives_two_controllers_one_arm),
    };
    return cmocka_run_group_tests_name("gate_traffic", tests, NULL, NULL);
}
