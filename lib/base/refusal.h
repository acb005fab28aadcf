// SPDX-License-Identifier: BSD-3-Clause
// Refusals: why a message was not taken, counted by reason (status_t.refused on the wire).
//
// Units    counts.
// Frames   none.
// Arrays   one counter a reason.
// Memory   plain data; counters may be raised by any thread.
// Errors   none.
#ifndef LW_BASE_REFUSAL_H
#define LW_BASE_REFUSAL_H

#include "base/status.h" // enum lw_status

#include <stdatomic.h> // atomic_int_fast64_t
#include <stdbool.h>   // bool
#include <stdint.h>    // int64_t

// Numbers are those of lcmtypes/status_t.lcm, which says what each means.
enum lw_verdict {
    LW_TAKEN = -1,
    LW_REFUSED_SIZE,
    LW_REFUSED_TYPE,
    LW_REFUSED_NO_NUMBER,
    LW_REFUSED_RANGE,
    LW_REFUSED_DUPLICATE,
    LW_REFUSED_BACKWARDS,
    LW_REFUSED_FOREIGN,
    LW_REFUSED_OTHER_PLANT,
    LW_REFUSED_STALE,
    LW_REFUSED_GUARD,
    LW_REFUSED_IDLE,
    LW_REFUSED_FULL,
    LW_REFUSED_COUNT
};

// The verdict that goes with the status of decoding or merging a message.
static inline enum lw_verdict lw_verdict_of(enum lw_status status)
{
    switch (status) {
    case LW_OK: return LW_TAKEN;
    case LW_E_SIZE: return LW_REFUSED_SIZE;
    case LW_E_NOT_FINITE: return LW_REFUSED_NO_NUMBER;
    case LW_E_ARGUMENT: return LW_REFUSED_RANGE;
    case LW_E_OLD: return LW_REFUSED_BACKWARDS;
    case LW_E_FULL: return LW_REFUSED_FULL;
    default: return LW_REFUSED_TYPE;
    }
}

struct lw_refusals {
    atomic_int_fast64_t count[LW_REFUSED_COUNT];
};

// Counts a verdict; LW_TAKEN is none. Returns whether the message was taken.
static inline bool lw_refusals_note(struct lw_refusals *refusals, enum lw_verdict verdict)
{
    if (verdict == LW_TAKEN)
        return true;
    atomic_fetch_add_explicit(&refusals->count[verdict], 1, memory_order_relaxed);
    return false;
}

static inline int64_t lw_refusals_of(const struct lw_refusals *refusals, enum lw_verdict reason)
{
    return atomic_load_explicit(&refusals->count[reason], memory_order_relaxed);
}

static inline int64_t lw_refusals_total(const struct lw_refusals *refusals)
{
    int64_t total = 0;
    for (int reason = 0; reason < LW_REFUSED_COUNT; reason++)
        total += lw_refusals_of(refusals, (enum lw_verdict)reason);
    return total;
}

#endif
