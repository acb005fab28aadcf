// SPDX-License-Identifier: BSD-3-Clause
// Detector of standstill away from the goal.
//
// Units    metres; ns where a name says so.
// Frames   none.
// Arrays   none.
// Memory   see stuck.h.
// Errors   none.
#include "controller/stuck.h"

static const double band = 0.01; // m
static const int64_t sample_ns = 8 * 1000 * 1000, window_ns = 800 * 1000 * 1000;

void lw_stuck_reset(struct lw_stuck *stuck)
{
    stuck->count = 0;
    stuck->since_ns = 0;
}

// Whole periods that a time takes at least.
static int64_t periods_in(int64_t time_ns, int64_t period_ns)
{
    return (time_ns + period_ns - 1) / period_ns;
}

// Whether all samples lie within the band.
static bool is_still(const struct lw_stuck *stuck, int count)
{
    double low = stuck->deviation[0], high = low;
    for (int i = 1; i < count && high - low < band; i++) {
        const double deviation = stuck->deviation[i];
        low = deviation < low ? deviation : low;
        high = deviation > high ? deviation : high;
    }
    return high - low < band;
}

bool lw_stuck_note(struct lw_stuck *stuck, double deviation, double tolerance, const struct lw_stuck_tick *at)
{
    const int64_t every = periods_in(sample_ns, at->period_ns);
    const int length = (int)periods_in(window_ns, every * at->period_ns) + 1; // at most LW_STUCK_SAMPLES
    if (at->number % every != 0)
        return stuck->since_ns != 0;
    stuck->deviation[at->number / every % length] = deviation;
    stuck->count = stuck->count < length ? stuck->count + 1 : length;
    const bool still = stuck->count == length && deviation > tolerance && is_still(stuck, length);
    if (!still)
        stuck->since_ns = 0;
    else if (stuck->since_ns == 0)
        stuck->since_ns = at->time_ns;
    return still;
}
