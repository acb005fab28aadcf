// SPDX-License-Identifier: BSD-3-Clause
// GJK with a stop by the duality gap: the distance is known from both sides when the search ends.
//
// Units    metres.
// Frames   see gjk.h.
// Arrays   see gjk.h.
// Memory   one simplex of the caller's.
// Errors   see gjk.h.
#include "collision/gjk.h"

#include "base/vec.h"           // lw_vec_*
#include "collision/distance.h" // LW_DISTANCE_*

#include <math.h>    // sqrt, HUGE_VAL, NAN
#include <stdbool.h> // bool

static void set_point(const struct lw_gjk_query *query, struct lw_simplex *s, int i, int a, int b)
{
    double x[3], y[3];
    lw_cloud_point(&query->a, a, x);
    lw_cloud_point(&query->b, b, y);
    lw_vec_sub(x, y, s->w[i]);
    s->a[i] = (uint8_t)a;
    s->b[i] = (uint8_t)b;
}

void lw_gjk_load(const struct lw_gjk_query *query, struct lw_simplex *s)
{
    for (int i = 0; i < s->count; i++)
        set_point(query, s, i, s->a[i], s->b[i]);
}

// Adds the point of a - b that is deepest against a direction. False when the simplex has it already.
static bool add_support(const struct lw_gjk_query *query, struct lw_simplex *s, const double direction[3])
{
    const double against[3] = {-direction[0], -direction[1], -direction[2]};
    const int a = lw_cloud_support(&query->a, against), b = lw_cloud_support(&query->b, direction);
    set_point(query, s, s->count, a, b);
    for (int i = 0; i < s->count; i++)
        if (s->a[i] == a && s->b[i] == b)
            return false;
    return true;
}

// Nearest point of the simplex to start from: the given one, or the support towards b's centre. False when that is no
// number.
static bool start(const struct lw_gjk_query *query, struct lw_simplex *s, struct lw_gjk_result *out)
{
    if (s->count > 0) {
        lw_gjk_load(query, s);
    } else {
        double first[3], last[3];
        lw_cloud_point(&query->a, 0, first);
        lw_cloud_point(&query->a, query->a.count - 1, last);
        lw_vec_add_scaled(1, last, first);
        (void)add_support(query, s, first); // an empty simplex has nothing yet
        s->count = 1;
        out->iterations = 1;
    }
    return query->size < HUGE_VAL && lw_simplex_reduce(s, HUGE_VAL);
}

void lw_gjk(const struct lw_gjk_query *query, struct lw_simplex *s, struct lw_gjk_result *out)
{
    const double touch = 1e-11 * query->size;
    *out = (struct lw_gjk_result){.bound = 0};
    if (!start(query, s, out)) {
        s->square = s->v[0] = s->v[1] = s->v[2] = (double)NAN;
        out->flags = LW_DISTANCE_STALLED;
        return;
    }
    for (; out->iterations < query->cap; out->iterations++) {
        if (s->square <= touch * touch || s->count == 4) {
            out->flags = LW_DISTANCE_CORE;
            return;
        }
        // vw / |v| is a lower bound of the distance, |v| an upper one.
        const bool fresh = add_support(query, s, s->v);
        const double vw = lw_vec_dot(s->v, s->w[s->count]), length = sqrt(s->square), gap = s->square - vw;
        if (vw > query->far * length) {
            out->iterations++;
            out->bound = vw / length;
            out->flags = LW_DISTANCE_FAR;
            return;
        }
        if (!fresh || gap <= 1e-12 * s->square || gap <= 1e-13 * length || gap <= 8e-16 * query->size * length) {
            out->iterations++;
            return;
        }
        s->count++;
        if (!lw_simplex_reduce(s, s->square)) {
            out->iterations++;
            out->flags = LW_DISTANCE_STALLED;
            return;
        }
    }
    out->flags = s->square <= touch * touch || s->count == 4 ? LW_DISTANCE_CORE : LW_DISTANCE_CAPPED;
}

void lw_gjk_point(const struct lw_gjk_query *query, const struct lw_simplex *s, double qa[3])
{
    double point[3];
    for (int k = 0; k < 3; k++)
        qa[k] = 0;
    for (int i = 0; i < s->count; i++) {
        lw_cloud_point(&query->a, s->a[i], point);
        lw_vec_add_scaled(s->lambda[i], point, qa);
    }
}
