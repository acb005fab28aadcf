// SPDX-License-Identifier: BSD-3-Clause
// Encoding, decoding and validating joint states, joint commands and requests.
//
// Units    those of lcmtypes/*.lcm.
// Frames   base frame of the arm.
// Arrays   fixed sizes.
// Memory   stack only.
// Errors   see wire.h.
#include "bus/wire_kind.h"

#include <leeway_goal_t.h>
#include <leeway_joint_command_t.h>
#include <leeway_joint_state_t.h>
#include <leeway_stop_t.h>

static const double workspace = 100; // m, positions beyond this are refused
static const double joint_max = 1e6; // rad and rad/s, beyond this no number is meant

// --- joint state ---

static int encode_joint_state(void *data, const union lw_message *message)
{
    const struct lw_joint_state *s = &message->joint_state;
    leeway_joint_state_t w = {.h = lw_wire_from_stamp(&s->stamp),
                              .plant_mode = (int8_t)s->mode,
                              .command_session = s->command_session,
                              .command_seq = s->command_seq,
                              .tick = s->tick,
                              .period_ns = s->period_ns};
    memcpy(w.q, s->q, sizeof w.q);
    memcpy(w.qd, s->qd, sizeof w.qd);
    return leeway_joint_state_t_encode(data, 0, LW_WIRE_MAX, &w);
}

// tick * period_ns is a time of motion: not negative, and it fits. No plant is slower than 1 Hz.
static bool is_time(int64_t tick, int64_t period_ns)
{
    return period_ns > 0 && period_ns <= lw_wire_period_max_ns && tick >= 0 && tick <= INT64_MAX / period_ns;
}

static enum lw_status decode_joint_state(const void *data, int size, union lw_message *message)
{
    leeway_joint_state_t w;
    if (leeway_joint_state_t_decode(data, 0, size, &w) < 0)
        return LW_E_DECODE;
    struct lw_joint_state s = {.stamp = lw_wire_to_stamp(&w.h),
                               .mode = (enum lw_plant_mode)w.plant_mode,
                               .command_session = w.command_session,
                               .command_seq = w.command_seq,
                               .tick = w.tick,
                               .period_ns = w.period_ns};
    memcpy(s.q, w.q, sizeof s.q);
    memcpy(s.qd, w.qd, sizeof s.qd);
    enum lw_status status = lw_wire_check_stamp(&s.stamp);
    if (status == LW_OK && (w.plant_mode < LW_PLANT_HOLD || w.plant_mode > LW_PLANT_ENDED))
        status = LW_E_ARGUMENT;
    if (status == LW_OK && !is_time(w.tick, w.period_ns))
        status = LW_E_ARGUMENT;
    if (status == LW_OK)
        status = lw_wire_check_values(s.q, LW_NJ, joint_max);
    if (status == LW_OK)
        status = lw_wire_check_values(s.qd, LW_NJ, joint_max);
    if (status == LW_OK)
        message->joint_state = s;
    return status;
}

static int size_joint_state(void)
{
    return leeway_joint_state_t_encoded_size(&(leeway_joint_state_t){0});
}

const struct lw_wire_kind lw_wire_joint_state = {size_joint_state, __leeway_joint_state_t_get_hash, encode_joint_state,
                                                 decode_joint_state};

// --- joint command ---

static int encode_joint_command(void *data, const union lw_message *message)
{
    const struct lw_joint_command *c = &message->joint_command;
    leeway_joint_command_t w = {.h = lw_wire_from_stamp(&c->stamp),
                                .plant_session = c->plant_session,
                                .state_seq = c->state_seq,
                                .state_tick = c->state_tick,
                                .state_mono_ns = c->state_mono_ns,
                                .mode = (int8_t)c->mode,
                                .flags = (int32_t)c->flags,
                                .law_outcome = (int8_t)c->law_outcome,
                                .request_session = c->request.session,
                                .request_seq = c->request.seq,
                                .world_channel = (int8_t)c->world_channel,
                                .world_session = c->world.session,
                                .world_seq = c->world.seq,
                                .world_version = c->world_version,
                                .obstacle_count = c->obstacle_count,
                                .deviation = c->deviation,
                                .clearance = c->nearest.clearance,
                                .clearance_link = c->nearest.link,
                                .clearance_obstacle = c->nearest.obstacle,
                                .self_clearance = c->self_clearance,
                                .self_link = {c->self_link[0], c->self_link[1]},
                                .stuck_since_ns = c->stuck_since_ns,
                                .tick = c->tick,
                                .tick_ns = c->tick_ns,
                                .state_age_ns = c->state_age_ns,
                                .input_digest = c->input_digest,
                                .compute_ns = c->compute_ns,
                                .wake_late_ns = c->wake_late_ns,
                                .previous_exec_ns = c->previous_exec_ns,
                                .skipped = c->skipped};
    memcpy(w.qd, c->qd, sizeof w.qd);
    memcpy(w.qd_law, c->qd_law, sizeof w.qd_law);
    memcpy(w.q, c->q, sizeof w.q);
    memcpy(w.goal, c->goal, sizeof w.goal);
    memcpy(w.circulation, c->circulation, sizeof w.circulation);
    return leeway_joint_command_t_encode(data, 0, LW_WIRE_MAX, &w);
}

