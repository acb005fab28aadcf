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
    c->flags = (unsigned)random_below(random, 2048);
    c->plant_session = any_int(random);
    c->state_seq = any_int(random);
    c->state_tick = any_int(random) & INT64_MAX;
    c->state_mono_ns = any_int(random);
    c->world = (struct lw_stamp){0, 0, any_int(random), any_int(random)};
    c->world_channel = random_below(random, 3);
    fill(random, 1e6, c->qd, LW_NJ);
}

// A unit quaternion, off 1 by no more than a receiver takes.
static inline void any_quaternion(struct random *random, double quat[4])
{
    double square = 0;
    random_fill(random, -1, 1, quat, 4);
    quat[random_below(random, 4)] += 2;
    for (int i = 0; i < 4; i++)
        square += quat[i] * quat[i];
    const double scale = random_in(random, 0.9991, 1.0009) / sqrt(square);
    for (int i = 0; i < 4; i++)
        quat[i] *= scale;
}

// A valid obstacle; values that its shape does not have are 0.
static inline struct lw_obstacle any_obstacle(struct random *random, int id, enum lw_shape_kind shape)
{
    struct lw_obstacle o = {.id = id, .shape = shape};
    const int sizes = shape == LW_BOX ? 3 : shape == LW_CAPSULE ? 1 : 0;
    fill(random, 100, o.p, 3);
    any_quaternion(random, o.quat);
    if (shape != LW_HALFSPACE)
        o.radius = fabs(extreme(random, 100));
    for (int i = 0; i < sizes; i++)
        o.size[i] = fmax(fabs(extreme(random, 100)), shape == LW_BOX ? 5e-324 : 0);
    fill(random, 100, o.v, 3);
    fill(random, 100, o.omega, 3);
    return o;
}

static inline void any_times(struct random *random, struct lw_obstacle_change *c)
{
    c->owner = any_int(random);
    c->time_ns = random_below(random, 3) ? (any_int(random) & INT64_MAX) / 2 : 0;
    if (c->time_ns > 0)
        c->valid_for_ms = random_below(random, 2) ? INT32_MAX : random_below(random, 1000);
}

static inline void make_obstacles(struct random *random, struct lw_obstacle_change *c)
{
    any_times(random, c);
    c->op = (enum lw_change_op)random_below(random, 4);
    c->count = random_below(random, LW_CHANGE_MAX + 1);
    for (int i = 0; i < c->count; i++) {
        const int id = i == 0 ? INT32_MAX : 1 + i;
        if (c->op == LW_REMOVE)
            c->obstacle[i].id = id;
        else
            c->obstacle[i] = any_obstacle(random, id, (enum lw_shape_kind)random_below(random, LW_HALFSPACE + 1));
    }
}

static inline void make_hull(struct random *random, struct lw_obstacle_change *c)
{
    any_times(random, c);
    c->count = 1;
    c->obstacle[0] = any_obstacle(random, 1 + random_below(random, INT32_MAX), LW_HULL);
    c->vertex_count = 1 + random_below(random, LW_HULL_MAX);
    fill(random, 100, c->vertex, 3 * c->vertex_count);
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
    r->clearance = random_below(random, 4) ? extreme(random, 1e300) : HUGE_VAL;
    r->deviation = extreme(random, 1e300);
    r->stuck_since_ns = any_count(random);
    r->obstacle_count = random_below(random, INT32_MAX);
    r->world_age_ns = random_below(random, 2) ? -1 : any_count(random);
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
    case LW_CHANNEL_HULL:
    case LW_CHANNEL_WORLD_HULL: make_hull(random, &m.obstacles); break;
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

// Puts each bad value in place of a double of a valid message: beyond a limit, and no number.
static inline void check_double(enum lw_channel channel, const union lw_message *m, double *place, double limit)
{
    const double before = *place;
    const double out_of_range[] = {nextafter(limit, 1e9), -nextafter(limit, 1e9), 1e9, -1.7e308};
    const double no_number[] = {NO_NUMBER, -NO_NUMBER, HUGE_VAL, -HUGE_VAL};
    for (int i = 0; i < 4; i++) {
        *place = out_of_range[i];
        check_message(channel, m, LW_E_ARGUMENT);
        *place = no_number[i];
        check_message(channel, m, LW_E_NOT_FINITE);
    }
    *place = before;
    check_message(channel, m, LW_OK);
}

#endif
