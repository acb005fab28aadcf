// SPDX-License-Identifier: BSD-3-Clause
// Threads, and what a process asks of the system to keep time: locked memory and a real-time priority.
//
// Units    priorities are those of SCHED_FIFO, 1..99.
// Frames   none.
// Arrays   none.
// Memory   pthread's.
// Errors   false when the system refuses; the caller decides.
#ifndef LW_BASE_THREAD_H
#define LW_BASE_THREAD_H

#include <pthread.h> // pthread_t
#include <stdbool.h> // bool

// Locks all present and future memory of the process.
bool lw_thread_lock_memory(void);

// Gives the calling thread SCHED_FIFO at `priority`; 0 gives the normal class back.
bool lw_thread_set_priority(int priority);

// Binds the calling thread to one CPU; may_bind tells whether that is possible and leaves it as it was.
bool lw_thread_bind(int cpu);
bool lw_thread_may_bind(int cpu);

// Touches the stack that a real-time thread will use, so that no page fault comes later.
void lw_thread_prefault_stack(void);

// Starts a thread. False when there is none to be had.
bool lw_thread_start(pthread_t *thread, void *(*run)(void *), void *user);

#endif
