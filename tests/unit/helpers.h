// SPDX-License-Identifier: BSD-3-Clause
// What the unit tests share: cmocka with the headers it needs, seeded random numbers, comparison of doubles.
//
// Units    of the caller.
// Frames   of the caller.
// Arrays   of the caller.
// Memory   none.
// Errors   a failed comparison prints both values and fails the test at the caller's line.
#ifndef LW_TESTS_HELPERS_H
#define LW_TESTS_HELPERS_H

#include <math.h>    // fabs
#include <setjmp.h>  // cmocka.h needs these four before it
#include <stdarg.h>  // cmocka.h
#include <stddef.h>  // cmocka.h
#include <stdint.h>  // cmocka.h
#include <stdbool.h> // bool
#include <stdio.h>   // FILE
#include <stdlib.h>  // calloc
#include <string.h>  // memcmp

#include <cmocka.h> // assert_*

// --- random numbers: xorshift64*, the same sequence in every run ---

struct random {
    uint64_t state; // not 0
};

static inline uint64_t random_bits(struct random *random)
{
    random->state ^= random->state >> 12;
    random->state ^= random->state << 25;
    random->state ^= random->state >> 27;
    return random->state * UINT64_C(2685821657736338717);
}

// Uniform in [low, high).
static inline double random_in(struct random *random, double low, double high)
{
    return low + (high - low) * ((double)(random_bits(random) >> 11) * 0x1p-53);
}

// Uniform in 0 .. count - 1.
static inline int random_below(struct random *random, int count)
{
    return (int)(random_bits(random) >> 33) % count;
}

static inline void random_fill(struct random *random, double low, double high, double *values, int n)
{
    for (int i = 0; i < n; i++)
        values[i] = random_in(random, low, high);
}

// --- comparison ---

#define NO_NUMBER ((double)NAN)

// Written so that a NaN on either side fails.
static inline void check_near(double found, double expected, double tolerance, const char *what, const char *file,
                              int line)
{
    if (found == expected || fabs(found - expected) <= tolerance)
        return;
    print_error("%s: found %.17g, expected %.17g, tolerance %g\n", what, found, expected, tolerance);
    _fail(file, line);
}

#define assert_near(found, expected, tolerance) check_near(found, expected, tolerance, #found, __FILE__, __LINE__)
#define assert_all_near(found, expected, n, tolerance)                                                                 \
    for (int at_ = 0; at_ < (n); at_++)                                                                                \
    check_near((found)[at_], (expected)[at_], tolerance, #found, __FILE__, __LINE__)

// Equal to the last bit, the sign of zero and NaN included.
#define assert_same_bits(a, b, size) assert_memory_equal(a, b, size)

#endif
