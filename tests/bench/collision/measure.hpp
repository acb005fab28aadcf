// SPDX-License-Identifier: BSD-3-Clause
// What the benches of distances share: random numbers, a clock, medians.
//
// Units    ns of this thread's processor time.
// Frames   none.
// Arrays   of the caller's length.
// Memory   one state of the random numbers a program.
// Errors   none.
#ifndef LW_BENCH_COLLISION_MEASURE_HPP
#define LW_BENCH_COLLISION_MEASURE_HPP

#include <algorithm> // sort
#include <cmath>     // sqrt
#include <cstdint>
#include <ctime> // clock_gettime
#include <vector>

// xorshift64*, the same sequence in every run; uniform in [-1, 1).
inline double uniform()
{
    static uint64_t state = 1;
    state ^= state >> 12;
    state ^= state << 25;
    state ^= state >> 27;
    return static_cast<double>((state * UINT64_C(2685821657736338717)) >> 11) * 0x1p-52 - 1;
}

inline double uniform(double low, double high)
{
    return low + 0.5 * (high - low) * (uniform() + 1);
}

// A unit vector of n numbers; not quite evenly distributed.
inline void unit(double *v, int n)
{
    double square = 0;
    for (int i = 0; i < n; i++) {
        v[i] = uniform();
        square += v[i] * v[i];
    }
    for (int i = 0; i < n; i++)
        v[i] /= std::sqrt(square);
}

// Reading it costs some 300 ns.
inline double now_ns(clockid_t clock = CLOCK_THREAD_CPUTIME_ID)
{
    timespec t;
    clock_gettime(clock, &t);
    return 1e9 * static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_nsec);
}

inline double median(std::vector<double> values)
{
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

#endif
