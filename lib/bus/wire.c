// SPDX-License-Identifier: BSD-3-Clause
// Encoding, decoding and validating every message, one table row a channel.
//
// Units    those of lcmtypes/*.lcm.
// Frames   base frame of the arm.
// Arrays   fixed sizes.
// Memory   stack only.
// Errors   see wire.h.
#include "bus/wire.h"

#include "base/vec.h" // lw_all_finite

#include <leeway_goal_t.h>
#include <leeway_joint_command_t.h>
#include <leeway_joint_state_t.h>
#include <leeway_obstacles_t.h>
#include <leeway_status_t.h>
#include <leeway_stop_t.h>

#include <stdbool.h> // bool
#include <string.h>  // memcpy

static const double workspace = 100; // m, positions beyond this are refused
static const double joint_max = 1e6; // rad and rad/s, beyond this no number is meant
static const int64_t period_max_ns = 1000 * 1000 * 1000;

// --- stamp ---

static leeway_header_t stamp_to_wire(const struct lw_stamp *stamp)
{
    return (leeway_header_t){
        .utime = stamp->utime, .mono_ns = stamp->mono_ns, .session = stamp->session, .seq = stamp->seq};
}

static struct lw_stamp stamp_from_wire(const leeway_header_t *h)
{
    return (struct lw_stamp){.utime = h->utime, .mono_ns = h->mono_ns, .session = h->session, .seq = h->seq};
}

static enum lw_status check_stamp(const struct lw_stamp *stamp)
{
    return stamp->session > 0 && stamp->seq > 0 ? LW_OK : LW_E_ARGUMENT;
}

static enum lw_status check_values(const double *values, int n, double limit)
{
    if (!lw_all_finite(values, n))
        return LW_E_NOT_FINITE;
    for (int i = 0; i < n; i++)
        if (fabs(values[i]) > limit)
            return LW_E_ARGUMENT;
    return LW_OK;
}

// --- joint state ---

