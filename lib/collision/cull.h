// SPDX-License-Identifier: BSD-3-Clause
// Broad phase: which of sixteen boxes or bounding spheres a link may be near to, in single precision, four at once. It
// errs on the near side alone, and what is not a number is near.
//
// Units    metres.
// Frames   base frame.
// Arrays   sixteen neighbours of each coordinate, from a multiple of four on.
// Memory   none.
// Errors   none.
#ifndef LW_COLLISION_CULL_H
#define LW_COLLISION_CULL_H

#include "collision/shape.h" // struct lw_capsule

#include <math.h>    // sqrtf
#include <stdbool.h> // bool
#include <stdint.h>  // int32_t
#include <string.h>  // memcpy

// Pointers to the first of sixteen.
struct lw_spheres {
    const float *x, *y, *z, *r;
};
struct lw_boxes {
    const float *x, *y, *z, *half[3];
    const float *slack; // m, how far their members may have moved
};

// A link as its middle, unit axis and half length, and how far it looks.
struct lw_cull {
    float m[3], e[3], half;
    float side[3]; // half sides of the box around its axis
    float thick;   // its radius, rounded up
    float reach;   // thick and the distance that counts as near, by lw_cull_look
};

typedef float lw_four __attribute__((vector_size(16)));
typedef int32_t lw_four_mask __attribute__((vector_size(16)));

// The link for lw_cull_*, that looks at nothing yet.
//   length  in  m, of its axis
struct lw_cull lw_cull_link(const struct lw_capsule *link, double length);

// Sets the distance that counts as near.
static inline void lw_cull_look(struct lw_cull *link, double d_max)
{
    link->reach = (link->thick + (float)d_max) * (1 + 2e-6F) + 1e-5F + 1e-3F * link->half;
}

// Whether the distance of two links may be at most d_max.
static inline bool lw_cull_pair(const struct lw_cull *a, const struct lw_cull *b, double d_max)
{
    const float x = a->m[0] - b->m[0], y = a->m[1] - b->m[1], z = a->m[2] - b->m[2];
    const float reach = a->half + b->half + a->thick + b->thick + (float)d_max;
    return !(x * x + y * y + z * z > reach * reach * (1 + 4e-6F));
}

// Index of the least of some values.
static inline int lw_cull_least(const float *value, int count)
{
    int at = 0;
    for (int i = 1; i < count; i++)
        at = value[i] < value[at] ? i : at;
    return at;
}

static inline lw_four lw_four_load(const float *from)
{
    lw_four value;
    memcpy(&value, from, sizeof value);
    return value;
}

// The values above zero, 0 for the others and for what is not a number.
static inline lw_four lw_four_positive(lw_four x)
{
    const lw_four_mask above = x > 0;
    return (lw_four)(above & (lw_four_mask)x);
}

static inline lw_four lw_four_abs(lw_four x)
{
    return (lw_four)((lw_four_mask)x & INT32_MAX);
}

// Squared distances of four centres from the link's axis, by its middle: |w|^2 - t^2 + what t is beyond the ends,
// squared. The digits lost are few beside reach (see lw_cull_link).
static inline lw_four lw_cull_spheres_square(const struct lw_spheres *s, int i, const struct lw_cull *link)
{
    const lw_four x = lw_four_load(s->x + i) - link->m[0], y = lw_four_load(s->y + i) - link->m[1],
                  z = lw_four_load(s->z + i) - link->m[2];
    const lw_four t = x * link->e[0] + y * link->e[1] + z * link->e[2];
    const lw_four beyond = lw_four_positive(lw_four_abs(t) - link->half);
    return x * x + y * y + z * z - t * t + beyond * beyond;
}

// Squared distances of four boxes from the box around the link's axis.
static inline lw_four lw_cull_boxes_square(const struct lw_boxes *b, int i, const struct lw_cull *link)
{
    const lw_four x = lw_four_abs(lw_four_load(b->x + i) - link->m[0]) - (lw_four_load(b->half[0] + i) + link->side[0]);
    const lw_four y = lw_four_abs(lw_four_load(b->y + i) - link->m[1]) - (lw_four_load(b->half[1] + i) + link->side[1]);
    const lw_four z = lw_four_abs(lw_four_load(b->z + i) - link->m[2]) - (lw_four_load(b->half[2] + i) + link->side[2]);
    const lw_four beside[3] = {lw_four_positive(x), lw_four_positive(y), lw_four_positive(z)};
    return beside[0] * beside[0] + beside[1] * beside[1] + beside[2] * beside[2];
}

// A bit each for the lanes i..i+3 that are within a distance.
static inline lw_four_mask lw_cull_within(lw_four square, lw_four distance, int i)
{
    static const lw_four_mask bit = {1, 2, 4, 8};
    return ~(square > distance * distance) & (bit << i);
}

static inline unsigned lw_cull_bits(lw_four_mask near)
{
    return (unsigned)(near[0] | near[1] | near[2] | near[3]);
}

// Bit i is set when sphere i of the first `count` may be near; the bits of others mean nothing.
//   slack  in  m, how far they may have moved
static inline unsigned lw_cull_spheres(const struct lw_spheres *s, int count, const struct lw_cull *link, float slack)
{
    lw_four_mask near = {0, 0, 0, 0};
    for (int i = 0; i < count; i += 4)
        near |= lw_cull_within(lw_cull_spheres_square(s, i, link), lw_four_load(s->r + i) + (link->reach + slack), i);
    return lw_cull_bits(near);
}

// Bit i is set when something in box i may be near.
static inline unsigned lw_cull_boxes(const struct lw_boxes *b, const struct lw_cull *link)
{
    lw_four_mask near = {0, 0, 0, 0};
    for (int i = 0; i < 16; i += 4)
        near |= lw_cull_within(lw_cull_boxes_square(b, i, link), lw_four_load(b->slack + i) + link->reach, i);
    return lw_cull_bits(near);
}

// Index of the sphere that is nearest of the first `count`, and of such a box, about.
static inline int lw_cull_nearest_sphere(const struct lw_spheres *s, const struct lw_cull *link, int count)
{
    float distance[16];
    for (int i = 0; i < 16; i += 4) {
        const lw_four square = lw_four_positive(lw_cull_spheres_square(s, i, link));
        for (int k = i; k < i + 4; k++)
            distance[k] = sqrtf(square[k - i]) - s->r[k];
    }
    return lw_cull_least(distance, count);
}

static inline int lw_cull_nearest_box(const struct lw_boxes *b, const struct lw_cull *link, int count)
{
    float square[16];
    for (int i = 0; i < 16; i += 4) {
        const lw_four four = lw_cull_boxes_square(b, i, link);
        memcpy(square + i, &four, sizeof four);
    }
    return lw_cull_least(square, count);
}

#endif
