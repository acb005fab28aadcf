// SPDX-License-Identifier: BSD-3-Clause
// Clouds of points and the farthest one in a direction. Vector types stand here and in cull.h alone: two doubles at
// once, what every x86-64 and every 64-bit ARM has. The answer does not depend on the width: of equal points the first
// one counts.
//
// Units    metres.
// Frames   of the cloud.
// Arrays   coordinate k of point i is x[k * padded + i]; the padding repeats point 0.
// Memory   the caller's.
// Errors   none; with a NaN the answer is some valid index.
#ifndef LW_COLLISION_SUPPORT_H
#define LW_COLLISION_SUPPORT_H

#include <string.h> // memcpy

struct lw_cloud {
    const double *x; // [3 * padded]
    int count;       // 1..64
    int padded;      // a multiple of four, or 2 for a segment
};

static inline void lw_cloud_point(const struct lw_cloud *cloud, int i, double out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = cloud->x[k * cloud->padded + i];
}

typedef double lw_two __attribute__((vector_size(16)));
typedef long long lw_two_mask __attribute__((vector_size(16)));

static inline lw_two lw_two_load(const double *from)
{
    lw_two value;
    memcpy(&value, from, sizeof value);
    return value;
}

static inline lw_two lw_two_choose(lw_two_mask which, lw_two yes, lw_two no)
{
    return (lw_two)((which & (lw_two_mask)yes) | (~which & (lw_two_mask)no));
}

// Best point of each lane so far: its height, and its index as a double.
struct lw_lanes {
    lw_two height, at;
};

static inline struct lw_lanes lw_lanes_better(struct lw_lanes best, lw_two height, lw_two at)
{
    const lw_two_mask higher = height > best.height;
    best.height = lw_two_choose(higher, height, best.height);
    best.at = lw_two_choose(higher, at, best.at);
    return best;
}

// Index of the point with the greatest x . direction.
static inline int lw_cloud_support(const struct lw_cloud *cloud, const double direction[3])
{
    const double *x = cloud->x, *y = x + cloud->padded, *z = y + cloud->padded;
    if (cloud->padded == 2)
        return x[1] * direction[0] + y[1] * direction[1] + z[1] * direction[2] >
               x[0] * direction[0] + y[0] * direction[1] + z[0] * direction[2];

    // Two chains of two lanes hide the latency of the comparison.
    const lw_two dx = {direction[0], direction[0]}, dy = {direction[1], direction[1]},
                 dz = {direction[2], direction[2]};
    const lw_two step = {4, 4};
    struct lw_lanes even = {lw_two_load(x) * dx + lw_two_load(y) * dy + lw_two_load(z) * dz, {0, 1}};
    struct lw_lanes odd = {lw_two_load(x + 2) * dx + lw_two_load(y + 2) * dy + lw_two_load(z + 2) * dz, {2, 3}};
    lw_two at_even = even.at, at_odd = odd.at;
    for (int i = 4; i < cloud->padded; i += 4) {
        at_even += step;
        at_odd += step;
        const double *xi = x + i, *yi = y + i, *zi = z + i;
        even = lw_lanes_better(even, lw_two_load(xi) * dx + lw_two_load(yi) * dy + lw_two_load(zi) * dz, at_even);
        odd = lw_lanes_better(odd, lw_two_load(xi + 2) * dx + lw_two_load(yi + 2) * dy + lw_two_load(zi + 2) * dz,
                              at_odd);
    }

    // Of the four lanes the highest point, of equal ones the first.
    const double height[4] = {even.height[0], even.height[1], odd.height[0], odd.height[1]};
    const double at[4] = {even.at[0], even.at[1], odd.at[0], odd.at[1]};
    int best = 0;
    for (int k = 1; k < 4; k++)
        if (height[k] > height[best] || (height[k] == height[best] && at[k] < at[best]))
            best = k;
    return (int)at[best];
}

#endif
