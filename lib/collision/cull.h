// SPDX-License-Identifier: BSD-3-Clause
// Broad phase: which of sixteen bounding spheres a link may be near to, in single precision, four at once. It errs on
// the near side alone, and what is not a number is near.
//
// Units    metres.
// Frames   base frame.
// Arrays   sixteen neighbours of each coordinate, from a multiple of four on.
// Memory   none.
// Errors   none.
#ifndef LW_COLLISION_CULL_H
#define LW_COLLISION_CULL_H

#include "collision/shape.h" // struct lw_capsule

#include <math.h>   // sqrtf
#include <stdint.h> // int32_t
#include <string.h> // memcpy

// Pointers to the first of sixteen spheres.
struct lw_sixteen {
    const float *x, *y, *z, *r;
};

// A link as its middle, unit axis and half length, and how far it looks.
struct lw_cull {
    float m[3], e[3], half;
    float thick; // its radius, rounded up
    float reach; // thick and the distance that counts as near
};

typedef float lw_four __attribute__((vector_size(16)));
typedef int32_t lw_four_mask __attribute__((vector_size(16)));

// The link for lw_cull_*.
struct lw_cull lw_cull_link(const struct lw_capsule *link, double d_max);

// Sets the distance that counts as near.
static inline void lw_cull_look(struct lw_cull *link, double d_max)
{
    link->reach = (float)(((double)link->thick + d_max) * (1 + 1e-6) + 1e-5);
}

static inline lw_four lw_four_load(const float *from)
{
    lw_four value;
    memcpy(&value, from, sizeof value);
    return value;
}

static inline lw_four lw_four_choose(lw_four_mask which, lw_four yes, lw_four no)
{
    return (lw_four)((which & (lw_four_mask)yes) | (~which & (lw_four_mask)no));
}

// Squared distances of four centres from the link's axis.
static inline lw_four lw_cull_squares(const struct lw_sixteen *s, int i, const struct lw_cull *link)
{
    const lw_four half = {link->half, link->half, link->half, link->half};
    const lw_four wx = lw_four_load(s->x + i) - link->m[0], wy = lw_four_load(s->y + i) - link->m[1],
                  wz = lw_four_load(s->z + i) - link->m[2];
    lw_four t = wx * link->e[0] + wy * link->e[1] + wz * link->e[2];
    t = lw_four_choose(t > half, half, t);
    t = lw_four_choose(t < -half, -half, t);
    const lw_four vx = wx - t * link->e[0], vy = wy - t * link->e[1], vz = wz - t * link->e[2];
    return vx * vx + vy * vy + vz * vz;
}

// Bit i is set when sphere i may be near.
//   slack  in  m, how far they may have moved
static inline unsigned lw_cull_near(const struct lw_sixteen *s, const struct lw_cull *link, float slack)
{
    static const lw_four_mask bit = {1, 2, 4, 8};
    const float reach = link->reach + slack;
    lw_four_mask near = {0, 0, 0, 0};
    for (int i = 0; i < 16; i += 4) {
        const lw_four radius = lw_four_load(s->r + i) + reach;
        near |= ~(lw_cull_squares(s, i, link) > radius * radius) & (bit << i);
    }
    return (unsigned)(near[0] | near[1] | near[2] | near[3]);
}

// Lower bounds of the sixteen distances; NaN where there is none.
static inline void lw_cull_bounds(const struct lw_sixteen *s, const struct lw_cull *link, float bound[16])
{
    for (int i = 0; i < 16; i += 4) {
        const lw_four square = lw_cull_squares(s, i, link);
        for (int k = 0; k < 4; k++)
            bound[i + k] = sqrtf(square[k]) * (1 - 1e-6F) - s->r[i + k] - link->thick - 1e-5F;
    }
}

#endif
