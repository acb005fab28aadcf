// SPDX-License-Identifier: BSD-3-Clause
// What every message that lw_wire_decode accepts promises, whoever sent it.
//
// Units    those of lcmtypes/*.lcm.
// Frames   base frame.
// Arrays   see bus/wire.h.
// Memory   none.
// Errors   false.
#ifndef LW_TESTS_WIRE_RANGES_H
#define LW_TESTS_WIRE_RANGES_H

#include "base/vec.h" // lw_all_finite
#include "bus/wire.h"

#include <math.h>    // fabs, sqrt
#include <stdbool.h> // bool
#include <stddef.h>  // size_t

static inline bool within(const double *values, int n, double limit)
{
    bool ok = lw_all_finite(values, n);
    for (int i = 0; i < n; i++)
        ok = ok && fabs(values[i]) <= limit;
    return ok;
}

// Sizes are those of the shape, and what it does not have is 0.
static inline bool sizes_keep_their_ranges(const struct lw_obstacle *o)
{
    const int sizes = o->shape == LW_BOX ? 3 : o->shape == LW_CAPSULE ? 1 : 0;
    bool ok = within(o->size, 3, 100) && within(&o->radius, 1, 100) && o->radius >= 0;
    for (int i = 0; i < 3; i++)
        ok = ok && (i >= sizes ? o->size[i] == 0 : o->size[i] > 0 || (o->size[i] == 0 && o->shape == LW_CAPSULE));
    return ok && (o->shape != LW_HALFSPACE || o->radius == 0);
}

static inline bool obstacle_keeps_its_ranges(const struct lw_obstacle *o)
{
    double square = 0;
    for (int i = 0; i < 4; i++)
        square += o->quat[i] * o->quat[i];
    return o->id > 0 && (unsigned)o->shape <= LW_HALFSPACE && within(o->p, 3, 100) && within(o->v, 3, 100) &&
           within(o->omega, 3, 100) && fabs(sqrt(square) - 1) <= 1.001e-3 && sizes_keep_their_ranges(o);
}

static inline bool times_keep_their_ranges(const struct lw_obstacle_change *c)
{
    return c->time_ns >= 0 && c->valid_for_ms >= 0 && (c->valid_for_ms == 0 || c->time_ns > 0) &&
           c->time_ns <= INT64_MAX - INT64_C(1000000) * c->valid_for_ms;
}

static inline bool obstacles_keep_their_ranges(const struct lw_obstacle_change *c)
{
    bool ok = c->count >= 0 && c->count <= LW_CHANGE_MAX && (unsigned)c->op <= LW_CLEAR && times_keep_their_ranges(c);
    for (int i = 0; ok && i < c->count; i++) {
        const struct lw_obstacle *o = &c->obstacle[i];
        ok = o->id > 0 && (c->op == LW_REMOVE || obstacle_keeps_its_ranges(o));
        for (int k = 0; k < i; k++)
            ok = ok && c->obstacle[k].id != o->id;
    }
    return ok && c->vertex_count == 0;
}

static inline bool hull_keeps_its_ranges(const struct lw_obstacle_change *c)
{
    return c->op == LW_UPSERT && c->count == 1 && c->obstacle[0].shape == LW_HULL && times_keep_their_ranges(c) &&
           obstacle_keeps_its_ranges(&c->obstacle[0]) && c->vertex_count >= 1 && c->vertex_count <= LW_HULL_MAX &&
           within(c->vertex, 3 * c->vertex_count, 100);
}

static inline bool state_keeps_its_ranges(const struct lw_joint_state *s)
{
    return within(s->q, LW_NJ, 1e6) && within(s->qd, LW_NJ, 1e6) && (unsigned)s->mode <= LW_PLANT_ENDED &&
           s->period_ns > 0 && s->period_ns <= 1000000000 && s->tick >= 0 && s->tick <= INT64_MAX / s->period_ns;
}

static inline bool command_keeps_its_ranges(const struct lw_joint_command *c)
{
    return c->state_tick >= 0 && within(c->qd, LW_NJ, 1e6) && (unsigned)c->mode <= LW_COMMAND_VELOCITY;
}

static inline bool request_keeps_its_ranges(enum lw_request_kind kind, const struct lw_request *r)
{
    return r->kind == kind && (kind == LW_REQUEST_STOP || within(r->goal, 3, 100));
}

static inline bool report_keeps_its_ranges(const struct lw_report *r)
{
    const int64_t counts[] = {r->ticks, r->skipped, r->stale_ticks, r->unsent,       r->peer_session,
                              r->taken, r->missed,  r->takeovers,   r->minor_faults, r->major_faults};
    bool ok = (unsigned)r->state <= LW_ENDING && r->period_ns > 0 && r->period_ns <= 1000000000;
    ok = ok && r->allocations >= -1 && (lw_all_finite(&r->clearance, 1) || r->clearance > 0);
    ok = ok && lw_all_finite(&r->deviation, 1) && r->stuck_since_ns >= 0 && r->obstacle_count >= 0 &&
         r->world_age_ns >= -1;
    for (size_t i = 0; i < sizeof counts / sizeof counts[0]; i++)
        ok = ok && counts[i] >= 0;
    for (int i = 0; i < LW_REFUSED_COUNT; i++)
        ok = ok && r->refused[i] >= 0;
    return ok;
}

static inline bool values_keep_their_ranges(enum lw_channel channel, const union lw_message *m)
{
    switch (channel) {
    case LW_CHANNEL_JOINT_STATE: return state_keeps_its_ranges(&m->joint_state);
    case LW_CHANNEL_JOINT_COMMAND: return command_keeps_its_ranges(&m->joint_command);
    case LW_CHANNEL_OBSTACLES:
    case LW_CHANNEL_WORLD: return obstacles_keep_their_ranges(&m->obstacles);
    case LW_CHANNEL_HULL:
    case LW_CHANNEL_WORLD_HULL: return hull_keeps_its_ranges(&m->obstacles);
    case LW_CHANNEL_GOAL: return request_keeps_its_ranges(LW_REQUEST_GOAL, &m->request);
    case LW_CHANNEL_STOP: return request_keeps_its_ranges(LW_REQUEST_STOP, &m->request);
    case LW_CHANNEL_STATUS:
    case LW_CHANNEL_PLANT_STATUS: return report_keeps_its_ranges(&m->report);
    case LW_CHANNEL_COUNT: break;
    }
    return false;
}

static inline bool keeps_its_ranges(enum lw_channel channel, const union lw_message *m)
{
    return m->stamp.session > 0 && m->stamp.seq > 0 && values_keep_their_ranges(channel, m);
}

#endif