// Takes what a plant needs; the explanation is for people and logs.
static enum lw_status decode_joint_command(const void *data, int size, union lw_message *message)
{
    leeway_joint_command_t w;
    if (leeway_joint_command_t_decode(data, 0, size, &w) < 0)
        return LW_E_DECODE;
    struct lw_joint_command c = {.stamp = lw_wire_to_stamp(&w.h),
                                 .plant_session = w.plant_session,
                                 .state_seq = w.state_seq,
                                 .state_tick = w.state_tick,
                                 .state_mono_ns = w.state_mono_ns,
                                 .mode = (enum lw_command_mode)w.mode,
                                 .flags = (unsigned)w.flags,
                                 .world = {.session = w.world_session, .seq = w.world_seq},
                                 .world_channel = w.world_channel};
    memcpy(c.qd, w.qd, sizeof c.qd);
    enum lw_status status = lw_wire_check_stamp(&c.stamp);
    if (status == LW_OK && (w.mode < LW_COMMAND_IDLE || w.mode > LW_COMMAND_VELOCITY || w.state_tick < 0))
        status = LW_E_ARGUMENT;
    if (status == LW_OK)
        status = lw_wire_check_values(c.qd, LW_NJ, joint_max);
    if (status == LW_OK)
        message->joint_command = c;
    return status;
}

static int size_joint_command(void)
{
    return leeway_joint_command_t_encoded_size(&(leeway_joint_command_t){0});
}

const struct lw_wire_kind lw_wire_joint_command = {size_joint_command, __leeway_joint_command_t_get_hash,
                                                   encode_joint_command, decode_joint_command};

// --- requests ---

static int encode_goal(void *data, const union lw_message *message)
{
    leeway_goal_t w = {.h = lw_wire_from_stamp(&message->request.stamp)};
    memcpy(w.p, message->request.goal, sizeof w.p);
    return leeway_goal_t_encode(data, 0, LW_WIRE_MAX, &w);
}

static enum lw_status decode_goal(const void *data, int size, union lw_message *message)
{
    leeway_goal_t w;
    if (leeway_goal_t_decode(data, 0, size, &w) < 0)
        return LW_E_DECODE;
    struct lw_request r = {.stamp = lw_wire_to_stamp(&w.h), .kind = LW_REQUEST_GOAL};
    memcpy(r.goal, w.p, sizeof r.goal);
    enum lw_status status = lw_wire_check_stamp(&r.stamp);
    if (status == LW_OK)
        status = lw_wire_check_values(r.goal, 3, workspace);
    if (status == LW_OK)
        message->request = r;
    return status;
}

static int size_goal(void)
{
    return leeway_goal_t_encoded_size(&(leeway_goal_t){0});
}

const struct lw_wire_kind lw_wire_goal = {size_goal, __leeway_goal_t_get_hash, encode_goal, decode_goal};

static int encode_stop(void *data, const union lw_message *message)
{
    const leeway_stop_t w = {.h = lw_wire_from_stamp(&message->request.stamp)};
    return leeway_stop_t_encode(data, 0, LW_WIRE_MAX, &w);
}

static enum lw_status decode_stop(const void *data, int size, union lw_message *message)
{
    leeway_stop_t w;
    if (leeway_stop_t_decode(data, 0, size, &w) < 0)
        return LW_E_DECODE;
    const struct lw_request r = {.stamp = lw_wire_to_stamp(&w.h), .kind = LW_REQUEST_STOP};
    const enum lw_status status = lw_wire_check_stamp(&r.stamp);
    if (status == LW_OK)
        message->request = r;
    return status;
}

static int size_stop(void)
{
    return leeway_stop_t_encoded_size(&(leeway_stop_t){0});
}

const struct lw_wire_kind lw_wire_stop = {size_stop, __leeway_stop_t_get_hash, encode_stop, decode_stop};
