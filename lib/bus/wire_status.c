// SPDX-License-Identifier: BSD-3-Clause
// Encoding, decoding and validating what programs say of themselves.
//
// Units    those of lcmtypes/*.lcm.
// Frames   base frame of the arm.
// Arrays   fixed sizes.
// Memory   stack only.
// Errors   see wire.h.
#include "bus/wire_kind.h"

#include <leeway_status_t.h>

static int encode_status(void *data, const union lw_message *message)
{
    const struct lw_report *r = &message->report;
    leeway_status_t w = {.h = lw_wire_from_stamp(&r->stamp),
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
                         .clearance = r->clearance,
                         .deviation = r->deviation,
                         .stuck_since_ns = r->stuck_since_ns,
                         .obstacle_count = (int32_t)r->obstacle_count,
                         .world_age_ns = r->world_age_ns};
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
    const int64_t counts[] = {w->ticks,        w->skipped,      w->stale_ticks,    w->unsent,
                              w->peer_session, w->taken,        w->missed,         w->takeovers,
                              w->minor_faults, w->major_faults, w->stuck_since_ns, w->obstacle_count};
    return w->state >= LW_STARTING && w->state <= LW_ENDING && w->period_ns > 0 &&
           w->period_ns <= lw_wire_period_max_ns && none_negative(counts, (int)(sizeof counts / sizeof counts[0])) &&
           none_negative(w->refused, LEEWAY_STATUS_T_NREASONS) && w->allocations >= -1 &&
           w->world_age_ns >= -1; // -1 = cannot count, none heard
}

static struct lw_report report_from_wire(const leeway_status_t *w)
{
    struct lw_report r = {.stamp = lw_wire_to_stamp(&w->h),
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
                          .clearance = w->clearance,
                          .deviation = w->deviation,
                          .stuck_since_ns = w->stuck_since_ns,
                          .obstacle_count = w->obstacle_count,
                          .world_age_ns = w->world_age_ns};
    memcpy(r.refused, w->refused, sizeof r.refused);
    memcpy(r.wake_late_ns, w->wake_late_ns, sizeof r.wake_late_ns);
    memcpy(r.exec_ns, w->exec_ns, sizeof r.exec_ns);
    memcpy(r.age_ns, w->age_ns, sizeof r.age_ns);
    return r;
}

// Infinite when there is no obstacle.
static bool is_clearance(double clearance)
{
    return isfinite(clearance) || clearance > 0;
}

static enum lw_status decode_status(const void *data, int size, union lw_message *message)
{
    leeway_status_t w;
    if (leeway_status_t_decode(data, 0, size, &w) < 0)
        return LW_E_DECODE;
    const struct lw_report r = report_from_wire(&w);
    enum lw_status status = lw_wire_check_stamp(&r.stamp);
    if (status == LW_OK && !is_report(&w))
        status = LW_E_ARGUMENT;
    if (status == LW_OK && !(is_clearance(w.clearance) && isfinite(w.deviation)))
        status = LW_E_NOT_FINITE;
    if (status == LW_OK)
        message->report = r;
    return status;
}

static int size_status(void)
{
    return leeway_status_t_encoded_size(&(leeway_status_t){0});
}

const struct lw_wire_kind lw_wire_status = {size_status, __leeway_status_t_get_hash, encode_status, decode_status};
