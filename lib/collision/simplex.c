// SPDX-License-Identifier: BSD-3-Clause
// Nearest point of a simplex to the origin.
//
// Units    metres.
// Frames   see simplex.h.
// Arrays   see simplex.h.
// Memory   none.
// Errors   none.
#include "collision/simplex.h"

#include "base/vec.h" // lw_vec_*

#include <math.h>   // fabs, sqrt, HUGE_VAL
#include <string.h> // memcpy

// A nearest point on part of a simplex: the points it needs, in order, and their weights.
struct nearest {
    double v[3], square;
    int count, keep[3];
    double lambda[3];
};

static void at_point(const struct lw_simplex *s, int i, struct nearest *out)
{
    memcpy(out->v, s->w[i], sizeof out->v);
    out->square = lw_vec_dot(out->v, out->v);
    out->count = 1;
    out->keep[0] = i;
    out->lambda[0] = 1;
}

static void on_segment(const struct lw_simplex *s, int i, int j, struct nearest *out)
{
    double ij[3];
    lw_vec_sub(s->w[j], s->w[i], ij);
    const double along = -lw_vec_dot(s->w[i], ij), square = lw_vec_dot(ij, ij);
    if (!(along > 0)) {
        at_point(s, i, out);
        return;
    }
    if (along >= square) {
        at_point(s, j, out);
        return;
    }
    const double t = along / square;
    for (int k = 0; k < 3; k++)
        out->v[k] = s->w[i][k] + t * ij[k];
    out->square = lw_vec_dot(out->v, out->v);
    out->count = 2;
    out->keep[0] = i;
    out->keep[1] = j;
    out->lambda[0] = 1 - t;
    out->lambda[1] = t;
}

static void keep_nearer(const struct nearest *candidate, struct nearest *best)
{
    if (candidate->square < best->square)
        *best = *candidate;
}

// Points of the edge across from corner k of a triangle, of the face across from point k of a tetrahedron, in order.
static const int edge_across[3][2] = {{1, 2}, {0, 2}, {0, 1}};
static const int face_across[4][3] = {{1, 2, 3}, {0, 2, 3}, {0, 1, 3}, {0, 1, 2}};

// Nearest point on the edges of a triangle that `edges` names by the corners across.
static void on_edges(const struct lw_simplex *s, const int corner[3], int edges, struct nearest *out)
{
    struct nearest candidate;
    *out = (struct nearest){.square = HUGE_VAL};
    for (int k = 0; k < 3; k++) {
        if (!(edges & 1 << k))
            continue;
        on_segment(s, corner[edge_across[k][0]], corner[edge_across[k][1]], &candidate);
        keep_nearer(&candidate, out);
    }
}

// (a x b) . c
static double triple(const double a[3], const double b[3], const double c[3])
{
    double cross[3];
    lw_vec_cross(a, b, cross);
    return lw_vec_dot(cross, c);
}

static void on_triangle(const struct lw_simplex *s, int i, int j, int k, struct nearest *out)
{
    const int corner[3] = {i, j, k};
    double ij[3], ik[3], n[3], foot[3], from_foot[3][3], weight[3];
    lw_vec_sub(s->w[j], s->w[i], ij);
    lw_vec_sub(s->w[k], s->w[i], ik);
    lw_vec_cross(ij, ik, n);
    const double square = lw_vec_dot(n, n);
    if (!(square > 1e-28 * lw_vec_dot(ij, ij) * lw_vec_dot(ik, ik))) {
        on_edges(s, corner, 7, out);
        return;
    }

    // Foot of the perpendicular, and its barycentric weights by areas around it.
    const double height = lw_vec_dot(s->w[i], n) / square;
    int beyond = 0;
    for (int x = 0; x < 3; x++)
        foot[x] = height * n[x];
    for (int p = 0; p < 3; p++)
        lw_vec_sub(s->w[corner[p]], foot, from_foot[p]);
    for (int p = 0; p < 3; p++) {
        weight[p] = triple(from_foot[(p + 1) % 3], from_foot[(p + 2) % 3], n);
        beyond |= !(weight[p] > 0) << p;
    }
    if (beyond != 0) {
        on_edges(s, corner, beyond, out);
        return;
    }
    const double sum = weight[0] + weight[1] + weight[2];
    memcpy(out->v, foot, sizeof foot);
    out->square = lw_vec_dot(foot, foot);
    out->count = 3;
    for (int p = 0; p < 3; p++) {
        out->keep[p] = corner[p];
        out->lambda[p] = weight[p] / sum;
    }
}

// Nearest point on the faces of a tetrahedron that `faces` names by the points across.
static void on_faces(const struct lw_simplex *s, int faces, struct nearest *out)
{
    struct nearest candidate;
    *out = (struct nearest){.square = HUGE_VAL};
    for (int k = 0; k < 4; k++) {
        if (!(faces & 1 << k))
            continue;
        on_triangle(s, face_across[k][0], face_across[k][1], face_across[k][2], &candidate);
        keep_nearer(&candidate, out);
    }
}

// False when the origin is inside.
static bool on_tetrahedron(const struct lw_simplex *s, struct nearest *out)
{
    double edge[3][3];
    for (int k = 0; k < 3; k++)
        lw_vec_sub(s->w[k + 1], s->w[0], edge[k]);
    const double det = triple(edge[0], edge[1], edge[2]);
    const double size = lw_vec_dot(edge[0], edge[0]) * lw_vec_dot(edge[1], edge[1]) * lw_vec_dot(edge[2], edge[2]);
    if (!(fabs(det) > 1e-13 * sqrt(size))) {
        on_faces(s, 15, out);
        return true;
    }
    // Barycentric coordinates of the origin, up to the sign of det.
    const double part[4] = {triple(s->w[1], s->w[2], s->w[3]), -triple(edge[1], edge[2], s->w[0]),
                            triple(edge[0], edge[2], s->w[0]), -triple(edge[0], edge[1], s->w[0])};
    int beyond = 0;
    for (int k = 0; k < 4; k++)
        beyond |= !(det > 0 ? part[k] > 0 : part[k] < 0) << k;
    if (beyond == 0)
        return false;
    on_faces(s, beyond, out);
    return true;
}

// Drops the points that are not needed; those that are come in order.
static void keep_only(struct lw_simplex *s, const struct nearest *found)
{
    for (int k = 0; k < found->count; k++) {
        const int from = found->keep[k];
        s->lambda[k] = found->lambda[k];
        if (from == k)
            continue;
        memcpy(s->w[k], s->w[from], sizeof s->w[k]);
        s->a[k] = s->a[from];
        s->b[k] = s->b[from];
    }
    s->count = found->count;
    memcpy(s->v, found->v, sizeof s->v);
    s->square = found->square;
}

bool lw_simplex_reduce(struct lw_simplex *s, double below)
{
    struct nearest found;
    switch (s->count) {
    case 1: at_point(s, 0, &found); break;
    case 2: on_segment(s, 0, 1, &found); break;
    case 3: on_triangle(s, 0, 1, 2, &found); break;
    default:
        if (!on_tetrahedron(s, &found)) {
            memset(s->v, 0, sizeof s->v);
            s->square = 0;
            return true;
        }
    }
    if (!(found.square < below)) {
        s->count--;
        return false;
    }
    keep_only(s, &found);
    return true;
}
