// SPDX-License-Identifier: BSD-3-Clause
// Counting allocator over glibc's own functions.
//
// Units    calls.
// Frames   none.
// Arrays   none.
// Memory   see allocations.h.
// Errors   see allocations.h.
#include "program/allocations.h"

#include <errno.h>     // EINVAL, ENOMEM
#include <stdatomic.h> // atomic_int_fast64_t
#include <stdlib.h>    // malloc

#if !LW_ALLOCATIONS_COUNTED

bool lw_allocations_watch(void)
{
    return false;
}

void lw_allocations_unwatch(void)
{
}

int64_t lw_allocations_count(void)
{
    return LW_ALLOCATIONS_UNKNOWN;
}

#else

static atomic_int_fast64_t calls = LW_ALLOCATIONS_UNKNOWN;
static _Thread_local bool watched;

static void note(void)
{
    if (watched)
        atomic_fetch_add_explicit(&calls, 1, memory_order_relaxed);
}

// The C library's names and prototypes, so its naming too.
// NOLINTBEGIN(bugprone-reserved-identifier,misc-use-internal-linkage,readability-*)

void *__libc_malloc(size_t size);
void *__libc_calloc(size_t count, size_t size);
void *__libc_realloc(void *old, size_t size);
void *__libc_memalign(size_t alignment, size_t size);
void __libc_free(void *old);
void *memalign(size_t alignment, size_t size);
int posix_memalign(void **out, size_t alignment, size_t size);

void *malloc(size_t size)
{
    note();
    return __libc_malloc(size);
}

void *calloc(size_t count, size_t size)
{
    note();
    return __libc_calloc(count, size);
}

void *realloc(void *old, size_t size)
{
    note();
    return __libc_realloc(old, size);
}

void free(void *old)
{
    note();
    __libc_free(old);
}

void *memalign(size_t alignment, size_t size)
{
    note();
    return __libc_memalign(alignment, size);
}

void *aligned_alloc(size_t alignment, size_t size)
{
    return memalign(alignment, size);
}

int posix_memalign(void **out, size_t alignment, size_t size)
{
    if (alignment < sizeof(void *) || (alignment & (alignment - 1)) != 0)
        return EINVAL;
    void *made = memalign(alignment, size);
    if (made != NULL)
        *out = made;
    return made != NULL ? 0 : ENOMEM;
}

// NOLINTEND(bugprone-reserved-identifier,misc-use-internal-linkage,readability-*)

bool lw_allocations_watch(void)
{
    watched = true;
    const int64_t before = atomic_load(&calls);
    void *volatile block = malloc(1); // volatile: compilers drop a malloc whose result is not used
    free(block);
    const bool works = atomic_load(&calls) == before + 2;
    atomic_store(&calls, works ? 0 : LW_ALLOCATIONS_UNKNOWN);
    watched = works;
    return works;
}

void lw_allocations_unwatch(void)
{
    watched = false;
}

int64_t lw_allocations_count(void)
{
    return atomic_load_explicit(&calls, memory_order_relaxed);
}

#endif
