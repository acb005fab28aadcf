// SPDX-License-Identifier: BSD-3-Clause
// Seeded noise: numbers that depend on their labels alone, so that a run can be repeated and any one drawn by itself.
//
// Units    none.
// Frames   none.
// Arrays   none.
// Memory   none.
// Errors   none.
#ifndef LW_BASE_NOISE_H
#define LW_BASE_NOISE_H

#include <stdint.h> // uint64_t

// What a number belongs to: whose, which, and which part of it.
struct lw_noise {
    int64_t seed, owner, number, part;
};

// SplitMix64: every bit of the result depends on every bit of the input.
static inline uint64_t lw_noise_mix(uint64_t x)
{
    x += UINT64_C(0x9e3779b97f4a7c15);
    x = (x ^ (x >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ (x >> 27)) * UINT64_C(0x94d049bb133111eb);
    return x ^ (x >> 31);
}

static inline uint64_t lw_noise_bits(const struct lw_noise *noise)
{
    uint64_t bits = lw_noise_mix((uint64_t)noise->seed);
    bits = lw_noise_mix(bits ^ (uint64_t)noise->owner);
    bits = lw_noise_mix(bits ^ (uint64_t)noise->number);
    return lw_noise_mix(bits ^ (uint64_t)noise->part);
}

// Uniform in [0, 1).
static inline double lw_noise_uniform(const struct lw_noise *noise)
{
    return (double)(lw_noise_bits(noise) >> 11) * 0x1p-53;
}

// Mean 0, standard deviation 1, nearly normal, within +-6: the sum of twelve uniform ones.
static inline double lw_noise_normal(const struct lw_noise *noise)
{
    uint64_t bits = lw_noise_bits(noise);
    double sum = -6;
    for (int i = 0; i < 12; i++) {
        bits = lw_noise_mix(bits);
        sum += (double)(bits >> 11) * 0x1p-53;
    }
    return sum;
}

#endif
