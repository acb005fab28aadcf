// SPDX-License-Identifier: BSD-3-Clause
// What the unit tests share: cmocka with the headers it needs, comparison of doubles, and random numbers.
//
// Units    of the caller.
// Frames   of the caller.
// Arrays   of the caller.
// Memory   none.
// Errors   a failed comparison prints both values and fails the test at the caller's line.
#ifndef LW_TESTS_HELPERS_H
#define LW_TESTS_HELPERS_H

#include "random.h" // struct random

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
