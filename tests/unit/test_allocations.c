// SPDX-License-Identifier: BSD-3-Clause
// Tests of the count of allocations: it sees every function of the allocator, called from here or from inside a shared
// library, on watched threads and on no other.
//
// Units    calls.
// Frames   none.
// Arrays   none.
// Memory   counted.
// Errors   cmocka's. Sanitizers bring allocators of their own: there the program ends with 77, skipped.
#define _GNU_SOURCE // memalign, reallocarray

#include "helpers.h"
#include "program/allocations.h"

#include <errno.h>     // EINVAL
#include <malloc.h>    // memalign
#include <pthread.h>   // pthread_create
#include <sched.h>     // sched_yield
#include <stdatomic.h> // atomic_int

enum { SKIPPED = 77 };

// Each function is one call; the volatile keeps a compiler from dropping what is not used.
static void every_function_is_counted(void **state)
{
    (void)state;
    void *volatile block = NULL;
    assert_true(lw_allocations_watch());
    assert_int_equal(lw_allocations_count(), 0);
    block = malloc(1);
    assert_int_equal(lw_allocations_count(), 1);
    void *volatile larger = realloc(block, 2);
    assert_int_equal(lw_allocations_count(), 2);
    free(larger);
    assert_int_equal(lw_allocations_count(), 3);
    block = calloc(1, 1);
    assert_int_equal(lw_allocations_count(), 4);
    free(block);
    block = aligned_alloc(64, 64);
    assert_int_equal(lw_allocations_count(), 6);
    free(block);
    block = memalign(64, 64);
    assert_int_equal(lw_allocations_count(), 8);
    free(block);
    void *aligned = NULL;
    assert_int_equal(posix_memalign(&aligned, 64, 64), 0);
    assert_int_equal(lw_allocations_count(), 10);
    free(aligned);
    block = reallocarray(NULL, 3, 5);
    assert_int_equal(lw_allocations_count(), 12);
    free(block);
    assert_int_equal(lw_allocations_count(), 13);
    lw_allocations_unwatch();
}

// What a library allocates for itself counts as well: each of these is code of the C library, loaded at run time.
static void calls_inside_shared_libraries_are_counted(void **state)
{
    (void)state;
    assert_true(lw_allocations_watch());
    char *volatile copy = strdup("a word");
    assert_int_equal(lw_allocations_count(), 1);
    free(copy);
    FILE *stream = tmpfile();
    const int64_t opened = lw_allocations_count();
    assert_true(opened > 2);
    assert_true(stream != NULL && fclose(stream) == 0);
    assert_true(lw_allocations_count() > opened);
    lw_allocations_unwatch();
}

// The functions do what the C library's do.
static void memory_is_what_was_asked_for(void **state)
{
    (void)state;
    void *aligned = NULL;
    for (size_t alignment = sizeof(void *); alignment <= 4096; alignment *= 2) {
        assert_int_equal(posix_memalign(&aligned, alignment, 100), 0);
        assert_int_equal((uintptr_t)aligned % alignment, 0);
        free(aligned);
        void *block = aligned_alloc(alignment, 10 * alignment);
        assert_int_equal((uintptr_t)block % alignment, 0);
        free(block);
    }
    int place = 0;
    aligned = &place;
    assert_int_equal(posix_memalign(&aligned, 48, 100), EINVAL);
    assert_int_equal(posix_memalign(&aligned, 1, 100), EINVAL);
    volatile size_t too_much = SIZE_MAX / 2;
    assert_int_equal(posix_memalign(&aligned, 64, too_much), ENOMEM);
    assert_ptr_equal(aligned, &place);      // a failure changes nothing
    void *volatile none = malloc(too_much); // volatile: compilers take an unused malloc for granted
    assert_null(none);
    none = calloc(too_much, 4);
    assert_null(none);
    char *zeros = calloc(1000, 3);
    for (int i = 0; i < 3000; i++)
        assert_int_equal(zeros[i], 0);
    memset(zeros, 7, 3000);
    char *sevens = realloc(zeros, 300000);
    for (int i = 0; i < 3000; i++)
        assert_int_equal(sevens[i], 7);
    free(sevens);
}

// --- threads ---

static void make_and_free(int times)
{
    for (int i = 0; i < times; i++) {
        void *volatile block = malloc((size_t)i + 1);
        free(block);
    }
}

static atomic_int stage; // 0 the other thread waits, 1 it works, 2 it has done so

static void *make_and_free_unwatched(void *user)
{
    (void)user;
    while (atomic_load(&stage) == 0)
        sched_yield();
    make_and_free(1000);
    atomic_store(&stage, 2);
    return NULL;
}

// Threads that are not watched do not count, also while one that is watched does.
static void other_threads_do_not_count(void **state)
{
    (void)state;
    pthread_t other;
    assert_int_equal(pthread_create(&other, NULL, make_and_free_unwatched, NULL), 0);
    assert_true(lw_allocations_watch());
    atomic_store(&stage, 1);
    make_and_free(500);
    while (atomic_load(&stage) != 2)
        sched_yield();
    const int64_t found = lw_allocations_count();
    lw_allocations_unwatch();
    assert_int_equal(pthread_join(other, NULL), 0);
    assert_int_equal(found, 1000);
    assert_int_equal(lw_allocations_count(), 1000);
}

static void *watch_and_leave(void *user)
{
    (void)user;
    (void)lw_allocations_watch();
    make_and_free(3);
    lw_allocations_unwatch();
    make_and_free(100);
    return NULL;
}

// What a thread does after it is no longer watched does not count, nor its end; others read its count.
static void a_thread_no_longer_watched_does_not_count(void **state)
{
    (void)state;
    pthread_t other;
    assert_int_equal(pthread_create(&other, NULL, watch_and_leave, NULL), 0);
    assert_int_equal(pthread_join(other, NULL), 0);
    assert_int_equal(lw_allocations_count(), 6);
    make_and_free(10);
    assert_int_equal(lw_allocations_count(), 6);
    lw_allocations_unwatch();            // once more does no harm
    assert_true(lw_allocations_watch()); // and watching again starts from 0
    assert_int_equal(lw_allocations_count(), 0);
    lw_allocations_unwatch();
}

static void nothing_is_known_before_the_first_watch(void **state)
{
    (void)state;
    make_and_free(5);
    assert_int_equal(lw_allocations_count(), LW_ALLOCATIONS_UNKNOWN);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_is_known_before_the_first_watch), // the first, for that reason
        cmocka_unit_test(every_function_is_counted),
        cmocka_unit_test(calls_inside_shared_libraries_are_counted),
        cmocka_unit_test(memory_is_what_was_asked_for),
        cmocka_unit_test(other_threads_do_not_count),
        cmocka_unit_test(a_thread_no_longer_watched_does_not_count),
    };
    if (!LW_ALLOCATIONS_COUNTED)
        return lw_allocations_watch() || lw_allocations_count() != LW_ALLOCATIONS_UNKNOWN ? 1 : SKIPPED;
    return cmocka_run_group_tests_name("allocations", tests, NULL, NULL);
}
