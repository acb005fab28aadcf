// SPDX-License-Identifier: BSD-3-Clause
// Verdict: whether a message is taken, and if not, why (status_t.refused on the wire).
//
// Units    none.
// Frames   none.
// Arrays   none.
// Memory   none.
// Errors   none.
#ifndef LW_BASE_VERDICT_H
#define LW_BASE_VERDICT_H

#include "base/status.h" // enum lw_status

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
    LW_REFUSED_UNKNOWN,
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
    case LW_E_UNKNOWN: return LW_REFUSED_UNKNOWN;
    default: return LW_REFUSED_TYPE;
    }
}

#endif
