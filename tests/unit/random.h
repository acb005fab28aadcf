// SPDX-License-Identifier: BSD-3-Clause
// Seeded random numbers, xorshift64*: the same sequence in every run.
//
// Units    none.
// Frames   none.
// Arrays   filled by the caller's length.
// Memory   none.
// Errors   none.
#ifndef LW_TESTS_RANDOM_H
#define LW_TESTS_RANDOM_H

#include <stdint.h> // uint64_t

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

#endif
