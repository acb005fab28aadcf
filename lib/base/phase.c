// SPDX-License-Identifier: BSD-3-Clause
// Median-filtered proportional phase lock.
//
// Units    ns.
// Frames   none.
// Arrays   none.
// Memory   the caller's.
// Errors   none.
#include "base/phase.h"

// An error is half a period at most, so a correction is 1 % of a period at most.
enum { GAIN_DIVISOR = 50 };

// Remainder within half a period either way.
static int64_t wrap(int64_t value, int64_t period)
{
    const int64_t turned = (value + period / 2) % period;
    return (turned < 0 ? turned + period : turned) - period / 2;
}

static int64_t median(const int64_t values[LW_PHASE_SAMPLES])
{
    int64_t sorted[LW_PHASE_SAMPLES];
    for (int i = 0; i < LW_PHASE_SAMPLES; i++) {
        int k = i;
        for (; k > 0 && sorted[k - 1] > values[i]; k--)
            sorted[k] = sorted[k - 1];
        sorted[k] = values[i];
    }
    return sorted[LW_PHASE_SAMPLES / 2];
}

int64_t lw_phase_correct(struct lw_phase *phase, int64_t deadline_ns, int64_t arrival_ns, int64_t period_ns, bool jump)
{
    phase->error_ns[phase->next] = wrap(deadline_ns - arrival_ns - period_ns / 2, period_ns);
    phase->next = (phase->next + 1) % LW_PHASE_SAMPLES;
    if (phase->count < LW_PHASE_SAMPLES)
        phase->count++;
    if (phase->count < LW_PHASE_SAMPLES)
        return 0;
    const int64_t error = median(phase->error_ns);
    if (jump) {
        phase->count = 0; // these errors are of the deadlines before the jump
        return error > 0 ? period_ns - error : -error;
    }
    return -error / GAIN_DIVISOR;
}
