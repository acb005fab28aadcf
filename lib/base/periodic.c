// SPDX-License-Identifier: BSD-3-Clause
// Fixed-rate loop.
//
// Units    ns.
// Frames   none.
// Arrays   none.
// Memory   the caller's.
// Errors   none.
#include "base/periodic.h"

#include "base/clock.h" // lw_clock_mono_ns, lw_clock_sleep_until

struct lw_periodic lw_periodic_start(int64_t first_ns, int64_t period_ns)
{
    return (struct lw_periodic){.period_ns = period_ns, .deadline_ns = first_ns, .wake_ns = first_ns};
}

void lw_periodic_skip(struct lw_periodic *loop, int64_t now_ns)
{
    if (now_ns <= loop->deadline_ns)
        return;
    const int64_t missed = (now_ns - loop->deadline_ns + loop->period_ns - 1) / loop->period_ns;
    loop->deadline_ns += missed * loop->period_ns;
    loop->skipped += missed;
}

int64_t lw_periodic_wait(struct lw_periodic *loop)
{
    lw_periodic_skip(loop, lw_clock_mono_ns());
    lw_clock_sleep_until(loop->deadline_ns);
    loop->wake_ns = lw_clock_mono_ns();
    const int64_t late = loop->wake_ns - loop->deadline_ns;
    loop->deadline_ns += loop->period_ns;
    return late;
}
