// SPDX-License-Identifier: BSD-3-Clause
// Random valid messages of every channel, extreme values included, and decoding that proves a refusal changes nothing.
//
// Units    those of lcmtypes/*.lcm.
// Frames   base frame.
// Arrays   see bus/wire.h.
// Memory   stack.
// Errors   cmocka's.
#ifndef LW_TESTS_WIRE_MESSAGES_H
#define LW_TESTS_WIRE_MESSAGES_H

#include "bus/wire.h"
#include "helpers.h"

// --- valid messages ---

static inline double extreme(struct random *random, double limit)
{
    const double values[] = {0.0, -0.0, limit, -limit, 5e-324, -1e-310, 1.0 / 3, nextafter(limit, 0)};
    const int pick = random_below(random, 16);
    return pick < 8 ? values[pick] : random_in(random, -limit, limit);
}

static inline int64_t any_int(struct random *random)
{
    const int64_t values[] = {0, 1, -1, INT64_MAX, INT64_MIN};
    const int pick = random_below(random, 10);
    return pick < 5 ? values[pick] : (int64_t)random_bits(random);
}

static inline struct lw_stamp any_stamp(struct random *random)
{
    return (struct lw_stamp){any_int(random), any_int(random), 1 + (int64_t)(random_bits(random) >> 1) / 2,
                             random_below(random, 2) ? 1 : INT64_MAX};
}

static inline void fill(struct random *random, double limit, double *values, int n)
{
    for (int i = 0; i < n; i++)
        values[i] = extreme(random, limit);
}

static inline void make_command(struct random *random, struct lw_joint_command *c)
{
    c->mode = (enum lw_command_mode)random_below(random, 2);
    c->flags = (unsigned)random_below(random, 512);
    c->plant_session = any_int(random);
    c->state_seq = any_int(random);
    c->state_tick = any_int(random) & INT64_MAX;
    c->state_mono_ns = any_int(random);
    c->world = (struct lw_stamp){0, 0, any_int(random), any_int(random)};
    fill(random, 1e6, c->qd, LW_NJ);
}

static inline void make_obstacles(struct random *random, struct lw_obstacle_change *c)
{
    c->op = (enum lw_change_op)random_below(random, 4);
    c->count = random_below(random, LW_CHANGE_MAX + 1);
    for (int i = 0; i < c->count; i++) {
        c->obstacle[i].id = i == 0 ? INT32_MAX : 1 + i;
        if (c->op == LW_REMOVE)
            continue;
        fill(random, 100, c->obstacle[i].p, 3);
        c->obstacle[i].radius = fabs(extreme(random, 100));
    }
}

static inline int64_t any_count(struct random *random)
{
    return any_int(random) & INT64_MAX;
}

static inline void make_report(struct random *random, struct lw_report *r)
{
    int64_t *const counts[] = {&r->ticks, &r->skipped, &r->stale_ticks, &r->unsent,       &r->peer_session,
                               &r->taken, &r->missed,  &r->takeovers,   &r->minor_faults, &r->major_faults};
    r->state = (enum lw_run_state)random_below(random, LW_ENDING + 1);
    r->faults = (unsigned)random_below(random, 64);
    r->faults_ever = r->faults | (unsigned)random_below(random, 64);
    r->realtime = (unsigned)random_below(random, 16);
    r->period_ns = 1 + random_below(random, 1000000000);
    for (size_t i = 0; i < sizeof counts / sizeof counts[0]; i++)
        *counts[i] = any_count(random);
    for (int i = 0; i < LW_REFUSED_COUNT; i++)
        r->refused[i] = any_count(random);
    for (int i = 0; i < LW_PERCENTILES; i++) {
        r->wake_late_ns[i] = any_int(random);
        r->exec_ns[i] = any_int(random);
        r->age_ns[i] = any_int(random);
    }
    r->allocations = random_below(random, 2) ? -1 : any_count(random);
    r->distance = extreme(random, 1e300);
}

// A valid message of a channel; all bytes that no field owns are zero.
static inline union lw_message make(struct random *random, enum lw_channel channel)
{
    union lw_message m;
    memset(&m, 0, sizeof m);
    m.stamp = any_stamp(random);
    switch (channel) {
    case LW_CHANNEL_JOINT_STATE:
        m.joint_state.mode = (enum lw_plant_mode)random_below(random, 4);
        m.joint_state.command_session = any_int(random);
        m.joint_state.command_seq = any_int(random);
        m.joint_state.tick = random_below(random, 1000000);
        m.joint_state.period_ns = 1 + random_below(random, 1000000000);
        fill(random, 1e6, m.joint_state.q, LW_NJ);
        fill(random, 1e6, m.joint_state.qd, LW_NJ);
        break;
    case LW_CHANNEL_JOINT_COMMAND: make_command(random, &m.joint_command); break;
    case LW_CHANNEL_OBSTACLES:
    case LW_CHANNEL_WORLD: make_obstacles(random, &m.obstacles); break;
    case LW_CHANNEL_GOAL: fill(random, 100, m.request.goal, 3); break;
    case LW_CHANNEL_STOP: m.request.kind = LW_REQUEST_STOP; break;
    case LW_CHANNEL_STATUS:
    case LW_CHANNEL_PLANT_STATUS: make_report(random, &m.report); break;
    case LW_CHANNEL_COUNT: break;
    }
    return m;
}

// --- decoding ---

// Decodes over a patterned message: a refusal must leave the pattern.
static inline enum lw_status decode(enum lw_channel channel, const void *data, uint32_t size, union lw_message *out)
{
    union lw_message pattern;
    memset(&pattern, 0x5a, sizeof pattern);
    memcpy(out, &pattern, sizeof pattern);
    const enum lw_status status = lw_wire_decode(channel, data, size, out);
    if (status != LW_OK)
        assert_same_bits(out, &pattern, sizeof pattern);
    return status;
}

static inline void check_message(enum lw_channel channel, const union lw_message *m, enum lw_status expected)
{
    unsigned char data[LW_WIRE_MAX];
    union lw_message out;
    const uint32_t size = lw_wire_encode(channel, m, data);
    assert_int_equal(size, lw_wire_size(channel));
    assert_int_equal(decode(channel, data, size, &out), expected);
}

#endif
