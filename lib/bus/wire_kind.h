// SPDX-License-Identifier: BSD-3-Clause
// Kinds of messages: what wire.c knows of each type, and what their decoders share. For lib/bus alone.
//
// Units    those of lcmtypes/*.lcm.
// Frames   none.
// Arrays   lengths as stated.
// Memory   constants; nothing is allocated.
// Errors   see wire.h.
#ifndef LW_BUS_WIRE_KIND_H
#define LW_BUS_WIRE_KIND_H

#include "base/vec.h" // lw_all_finite
#include "bus/wire.h"

#include <leeway_header_t.h>

#include <math.h>    // fabs
#include <stdbool.h> // bool
#include <string.h>  // memcpy

struct lw_wire_kind {
    int (*size)(void); // bytes, fingerprint included
    int64_t (*fingerprint)(void);
    int (*encode)(void *data, const union lw_message *message); // returns bytes
    enum lw_status (*decode)(const void *data, int size, union lw_message *message);
};

extern const struct lw_wire_kind lw_wire_joint_state, lw_wire_joint_command, lw_wire_goal, lw_wire_stop; // wire_joint.c
extern const struct lw_wire_kind lw_wire_obstacles, lw_wire_hull; // wire_obstacles.c
extern const struct lw_wire_kind lw_wire_status;                  // wire_status.c

// ns, no loop is slower than 1 Hz.
static const int64_t lw_wire_period_max_ns = 1000 * 1000 * 1000;

static inline leeway_header_t lw_wire_from_stamp(const struct lw_stamp *stamp)
{
    return (leeway_header_t){
        .utime = stamp->utime, .mono_ns = stamp->mono_ns, .session = stamp->session, .seq = stamp->seq};
}

static inline struct lw_stamp lw_wire_to_stamp(const leeway_header_t *h)
{
    return (struct lw_stamp){.utime = h->utime, .mono_ns = h->mono_ns, .session = h->session, .seq = h->seq};
}

static inline enum lw_status lw_wire_check_stamp(const struct lw_stamp *stamp)
{
    return stamp->session > 0 && stamp->seq > 0 ? LW_OK : LW_E_ARGUMENT;
}

// Every value is finite and within +- limit.
static inline enum lw_status lw_wire_check_values(const double *values, int n, double limit)
{
    if (!lw_all_finite(values, n))
        return LW_E_NOT_FINITE;
    for (int i = 0; i < n; i++)
        if (fabs(values[i]) > limit)
            return LW_E_ARGUMENT;
    return LW_OK;
}

#endif
