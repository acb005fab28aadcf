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
#include <sys/mman.h> // mlockall, mmap

enum { PREFAULT_BYTES = 1 << 20, PAGE_BYTES = 4096, TRIAL_BYTES = 64 * 1024 * 1024 };

bool lw_thread_lock_memory(void)
{
    if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0)
        return false;
    // Under a small memlock limit the call succeeds, and then no thread gets a stack: try what threads will need.
    void *trial = mmap(NULL, TRIAL_BYTES, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (trial == MAP_FAILED) {
        munlockall();
        return false;
    }
    munmap(trial, TRIAL_BYTES);
    return true;
}

bool lw_thread_set_priority(int priority)
{
    const struct sched_param param = {.sched_priority = priority};
    return pthread_setschedparam(pthread_self(), priority > 0 ? SCHED_FIFO : SCHED_OTHER, &param) == 0;
}

bool lw_thread_bind(int cpu)
{
    cpu_set_t set;
    CPU_ZERO(&set);
    CPU_SET((size_t)cpu, &set);
    return pthread_setaffinity_np(pthread_self(), sizeof set, &set) == 0;
}

bool lw_thread_may_bind(int cpu)
{
    cpu_set_t before;
    if (pthread_getaffinity_np(pthread_self(), sizeof before, &before) != 0 || !lw_thread_bind(cpu))
        return false;
    return pthread_setaffinity_np(pthread_self(), sizeof before, &before) == 0;
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
