// SPDX-License-Identifier: BSD-3-Clause
// Distance of the convex hulls of two sets of points by brute force, in 80-bit arithmetic: every vertex, pair and
// triple is tried. Slow, short and without a case that could be missed.
//
// Units    metres.
// Frames   one.
// Arrays   points [3 * n] x y z of each.
// Memory   none.
// Errors   none.
#ifndef LW_TESTS_DISTANCE_ORACLE_H
#define LW_TESTS_DISTANCE_ORACLE_H

#include <math.h>    // sqrtl
#include <stdbool.h> // bool

struct wide {
    long double x, y, z;
};

static inline struct wide wide_of(const double p[3])
{
    return (struct wide){(long double)p[0], (long double)p[1], (long double)p[2]};
}

// a + scale * b
static inline struct wide wide_add(struct wide a, long double scale, struct wide b)
{
    return (struct wide){a.x + scale * b.x, a.y + scale * b.y, a.z + scale * b.z};
}

static inline struct wide wide_sub(struct wide a, struct wide b)
{
    return wide_add(a, -1, b);
}

static inline long double wide_dot(struct wide a, struct wide b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline struct wide wide_cross(struct wide a, struct wide b)
{
    return (struct wide){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// Where on a segment of squared length `square` a point is nearest, clamped.
static inline long double wide_fraction(long double along, long double square)
{
    return along <= 0 ? 0 : along >= square ? 1 : along / square;
}

// --- apart ---

// Squared distance of a point to a segment.
static inline long double oracle_point_segment(struct wide p, struct wide a, struct wide b)
{
    const struct wide ab = wide_sub(b, a), ap = wide_sub(p, a);
    const struct wide v = wide_add(ap, -wide_fraction(wide_dot(ap, ab), wide_dot(ab, ab)), ab);
    return wide_dot(v, v);
}

// Squared distance of two segments: inside both when the common perpendicular hits both, else at one of the ends.
static inline long double oracle_segment_segment(const struct wide s[2], const struct wide t[2])
{
    long double best = oracle_point_segment(s[0], t[0], t[1]), other = oracle_point_segment(s[1], t[0], t[1]);
    best = other < best ? other : best;
    for (int i = 0; i < 2; i++) {
        other = oracle_point_segment(t[i], s[0], s[1]);
        best = other < best ? other : best;
    }
    const struct wide u = wide_sub(s[1], s[0]), w = wide_sub(t[1], t[0]), r = wide_sub(s[0], t[0]);
    const struct wide n = wide_cross(u, w);
    const long double nn = wide_dot(n, n);
    if (!(nn > 0))
        return best;
    const long double at_s = wide_dot(wide_cross(w, r), n) / nn, at_t = wide_dot(wide_cross(u, r), n) / nn;
    if (at_s >= 0 && at_s <= 1 && at_t >= 0 && at_t <= 1) {
        const struct wide v = wide_add(wide_add(r, at_s, u), -at_t, w);
        other = wide_dot(v, v);
        best = other < best ? other : best;
    }
    return best;
}

// Squared distance of a point to the inside of a triangle; HUGE_VAL when its foot is not there. Edges are pairs.
static inline long double oracle_point_triangle(struct wide p, struct wide a, struct wide b, struct wide c)
{
    const struct wide ab = wide_sub(b, a), ac = wide_sub(c, a), n = wide_cross(ab, ac), ap = wide_sub(p, a);
    const long double nn = wide_dot(n, n);
    if (!(nn > 0))
        return (long double)HUGE_VAL;
    const long double at_b = wide_dot(wide_cross(ap, ac), n) / nn, at_c = wide_dot(wide_cross(ab, ap), n) / nn;
    if (!(at_b >= 0 && at_c >= 0 && at_b + at_c <= 1))
        return (long double)HUGE_VAL;
    const struct wide v = wide_add(wide_add(ap, -at_b, ab), -at_c, ac);
    return wide_dot(v, v);
}

// Distance of two hulls: vertices to triangles of the other, and edges to edges.
static inline long double oracle_apart(const struct wide *v, int n, const struct wide *w, int m)
{
    long double best = (long double)HUGE_VAL, other;
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++) {
            const struct wide edge[2] = {v[i], v[j]};
            for (int k = 0; k < m; k++)
                for (int l = 0; l <= k; l++) {
                    const struct wide other_edge[2] = {w[k], w[l]};
                    other = oracle_segment_segment(edge, other_edge);
                    best = other < best ? other : best;
                    for (int x = 0; x < l; x++) {
                        other = j == i ? oracle_point_triangle(v[i], w[k], w[l], w[x]) : best;
                        best = other < best ? other : best;
                    }
                    for (int x = 0; x < j; x++) {
                        other = l == k ? oracle_point_triangle(w[k], v[i], v[j], v[x]) : best;
                        best = other < best ? other : best;
                    }
                }
        }
    return sqrtl(best);
}

// --- overlapping ---

// The least motion along the normal of two edges or against it that parts two sets of points; smaller of *depth and
// that. Edges that are parallel but for rounding have no normal.
static inline void oracle_part(const struct wide *v, int n, const struct wide *w, int m, const struct wide edge[2],
                               long double *depth)
{
    const struct wide normal = wide_cross(edge[0], edge[1]);
    const long double square = wide_dot(normal, normal), length = sqrtl(square);
    if (!(square > 1e-24L * wide_dot(edge[0], edge[0]) * wide_dot(edge[1], edge[1])))
        return;
    long double low[2] = {(long double)HUGE_VAL, (long double)HUGE_VAL}, high[2] = {-low[0], -low[0]};
    for (int i = 0; i < n + m; i++) {
        const long double height = wide_dot(i < n ? v[i] : w[i - n], normal);
        low[i >= n] = height < low[i >= n] ? height : low[i >= n];
        high[i >= n] = height > high[i >= n] ? height : high[i >= n];
    }
    const long double up = high[1] - low[0], down = high[0] - low[1];
    const long double least = (up < down ? up : down) / length;
    *depth = least < *depth ? least : *depth;
}

// Every face of the difference is a face of one hull, or spanned by an edge of each.
static inline long double oracle_depth(const struct wide *v, int n, const struct wide *w, int m)
{
    long double depth = (long double)HUGE_VAL;
    for (int side = 0; side < 2; side++) {
        const struct wide *x = side ? w : v;
        for (int i = 0; i < (side ? m : n); i++)
            for (int j = 0; j < i; j++)
                for (int k = 0; k < j; k++) {
                    const struct wide edges[2] = {wide_sub(x[j], x[i]), wide_sub(x[k], x[i])};
                    oracle_part(v, n, w, m, edges, &depth);
                }
    }
    for (int i = 0; i < n; i++)
        for (int j = 0; j < i; j++)
            for (int k = 0; k < m; k++)
                for (int l = 0; l < k; l++) {
                    const struct wide edges[2] = {wide_sub(v[j], v[i]), wide_sub(w[l], w[k])};
                    oracle_part(v, n, w, m, edges, &depth);
                }
    return depth;
}

// Points relative to one of them: nothing is lost far from the origin.
static inline void oracle_points(const double *points, int n, const double origin[3], struct wide v[64])
{
    for (int i = 0; i < n; i++)
        v[i] = wide_sub(wide_of(&points[3 * i]), wide_of(origin));
}

// Distance of the hulls of n and of m points that are apart, at most 64 each.
static inline long double oracle_apart_points(const double *a, int n, const double *b, int m)
{
    struct wide v[64], w[64];
    oracle_points(a, n, b, v);
    oracle_points(b, m, b, w);
    return oracle_apart(v, n, w, m);
}

// Signed distance of the hulls of n and of m points, at most 64 each.
static inline long double oracle_distance(const double *a, int n, const double *b, int m)
{
    struct wide v[64], w[64];
    oracle_points(a, n, b, v);
    oracle_points(b, m, b, w);
    // Two hulls in one plane have a depth of rounding beside each other too: one inside the other is no farther from
    // its surface than it is deep.
    const long double depth = oracle_depth(v, n, w, m), apart = oracle_apart(v, n, w, m);
    return depth > 0 && depth < (long double)HUGE_VAL && apart <= depth + 1e-15L ? -depth : apart;
}

#endif
