// SPDX-License-Identifier: BSD-3-Clause
// Random pairs of a link and an obstacle, 22 classes of them: ordinary, touching, degenerate, tiny, huge, far away.
//
// Units    metres.
// Frames   one.
// Arrays   points [n][3].
// Memory   the caller's; a pair must not be copied, its shape points into it.
// Errors   cmocka's.
#ifndef LW_TESTS_DISTANCE_PAIRS_H
#define LW_TESTS_DISTANCE_PAIRS_H

#include "base/vec.h"           // lw_vec_*
#include "collision/closed.h"   // lw_closed_along
#include "collision/distance.h" // lw_distance_link
#include "helpers.h"

enum pair_class {
    // of any shape
    RANDOM,
    TOUCH,
    NEAR_PLUS,
    NEAR_MINUS,
    ZERO_LENGTH,
    PARALLEL,
    FAR_BOTH,
    FAR_APART,
    CORE_OVERLAP,
    SHALLOW,
    BARE_TOUCH,
    BARE_PLUS_NANO,
    BARE_PLUS_MICRO,
    BARE_MINUS_MICRO,
    // of hulls
    FLAT,
    DUPLICATE,
    FEW,
    NEAR_DUPLICATE,
    TINY,
    LARGE,
    PLATE,
    NEEDLE,
    CLASSES
};

static const char *const class_name[CLASSES] = {
    "random",        "touch d=0",     "near d=+1e-9",    "near d=-1e-9", "zero-length",    "parallel",
    "far both 1e3",  "far apart 1e3", "core overlap",    "shallow pen",  "r=0 d=0",        "r=0 d=+1e-9",
    "r=0 d=+1e-6",   "r=0 d=-1e-6",   "flat hull",       "dup verts",    "collinear/1-3v", "near-dup verts",
    "tiny hull 1mm", "large 10 m",    "thin plate 1e-7", "needle 1e4:1",
};

struct pair {
    struct lw_capsule link;
    struct lw_shape shape;
    double room[LW_HULL_ROOM];
    int count;
    double points[LW_HULL_MAX][3]; // of the shape's core
};

static inline void pair_point(struct random *random, double spread, double out[3])
{
    random_fill(random, -spread, spread, out, 3);
}

static inline void pair_direction(struct random *random, double out[3])
{
    do
        pair_point(random, 1, out);
    while (!(lw_vec_norm(out) > 0.1 && lw_vec_norm(out) < 1));
    const double length = lw_vec_norm(out);
    for (int i = 0; i < 3; i++)
        out[i] /= length;
}

static inline void pair_pose(struct random *random, struct lw_pose *pose)
{
    double q[4], square;
    do {
        random_fill(random, -1, 1, q, 4);
        square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    } while (!(square > 0.1 && square < 1));
    for (int i = 0; i < 4; i++)
        q[i] /= sqrt(square);
    const double p[3] = {random_in(random, -1, 1), random_in(random, -1, 1), random_in(random, -1, 1)};
    assert_int_equal(lw_pose_make(p, q, pose), LW_OK);
}

// --- shapes ---

// Number of vertices: small ones mostly, because the oracle's cost grows with the third power.
static inline int pair_hull_count(struct random *random)
{
    if (random_below(random, 200) == 0)
        return 17 + random_below(random, LW_HULL_MAX - 16);
    return 4 + random_below(random, random_below(random, 4) ? 5 : 13);
}

// Makes later vertices copies of earlier ones, exact or nearly so.
static inline void pair_repeat(struct random *random, double noise, double v[LW_HULL_MAX][3], int n)
{
    for (int i = n / 2; i < n; i++)
        for (int k = 0; k < 3; k++)
            v[i][k] = v[i - n / 2][k] + random_in(random, -noise, noise);
}

// Half extents of a class's hulls.
static inline void pair_half_extents(enum pair_class class, double half[3])
{
    const double scale = class == TINY ? 3e-4 : class == LARGE ? 9 : 0.3;
    half[0] = class == NEEDLE ? 1 : scale;
    half[1] = class == NEEDLE ? 1e-4 : scale;
    half[2] = class == NEEDLE ? 1e-4 : class == PLATE ? 1e-7 : scale;
}