static int encode_joint_state(void *data, const union lw_message *message)
{
    const struct lw_joint_state *s = &message->joint_state;
    leeway_joint_state_t w = {.h = stamp_to_wire(&s->stamp),
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
    return period_ns > 0 && period_ns <= period_max_ns && tick >= 0 && tick <= INT64_MAX / period_ns;
}

static enum lw_status decode_joint_state(const void *data, int size, union lw_message *message)
{
    leeway_joint_state_t w;
    if (leeway_joint_state_t_decode(data, 0, size, &w) < 0)
        return LW_E_DECODE;
    struct lw_joint_state s = {.stamp = stamp_from_wire(&w.h),
                               .mode = (enum lw_plant_mode)w.plant_mode,
                               .command_session = w.command_session,
                               .command_seq = w.command_seq,
                               .tick = w.tick,
                               .period_ns = w.period_ns};
    memcpy(s.q, w.q, sizeof s.q);
    memcpy(s.qd, w.qd, sizeof s.qd);
    enum lw_status status = check_stamp(&s.stamp);
    if (status == LW_OK && (w.plant_mode < LW_PLANT_HOLD || w.plant_mode > LW_PLANT_ENDED))
        status = LW_E_ARGUMENT;
    if (status == LW_OK && !is_time(w.tick, w.period_ns))
        status = LW_E_ARGUMENT;
    if (status == LW_OK)
        status = check_values(s.q, LW_NJ, joint_max);
    if (status == LW_OK)
        status = check_values(s.qd, LW_NJ, joint_max);
    if (status == LW_OK)
        message->joint_state = s;
    return status;
}

// --- joint command ---

static int encode_joint_command(void *data, const union lw_message *message)
{
    const struct lw_joint_command *c = &message->joint_command;
    leeway_joint_command_t w = {.h = stamp_to_wire(&c->stamp),
                                .plant_session = c->plant_session,
                                .state_seq = c->state_seq,
                                .state_tick = c->state_tick,
                                .state_mono_ns = c->state_mono_ns,
                                .mode = (int8_t)c->mode,
                                .flags = (int32_t)c->flags,
                                .law_outcome = (int8_t)c->law_outcome,
                                .request_session = c->request.session,
                                .request_seq = c->request.seq,
                                .world_session = c->world.session,
                                .world_seq = c->world.seq,
                                .world_version = c->world_version,
                                .obstacle_count = c->obstacle_count,
                                .deviation = c->deviation,
                                .distance = c->nearest.distance,
                                .distance_point = c->nearest.point,
                                .distance_obstacle = c->nearest.obstacle,
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
    return leeway_joint_command_t_encode(data, 0, LW_WIRE_MAX, &w);
}

// Takes what a plant needs; the explanation is for people and logs.
static enum lw_status decode_joint_command(const void *data, int size, union lw_message *message)
{
    leeway_joint_command_t w;
    if (leeway_joint_command_t_decode(data, 0, size, &w) < 0)
        return LW_E_DECODE;
    struct lw_joint_command c = {.stamp = stamp_from_wire(&w.h),
                                 .plant_session = w.plant_session,
                                 .state_seq = w.state_seq,
                                 .state_tick = w.state_tick,
                                 .state_mono_ns = w.state_mono_ns,
                                 .mode = (enum lw_command_mode)w.mode,
                                 .flags = (unsigned)w.flags,
                                 .world = {.session = w.world_session, .seq = w.world_seq}};
    memcpy(c.qd, w.qd, sizeof c.qd);
    enum lw_status status = check_stamp(&c.stamp);
    if (status == LW_OK && (w.mode < LW_COMMAND_IDLE || w.mode > LW_COMMAND_VELOCITY || w.state_tick < 0))
        status = LW_E_ARGUMENT;
    if (status == LW_OK)
        status = check_values(c.qd, LW_NJ, joint_max);
    if (status == LW_OK)
        message->joint_command = c;
    return status;
}

// --- obstacles ---

static int encode_obstacles(void *data, const union lw_message *message)
{
    const struct lw_obstacle_change *c = &message->obstacles;
    leeway_obstacles_t w = {.h = stamp_to_wire(&c->stamp), .op = (int8_t)c->op, .n = c->count};
    for (int i = 0; i < c->count; i++) {
        w.o[i].id = c->obstacle[i].id;
        w.o[i].radius = c->obstacle[i].radius;
        memcpy(w.o[i].p, c->obstacle[i].p, sizeof w.o[i].p);
    }
    return leeway_obstacles_t_encode(data, 0, LW_WIRE_MAX, &w);
}

static enum lw_status read_obstacle(const leeway_obstacle_t *w, enum lw_change_op op, struct lw_obstacle *o)
{
    if (w->id <= 0)
        return LW_E_ARGUMENT;
    *o = (struct lw_obstacle){.id = w->id};
    if (op == LW_REMOVE)
        return LW_OK;
    memcpy(o->p, w->p, sizeof o->p);
    o->radius = w->radius;
    enum lw_status status = check_values(o->p, 3, workspace);
    if (status == LW_OK)
        status = check_values(&o->radius, 1, workspace);
    return status == LW_OK && o->radius < 0 ? LW_E_ARGUMENT : status;
}

static enum lw_status check_unique_ids(const struct lw_obstacle_change *c)
{
    for (int i = 0; i < c->count; i++)
        for (int k = 0; k < i; k++)
            if (c->obstacle[i].id == c->obstacle[k].id)
                return LW_E_ARGUMENT;
    return LW_OK;
}

static enum lw_status decode_obstacles(const void *data, int size, union lw_message *message)
{
    leeway_obstacles_t w;
    if (leeway_obstacles_t_decode(data, 0, size, &w) < 0)
        return LW_E_DECODE;
    if (w.op < LW_UPSERT || w.op > LW_CLEAR || w.n < 0 || w.n > LW_CHANGE_MAX)
        return LW_E_ARGUMENT;
    struct lw_obstacle_change c = {.stamp = stamp_from_wire(&w.h), .op = (enum lw_change_op)w.op, .count = w.n};
    enum lw_status status = check_stamp(&c.stamp);
    for (int i = 0; status == LW_OK && i < w.n; i++)
        status = read_obstacle(&w.o[i], c.op, &c.obstacle[i]);
    if (status == LW_OK)
        status = check_unique_ids(&c);
    if (status == LW_OK)
        message->obstacles = c;
    return status;
}

// --- requests ---

static int encode_goal(void *data, const union lw_message *message)
{
    leeway_goal_t w = {.h = stamp_to_wire(&message->request.stamp)};
    memcpy(w.p, message->request.goal, sizeof w.p);
    return leeway_goal_t_encode(data, 0, LW_WIRE_MAX, &w);
}

static enum lw_status decode_goal(const void *data, int size, union lw_message *message)
{
    leeway_goal_t w;
    if (leeway_goal_t_decode(data, 0, size, &w) < 0)
        return LW_E_DECODE;
    struct lw_request r = {.stamp = stamp_from_wire(&w.h), .kind = LW_REQUEST_GOAL};
    memcpy(r.goal, w.p, sizeof r.goal);
    enum lw_status status = check_stamp(&r.stamp);
    if (status == LW_OK)
        status = check_values(r.goal, 3, workspace);
    if (status == LW_OK)
        message->request = r;
    return status;
}

static int encode_stop(void *data, const union lw_message *message)
{
    const leeway_stop_t w = {.h = stamp_to_wire(&message->request.stamp)};
    return leeway_stop_t_encode(data, 0, LW_WIRE_MAX, &w);
}

static enum lw_status decode_stop(const void *data, int size, union lw_message *message)
{
    leeway_stop_t w;
    if (leeway_stop_t_decode(data, 0, size, &w) < 0)
        return LW_E_DECODE;
    const struct lw_request r = {.stamp = stamp_from_wire(&w.h), .kind = LW_REQUEST_STOP};
    const enum lw_status status = check_stamp(&r.stamp);
    if (status == LW_OK)
        message->request = r;
    return status;
}

// --- status ---

static int encode_status(void *data, const union lw_message *message)
{
    const struct lw_report *r = &message->report;
    leeway_status_t w = {.h = stamp_to_wire(&r->stamp),
                         .state = (int8_t)r->state,
                         .faults = (int32_t)r->faults,
                         .faults_ever = (int32_t)r->faults_ever,
                         .realtime = (int32_t)r->realtime,
                         .period_ns = r->period_ns,
                         .ticks = r->ticks,
                         .skipped = r->skipped,
                         .stale_ticks = r->stale_ticks,
                         .unsent = r->unsent,
                         .peer_session = r->peer_session,
                         .taken = r->taken,
                         .missed = r->missed,
                         .takeovers = r->takeovers,
                         .minor_faults = r->minor_faults,
                         .major_faults = r->major_faults,
                         .allocations = r->allocations,
                         .distance = r->distance};
    memcpy(w.refused, r->refused, sizeof r->refused);
    memcpy(w.wake_late_ns, r->wake_late_ns, sizeof w.wake_late_ns);
    memcpy(w.exec_ns, r->exec_ns, sizeof w.exec_ns);
    memcpy(w.age_ns, r->age_ns, sizeof w.age_ns);
    return leeway_status_t_encode(data, 0, LW_WIRE_MAX, &w);
}

static bool none_negative(const int64_t *counts, int n)
{
    for (int i = 0; i < n; i++)
        if (counts[i] < 0)
            return false;
    return true;
}

static bool is_report(const leeway_status_t *w)
{
    const int64_t counts[] = {w->ticks, w->skipped, w->stale_ticks, w->unsent,       w->peer_session,
                              w->taken, w->missed,  w->takeovers,   w->minor_faults, w->major_faults};
    return w->state >= LW_STARTING && w->state <= LW_ENDING && w->period_ns > 0 && w->period_ns <= period_max_ns &&
           none_negative(counts, (int)(sizeof counts / sizeof counts[0])) &&
           none_negative(w->refused, LEEWAY_STATUS_T_NREASONS) && w->allocations >= -1; // -1 = cannot count
}

static struct lw_report report_from_wire(const leeway_status_t *w)
{
    struct lw_report r = {.stamp = stamp_from_wire(&w->h),
                          .state = (enum lw_run_state)w->state,
                          .faults = (unsigned)w->faults,
                          .faults_ever = (unsigned)w->faults_ever,
                          .realtime = (unsigned)w->realtime,
                          .period_ns = w->period_ns,
                          .ticks = w->ticks,
                          .skipped = w->skipped,
                          .stale_ticks = w->stale_ticks,
                          .unsent = w->unsent,
                          .peer_session = w->peer_session,
                          .taken = w->taken,
                          .missed = w->missed,
                          .takeovers = w->takeovers,
                          .minor_faults = w->minor_faults,
                          .major_faults = w->major_faults,
                          .allocations = w->allocations,
                          .distance = w->distance};
    memcpy(r.refused, w->refused, sizeof r.refused);
    memcpy(r.wake_late_ns, w->wake_late_ns, sizeof r.wake_late_ns);
    memcpy(r.exec_ns, w->exec_ns, sizeof r.exec_ns);
    memcpy(r.age_ns, w->age_ns, sizeof r.age_ns);
    return r;
}

static enum lw_status decode_status(const void *data, int size, union lw_message *message)
{
    leeway_status_t w;
    if (leeway_status_t_decode(data, 0, size, &w) < 0)
        return LW_E_DECODE;
    const struct lw_report r = report_from_wire(&w);
    enum lw_status status = check_stamp(&r.stamp);
    if (status == LW_OK && !is_report(&w))
        status = LW_E_ARGUMENT;
    if (status == LW_OK && !lw_all_finite(&w.distance, 1))
        status = LW_E_NOT_FINITE;
    if (status == LW_OK)
        message->report = r;
    return status;
}

// --- the table ---

static int size_joint_state(void)
{
    return leeway_joint_state_t_encoded_size(&(leeway_joint_state_t){0});
}
static int size_joint_command(void)
{
    return leeway_joint_command_t_encoded_size(&(leeway_joint_command_t){0});
}
static int size_obstacles(void)
{
    return leeway_obstacles_t_encoded_size(&(leeway_obstacles_t){0});
}
static int size_goal(void)
{
    return leeway_goal_t_encoded_size(&(leeway_goal_t){0});
}
static int size_stop(void)
{
    return leeway_stop_t_encoded_size(&(leeway_stop_t){0});
}
static int size_status(void)
{
    return leeway_status_t_encoded_size(&(leeway_status_t){0});
}

static const struct wire_row {
    const char *name;
    int (*size)(void);
    int64_t (*fingerprint)(void);
    int (*encode)(void *data, const union lw_message *message);
    enum lw_status (*decode)(const void *data, int size, union lw_message *message);
} rows[LW_CHANNEL_COUNT] = {
    [LW_CHANNEL_JOINT_STATE] = {"JOINT_STATE", size_joint_state, __leeway_joint_state_t_get_hash, encode_joint_state,
                                decode_joint_state},
    [LW_CHANNEL_JOINT_COMMAND] = {"JOINT_COMMAND", size_joint_command, __leeway_joint_command_t_get_hash,
                                  encode_joint_command, decode_joint_command},
    [LW_CHANNEL_OBSTACLES] = {"OBSTACLES", size_obstacles, __leeway_obstacles_t_get_hash, encode_obstacles,
                              decode_obstacles},
    [LW_CHANNEL_GOAL] = {"GOAL", size_goal, __leeway_goal_t_get_hash, encode_goal, decode_goal},
    [LW_CHANNEL_STOP] = {"STOP", size_stop, __leeway_stop_t_get_hash, encode_stop, decode_stop},
    [LW_CHANNEL_WORLD] = {"WORLD", size_obstacles, __leeway_obstacles_t_get_hash, encode_obstacles, decode_obstacles},
    [LW_CHANNEL_STATUS] = {"STATUS", size_status, __leeway_status_t_get_hash, encode_status, decode_status},
    [LW_CHANNEL_PLANT_STATUS] = {"PLANT_STATUS", size_status, __leeway_status_t_get_hash, encode_status, decode_status},
};

const char *lw_wire_channel_name(enum lw_channel channel)
{
    return rows[channel].name;
}

uint32_t lw_wire_size(enum lw_channel channel)
{
    return (uint32_t)rows[channel].size();
}

int64_t lw_wire_fingerprint(enum lw_channel channel)
{
    return rows[channel].fingerprint();
}

enum lw_status lw_wire_decode(enum lw_channel channel, const void *data, uint32_t size, union lw_message *message)
{
    // Size before decode: a packet without a channel name arrives with a size near 2^32.
    if (size != lw_wire_size(channel))
        return LW_E_SIZE;
    return rows[channel].decode(data, (int)size, message);
}

uint32_t lw_wire_encode(enum lw_channel channel, const union lw_message *message, void *data)
{
    return (uint32_t)rows[channel].encode(data, message);
}
