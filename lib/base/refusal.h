// SPDX-License-Identifier: BSD-3-Clause
// Refusals: messages that were not taken, counted by reason.
//
// Units    counts.
// Frames   none.
// Arrays   one counter a reason.
// Memory   plain data; counters may be raised by any thread.
// Errors   none.
#ifndef LW_BASE_REFUSAL_H
#define LW_BASE_REFUSAL_H

#include "base/verdict.h" // enum lw_verdict

#include <stdatomic.h> // atomic_int_fast64_t
#include <stdbool.h>   // bool
#include <stdint.h>    // int64_t

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
