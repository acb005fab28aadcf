// SPDX-License-Identifier: BSD-3-Clause
// EPA: a polytope inside the difference a - b grows towards the side of it that is nearest to the origin. The support
// in the direction of any face bounds the depth from above, the nearest face bounds it from below.
//
// Units    metres.
// Frames   see gjk.h.
// Arrays   see gjk.h.
// Memory   see epa.h.
// Errors   see epa.h.
#include "collision/epa.h"

#include "base/vec.h"           // lw_vec_*
#include "collision/closed.h"   // lw_closed_perpendicular
#include "collision/distance.h" // LW_DISTANCE_STALLED

#include <math.h>    // sqrt, fabs, HUGE_VAL
#include <stdbool.h> // bool
#include <string.h>  // memcpy

enum { POINTS = 96, FACES = 192, FIRST = 14 };

// Parts of the size of the difference: what is flat, when the bounds have met, what a face sees.
static const double flat_part = 1e-9, met_part = 1e-11, seen_part = 1e-13;

struct face {
    double n[3], offset; // unit, outwards; infinite offset for a sliver
    uint8_t p[3];        // counter-clockwise from outside
};

struct polytope {
    const struct lw_gjk_query *query;
    struct lw_epa_result *best;
    double scale;
    int points, faces;
    double w[POINTS][3];
    struct face face[FACES];
};

// Point of a - b farthest in a unit direction. Its height is a depth that parts the two: the least one seen is kept.
static double support(struct polytope *t, const double direction[3], double w[3])
{
    const double against[3] = {-direction[0], -direction[1], -direction[2]};
    double b[3];
    lw_cloud_point(&t->query->a, lw_cloud_support(&t->query->a, direction), w);
    lw_cloud_point(&t->query->b, lw_cloud_support(&t->query->b, against), b);
    lw_vec_sub(w, b, w);
    const double height = lw_vec_dot(w, direction);
    if (height < t->best->depth) {
        t->best->depth = height;
        memcpy(t->best->out, direction, sizeof t->best->out);
    }
    return height;
}

static bool scale_to_unit(double v[3])
{
    const double length = lw_vec_norm(v);
    for (int i = 0; i < 3; i++)
        v[i] /= length > 0 ? length : 1;
    return length > 0;
}

// --- the first tetrahedron ---

// Supports in the directions of the axes and of the diagonals.
static void first_points(struct polytope *t, double w[FIRST][3])
{
    for (int k = 0; k < FIRST; k++) {
        double direction[3] = {0};
        if (k < 6)
            direction[k / 2] = k % 2 ? -1 : 1;
        for (int i = 0; k >= 6 && i < 3; i++)
            direction[i] = k >> i & 1 ? -sqrt(1.0 / 3) : sqrt(1.0 / 3);
        (void)support(t, direction, w[k]);
    }
}

// The two points farthest apart. Returns their distance.
static double farthest_pair(double w[FIRST][3], double pair[2][3])
{
    double longest = -1;
    for (int i = 0; i < FIRST; i++)
        for (int j = 0; j < i; j++) {
            double gap[3];
            lw_vec_sub(w[i], w[j], gap);
            if (lw_vec_dot(gap, gap) <= longest)
                continue;
            longest = lw_vec_dot(gap, gap);
            memcpy(pair[0], w[i], sizeof pair[0]);
            memcpy(pair[1], w[j], sizeof pair[1]);
        }
    return sqrt(longest);
}

// The point farthest from the line of the first two corners. Returns its distance; n is perpendicular to all three.
static double farthest_from_line(double (*w)[3], int count, double corner[3][3], double n[3])
{
    double u[3], farthest = -1;
    lw_vec_sub(corner[1], corner[0], u);
    (void)scale_to_unit(u); // not zero: the pair is apart
    for (int i = 0; i < count; i++) {
        double from[3], across[3];
        lw_vec_sub(w[i], corner[0], from);
        lw_vec_cross(u, from, across);
        if (lw_vec_dot(across, across) <= farthest)
            continue;
        farthest = lw_vec_dot(across, across);
        memcpy(corner[2], w[i], sizeof corner[2]);
        memcpy(n, across, sizeof across);
    }
    return sqrt(farthest);
}

// Supports across the line of the first two corners, both ways of two directions: they miss nothing beside it, as the
// first ones may.
static void points_across(struct polytope *t, double w[4][3])
{
    double u[3], across[2][3], back[3];
    lw_vec_sub(t->w[1], t->w[0], u);
    (void)scale_to_unit(u); // not zero: the pair is apart
    lw_closed_perpendicular(u, across[0]);
    lw_vec_cross(u, across[0], across[1]);
    for (int k = 0; k < 2; k++) {
        for (int i = 0; i < 3; i++)
            back[i] = -across[k][i];
        (void)support(t, across[k], w[2 * k]);
        (void)support(t, back, w[2 * k + 1]);
    }
}

