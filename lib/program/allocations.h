// SPDX-License-Identifier: BSD-3-Clause
// Allocations: counts the calls of malloc, calloc, realloc and free that watched threads make, libraries included.
// A program that links it replaces the allocator's functions by counting ones over glibc's.
//
// Units    calls.
// Frames   none.
// Arrays   none.
// Memory   one static counter a process.
// Errors   a build that cannot count (sanitizers) says so by LW_ALLOCATIONS_UNKNOWN.
#ifndef LW_PROGRAM_ALLOCATIONS_H
#define LW_PROGRAM_ALLOCATIONS_H

#include <stdbool.h> // bool
#include <stdint.h>  // int64_t

#define LW_ALLOCATIONS_UNKNOWN INT64_C(-1)

// Whether this build counts: sanitizers bring allocators of their own, and only glibc has what is counted over.
#ifdef __has_feature
#define LW_HAS_FEATURE(feature) __has_feature(feature)
#else
#define LW_HAS_FEATURE(feature) 0
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || LW_HAS_FEATURE(address_sanitizer) ||              \
    LW_HAS_FEATURE(thread_sanitizer) || !defined(__GLIBC__)
#define LW_ALLOCATIONS_COUNTED 0
#else
#define LW_ALLOCATIONS_COUNTED 1
#endif

// Starts watching the calling thread from a count of 0, after a call made on purpose has proven that the count works.
// False where it does not.
bool lw_allocations_watch(void);

// Stops watching the calling thread; the count stays.
void lw_allocations_unwatch(void);

// Calls that watched threads have made, or LW_ALLOCATIONS_UNKNOWN. Any thread may ask.
int64_t lw_allocations_count(void);

#endif
