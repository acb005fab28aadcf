// SPDX-License-Identifier: BSD-3-Clause
// Signals as a flag.
//
// Units    none.
// Frames   none.
// Arrays   none.
// Memory   one static flag.
// Errors   none.
#define _GNU_SOURCE // sigaction
#include "base/stop.h"

#include <signal.h> // sigaction
#include <stddef.h> // NULL

static volatile sig_atomic_t stop_signal;
static volatile sig_atomic_t stop_count;

static void note(int signal)
{
    stop_signal = signal;
    stop_count = stop_count + 1;
}

void lw_stop_install(void)
{
    // No SA_RESTART: a wait for messages ends at once.
    struct sigaction action = {.sa_handler = note};
    sigemptyset(&action.sa_mask);
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    sigaction(SIGHUP, &action, NULL);
    // Whoever read our words may go: the arm must not be dropped for that.
    const struct sigaction ignore = {.sa_handler = SIG_IGN};
    sigaction(SIGPIPE, &ignore, NULL);
}

int lw_stop_signal(void)
{
    return (int)stop_signal;
}

int lw_stop_count(void)
{
    return (int)stop_count;
}

int lw_stop_exit_status(void)
{
    return stop_signal == SIGINT ? 128 + SIGINT : 0;
}
