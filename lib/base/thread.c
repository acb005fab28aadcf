// SPDX-License-Identifier: BSD-3-Clause
// Threads and real-time permissions of Linux.
//
// Units    see thread.h.
// Frames   none.
// Arrays   none.
// Memory   see thread.h.
// Errors   see thread.h.
#define _GNU_SOURCE // mlockall
#include "base/thread.h"

#include <sched.h>    // SCHED_FIFO
#include <stddef.h>   // size_t
#include <sys/mman.h> // mlockall

enum { PREFAULT_BYTES = 256 * 1024, PAGE_BYTES = 4096 };

bool lw_thread_lock_memory(void)
{
    return mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
}

bool lw_thread_set_priority(int priority)
{
    const struct sched_param param = {.sched_priority = priority};
    return pthread_setschedparam(pthread_self(), priority > 0 ? SCHED_FIFO : SCHED_OTHER, &param) == 0;
}

void lw_thread_prefault_stack(void)
{
    volatile unsigned char stack[PREFAULT_BYTES];
    for (size_t i = 0; i < sizeof stack; i += PAGE_BYTES)
        stack[i] = 0;
}

bool lw_thread_start(pthread_t *thread, void *(*run)(void *), void *user)
{
    return pthread_create(thread, NULL, run, user) == 0;
}
