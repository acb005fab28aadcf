// SPDX-License-Identifier: BSD-3-Clause
// Linux clocks.
//
// Units    ns unless a name says us.
// Frames   none.
// Arrays   none.
// Memory   none.
// Errors   none.
#define _GNU_SOURCE // clock_nanosleep, getrandom
#include "base/clock.h"

#include <errno.h>      // EINTR
#include <sys/random.h> // getrandom
#include <time.h>       // clock_gettime
#include <unistd.h>     // getpid

static int64_t read_clock(clockid_t id)
{
    struct timespec now;
    clock_gettime(id, &now);
    return (int64_t)now.tv_sec * LW_NS_PER_S + now.tv_nsec;
}

int64_t lw_clock_mono_ns(void)
{
    return read_clock(CLOCK_MONOTONIC);
}

int64_t lw_clock_utime(void)
{
    return read_clock(CLOCK_REALTIME) / 1000;
}

void lw_clock_sleep_until(int64_t deadline_ns)
{
    const struct timespec deadline = {.tv_sec = deadline_ns / LW_NS_PER_S, .tv_nsec = deadline_ns % LW_NS_PER_S};
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &deadline, NULL) == EINTR)
        ;
}

int64_t lw_clock_session(void)
{
    // Where the kernel has no entropy yet, time and pid still tell two starts apart.
    int64_t value = 0;
    if (getrandom(&value, sizeof value, GRND_NONBLOCK) != (ssize_t)sizeof value)
        value = lw_clock_utime() ^ ((int64_t)getpid() << 40);
    value &= INT64_MAX;
    return value > 0 ? value : 1;
}