// Vertices of a hull about the origin, as its class wants them.
static inline int pair_vertices(struct random *random, enum pair_class class, double v[LW_HULL_MAX][3])
{
    double half[3];
    const int n = class == FEW ? 1 + random_below(random, 5) : pair_hull_count(random);
    pair_half_extents(class, half);
    for (int i = 0; i < n; i++)
        for (int k = 0; k < 3; k++)
            v[i][k] = half[k] * random_in(random, -1, 1);
    const double height = random_in(random, -0.2, 0.2);
    for (int i = 0; class == FLAT && i < n; i++)
        v[i][2] = height;
    // More than three points of the class FEW are on one line.
    for (int i = 2; class == FEW && n > 3 && i < n; i++)
        lw_closed_along(v[0], v[1], 0.25 * i, v[i]);
    if (class == DUPLICATE || class == NEAR_DUPLICATE)
        pair_repeat(random, class == DUPLICATE ? 0 : 1e-12, v, n);
    return n;
}

static inline void pair_move(const struct lw_pose *pose, const double x[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = lw_vec_dot(&pose->r[3 * i], x) + pose->p[i];
}

// A hull of world vertices: what the shape and the oracle see has the same digits.
static inline void pair_set_hull(struct random *random, enum pair_class class, struct lw_pose *pose, struct pair *pair)
{
    static const struct lw_pose origin = {.r = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
    double v[LW_HULL_MAX][3];
    pair->count = pair_vertices(random, class, v);
    // Half of the hulls keep their axes: exactly flat faces.
    if (random_below(random, 2))
        memcpy(pose->r, origin.r, sizeof pose->r);
    for (int i = 0; i < pair->count; i++)
        pair_move(pose, v[i], pair->points[i]);
    const struct lw_solid solid = {.kind = LW_HULL,
                                   .radius = random_below(random, 3) ? 0 : random_in(random, 0, 0.1),
                                   .count = pair->count,
                                   .vertex = pair->points[0]};
    assert_int_equal(lw_shape_make(&solid, &origin, pair->room, &pair->shape, NULL), LW_OK);
}

static inline void pair_set_shape(struct random *random, enum pair_class class, enum lw_shape_kind kind,
                                  const double offset[3], struct pair *pair)
{
    struct lw_pose pose;
    struct lw_solid solid = {.kind = kind, .radius = random_in(random, 0.01, 0.2)};
    pair_pose(random, &pose);
    for (int i = 0; i < 3; i++)
        pose.p[i] += offset[i];
    if (kind == LW_HULL) {
        pair_set_hull(random, class, &pose, pair);
        return;
    }
    if (kind == LW_BOX)
        solid.radius = random_below(random, 3) ? 0 : random_in(random, 0, 0.1);
    solid.half_length = random_in(random, 0, 0.4);
    random_fill(random, 0.02, 0.4, solid.half, 3);
    assert_int_equal(lw_shape_make(&solid, &pose, pair->room, &pair->shape, NULL), LW_OK);
    pair->count = kind == LW_SPHERE ? 1 : kind == LW_CAPSULE ? 2 : 8;
    for (int i = 0; i < pair->count; i++) {
        const double corner[3] = {i & 1 ? solid.half[0] : -solid.half[0], i & 2 ? solid.half[1] : -solid.half[1],
                                  i & 4 ? solid.half[2] : -solid.half[2]};
        if (kind == LW_BOX)
            pair_move(&pose, corner, pair->points[i]);
        else
            memcpy(pair->points[i], i ? pair->shape.segment.b : pair->shape.segment.a, sizeof pair->points[i]);
    }
}

// --- links ---

static inline void pair_shift(struct lw_capsule *link, double by, const double direction[3])
{
    lw_vec_add_scaled(by, direction, link->a);
    lw_vec_add_scaled(by, direction, link->b);
}

// A direction that the shape knows: its axis, or an edge.
static inline void pair_edge(struct random *random, const struct pair *pair, double out[3])
{
    if (pair->shape.kind == LW_BOX) {
        const int axis = random_below(random, 3);
        for (int k = 0; k < 3; k++)
            out[k] = pair->shape.box.axes[3 * k + axis];
        return;
    }
    const int last = pair->count > 0 ? pair->count - 1 : 0;
    lw_vec_sub(pair->points[last], pair->points[random_below(random, last + 1)], out);
    if (!(lw_vec_norm(out) > 0))
        pair_direction(random, out);
}

// Through a point of the core: a random mean of its points.
static inline void pair_pierce(struct random *random, struct pair *pair)
{
    double inside[3] = {0}, weight[LW_HULL_MAX], sum = 0, axis[3];
    random_fill(random, 0, 1, weight, pair->count);
    for (int i = 0; i < pair->count; i++)
        sum += weight[i];
    for (int i = 0; i < pair->count; i++)
        lw_vec_add_scaled(weight[i] / sum, pair->points[i], inside);
    pair_point(random, 0.5, axis);
    if (random_below(random, 4) == 0)
        pair_edge(random, pair, axis);
    const double t = random_in(random, -0.1, 1.1);
    for (int k = 0; k < 3; k++) {
        pair->link.a[k] = inside[k] - t * axis[k];
        pair->link.b[k] = inside[k] + (1 - t) * axis[k];
    }
}

static inline void pair_set_link(struct random *random, enum pair_class class, const double offset[3],
                                 struct pair *pair)
{
    double axis[3], direction[3];
    pair_point(random, class == LARGE ? 30 : 1, pair->link.a);
    lw_vec_add_scaled(1, offset, pair->link.a);
    pair_point(random, 0.4, axis);
    if (class == PARALLEL)
        pair_edge(random, pair, axis);
    for (int k = 0; k < 3; k++)
        pair->link.b[k] = pair->link.a[k] + (class == ZERO_LENGTH ? 0 : axis[k]);
    pair->link.r = random_in(random, 0.01, 0.15);
    if (class == CORE_OVERLAP || (class >= FLAT && random_below(random, 3) == 0))
        pair_pierce(random, pair);
    if (class == FAR_APART) {
        pair_direction(random, direction);
        pair_shift(&pair->link, 1e3, direction);
    }
}

// Moves the link along the normal until the distance is d. False when the cores overlap, so that n says little.
static inline bool pair_bring_to(struct pair *pair, double d)
{
    struct lw_distance found;
    lw_distance_link(&pair->link, &pair->shape, HUGE_VAL, NULL, &found);
    if (found.flags & LW_DISTANCE_CORE)
        return false;
    pair_shift(&pair->link, d - found.d, found.n);
    return true;
}

static inline bool pair_try(struct random *random, enum pair_class class, enum lw_shape_kind kind, struct pair *pair)
{
    double offset[3] = {0};
    if (class == FAR_BOTH) {
        pair_direction(random, offset);
        for (int k = 0; k < 3; k++)
            offset[k] *= 1e3;
    }
    pair_set_shape(random, class, kind, offset, pair);
    pair_set_link(random, class, offset, pair);
    if (class >= BARE_TOUCH && class <= BARE_MINUS_MICRO)
        pair->link.r = pair->shape.r = 0;
    switch (class) {
    case TOUCH:
    case BARE_TOUCH: return pair_bring_to(pair, 0);
    case NEAR_PLUS:
    case BARE_PLUS_NANO: return pair_bring_to(pair, 1e-9);
    case NEAR_MINUS: return pair_bring_to(pair, -1e-9);
    case SHALLOW: return pair_bring_to(pair, -random_in(random, 0.1, 0.9) * (pair->link.r + pair->shape.r));
    case BARE_PLUS_MICRO: return pair_bring_to(pair, 1e-6);
    case BARE_MINUS_MICRO: return pair_bring_to(pair, -1e-6);
    default: return true;
    }
}

// A pair of a class; hulls alone from FLAT on.
static inline void pair_make(struct random *random, enum pair_class class, struct pair *pair)
{
    static const enum lw_shape_kind kinds[4] = {LW_SPHERE, LW_CAPSULE, LW_BOX, LW_HULL};
    const enum lw_shape_kind kind = class >= FLAT ? LW_HULL : kinds[random_below(random, 4)];
    do
        *pair = (struct pair){.count = 0};
    while (!pair_try(random, class, kind, pair));
}

#endif