static void set_face(struct polytope *t, struct face *f, int i, int j, int k)
{
    double ij[3], ik[3];
    lw_vec_sub(t->w[j], t->w[i], ij);
    lw_vec_sub(t->w[k], t->w[i], ik);
    lw_vec_cross(ij, ik, f->n);
    const double length = lw_vec_norm(f->n);
    const bool sliver = !(length > 1e-11 * lw_vec_norm(ij) * lw_vec_norm(ik));
    for (int x = 0; x < 3; x++)
        f->n[x] /= length > 0 ? length : 1;
    f->offset = sliver ? HUGE_VAL : lw_vec_dot(f->n, t->w[i]);
    f->p[0] = (uint8_t)i;
    f->p[1] = (uint8_t)j;
    f->p[2] = (uint8_t)k;
}

// Widest point, line, triangle, tetrahedron of the difference. False when it is flat: then some direction across it has
// given the depth.
static bool find_tetrahedron(struct polytope *t)
{
    double w[FIRST][3], n[3], low[3], back[3];
    first_points(t, w);
    if (farthest_pair(w, t->w) < flat_part * t->scale)
        return false;
    if (farthest_from_line(w, FIRST, t->w, n) < flat_part * t->scale) {
        points_across(t, w);
        if (farthest_from_line(w, 4, t->w, n) < flat_part * t->scale)
            return false;
    }
    (void)scale_to_unit(n); // not zero: the third point is off the line
    for (int i = 0; i < 3; i++)
        back[i] = -n[i];
    const double base = lw_vec_dot(n, t->w[0]);
    const double above = support(t, n, t->w[3]) - base, below = support(t, back, low) + base;
    if (above < flat_part * t->scale && below < flat_part * t->scale)
        return false;
    t->points = 4;
    t->faces = 4;
    if (below > above)
        memcpy(t->w[3], low, sizeof low);
    // Turn the base so that every face looks outwards.
    const int j = below > above ? 1 : 2, k = 3 - j;
    set_face(t, &t->face[0], 0, j, k);
    set_face(t, &t->face[1], 0, k, 3);
    set_face(t, &t->face[2], k, j, 3);
    set_face(t, &t->face[3], j, 0, 3);
    return true;
}

// --- growth ---

// Directed edges of faces that went; those whose opposite is not among them border the hole.
struct edges {
    int count;
    uint8_t from[3 * FACES], to[3 * FACES];
};

// Takes out the faces that see a point, and the nearest one in any case.
static void open_hole(struct polytope *t, int nearest, const double w[3], struct edges *edges)
{
    int kept = 0;
    edges->count = 0;
    for (int i = 0; i < t->faces; i++) {
        const struct face *f = &t->face[i];
        if (i != nearest && !(lw_vec_dot(f->n, w) - f->offset > seen_part * t->scale)) {
            t->face[kept++] = *f;
            continue;
        }
        for (int k = 0; k < 3; k++) {
            edges->from[edges->count] = f->p[k];
            edges->to[edges->count++] = f->p[(k + 1) % 3];
        }
    }
    t->faces = kept;
}

static bool has_opposite(const struct edges *edges, int i)
{
    for (int k = 0; k < edges->count; k++)
        if (edges->from[k] == edges->to[i] && edges->to[k] == edges->from[i])
            return true;
    return false;
}

// Joins the border of the hole with the newest point. False when the pool of faces is full.
static bool close_hole(struct polytope *t, const struct edges *edges)
{
    for (int i = 0; i < edges->count; i++) {
        if (has_opposite(edges, i))
            continue;
        if (t->faces == FACES)
            return false;
        set_face(t, &t->face[t->faces++], edges->from[i], edges->to[i], t->points - 1);
    }
    return true;
}

static int nearest_face(const struct polytope *t)
{
    int nearest = 0;
    for (int i = 1; i < t->faces; i++)
        if (t->face[i].offset < t->face[nearest].offset)
            nearest = i;
    return nearest;
}

// Grows the polytope until the bounds of the depth meet. False when a pool or the iterations run out.
static bool grow(struct polytope *t, int cap)
{
    struct edges edges;
    while (t->best->iterations < cap && t->points < POINTS && t->faces > 0) {
        const int nearest = nearest_face(t);
        const double least = t->face[nearest].offset;
        if (!(least < HUGE_VAL))
            return false;
        double *w = t->w[t->points];
        (void)support(t, t->face[nearest].n, w); // keeps the least depth
        t->best->iterations++;
        if (t->best->depth - least <= met_part * t->scale)
            return true;
        open_hole(t, nearest, w, &edges);
        t->points++;
        if (!close_hole(t, &edges))
            return false;
    }
    return false;
}

void lw_epa(const struct lw_gjk_query *query, int cap, struct lw_epa_result *out)
{
    struct polytope t;
    *out = (struct lw_epa_result){.depth = HUGE_VAL};
    t.query = query;
    t.best = out;
    t.scale = query->size;
    if (find_tetrahedron(&t) && !grow(&t, cap))
        out->flags = LW_DISTANCE_STALLED;
}
