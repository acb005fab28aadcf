// SPDX-License-Identifier: BSD-3-Clause
// Distance of shapes that are known by support functions alone: GJK with a stop by the duality gap. libccd brings the
// type of the functions, its vectors and its test for overlap; it has no distance of shapes apart.
//
// Units    metres.
// Frames   see custom.h; the search runs relative to the second shape's centre.
// Arrays   see custom.h.
// Memory   none.
// Errors   see custom.h.
#include "collision/custom.h"

#include "base/vec.h"          // lw_vec_*
#include "collision/closed.h"  // lw_closed_apart
#include "collision/clouds.h"  // lw_clouds_of
#include "collision/simplex.h" // lw_simplex_reduce

#include <math.h>    // sqrt, isfinite, HUGE_VAL, NAN
#include <stdbool.h> // bool
#include <string.h>  // memcpy

// Rounds of the search, and of libccd's: without a cap of ours it has none.
enum { CAP = 100 };

// One side of a query: a shape's core relative to an origin, as libccd's functions see it.
struct side {
    const struct lw_shape *shape;
    double origin[3];
    double room[LW_HULL_ROOM];
    struct lw_cloud cloud; // unless the shape is custom
};

static void set_side(const struct lw_shape *shape, const double origin[3], struct side *side)
{
    side->shape = shape;
    memcpy(side->origin, origin, sizeof side->origin);
    if (shape->kind != LW_CUSTOM)
        side->cloud = lw_clouds_of(shape, origin, side->room);
}

// ccd_support_fn of a side.
static void support(const void *object, const ccd_vec3_t *direction, ccd_vec3_t *out)
{
    const struct side *side = object;
    if (side->shape->kind != LW_CUSTOM) {
        lw_cloud_point(&side->cloud, lw_cloud_support(&side->cloud, direction->v), out->v);
        return;
    }
    const struct lw_custom *custom = side->shape->custom;
    custom->support(custom->object, direction, out);
    lw_vec_sub(out->v, side->origin, out->v);
}

double lw_custom_reach(const struct lw_shape *shape, const double n[3], const double origin[3])
{
    const struct lw_custom *custom = shape->custom;
    const ccd_vec3_t direction = {{n[0], n[1], n[2]}};
    ccd_vec3_t x;
    custom->support(custom->object, &direction, &x);
    lw_vec_sub(x.v, origin, x.v);
    return lw_vec_dot(x.v, n);
}

// --- the search ---

// Nearest points of two sides; qa of the simplex's points on the first.
struct search {
    const struct side *a, *b;
    struct lw_simplex simplex;
    double xa[4][3];
};

static bool same_point(const double x[3], const double y[3])
{
    return x[0] == y[0] && x[1] == y[1] && x[2] == y[2];
}

// Adds the point of a - b deepest against a direction. False when the simplex has it already.
static bool add_support(struct search *g, const double direction[3])
{
    const ccd_vec3_t towards = {{direction[0], direction[1], direction[2]}};
    ccd_vec3_t against, xa, xb;
    struct lw_simplex *s = &g->simplex;
    ccdVec3Copy(&against, &towards);
    ccdVec3Scale(&against, -1);
    support(g->a, &against, &xa);
    support(g->b, &towards, &xb);
    lw_vec_sub(xa.v, xb.v, s->w[s->count]);
    // The simplex names the point on the first side by a free place in xa, and carries the name along.
    int used = 0, place = 0;
    for (int i = 0; i < s->count; i++)
        used |= 1 << s->a[i];
    while (used >> place & 1)
        place++;
    s->a[s->count] = (uint8_t)place;
    memcpy(g->xa[place], xa.v, sizeof g->xa[place]);
    for (int i = 0; i < s->count; i++)
        if (same_point(s->w[i], s->w[s->count]))
            return false;
    return true;
}

// Searches from a direction on. Returns flags as lw_gjk does; the bound goes with FAR.
static int nearest(struct search *g, const double start[3], double far, int *iterations, double *bound)
{
    struct lw_simplex *s = &g->simplex;
    s->count = 0;
    (void)add_support(g, start); // an empty simplex has nothing yet
    s->count = 1;
    if (!lw_simplex_reduce(s, HUGE_VAL)) {
        s->v[0] = s->v[1] = s->v[2] = (double)NAN;
        return LW_DISTANCE_STALLED;
    }
    for (*iterations = 1; *iterations < CAP;) {
        if (s->square < 1e-28 || s->count == 4)
            return LW_DISTANCE_CORE;
        const bool fresh = add_support(g, s->v);
        const double vw = lw_vec_dot(s->v, s->w[s->count]), length = sqrt(s->square), gap = s->square - vw;
        ++*iterations;
        *bound = vw / length;
        if (*bound > far)
            return LW_DISTANCE_FAR;
        if (!fresh || gap <= 1e-12 * s->square || gap <= 1e-12 * length)
            return 0;
        s->count++;
        if (!lw_simplex_reduce(s, s->square))
            return LW_DISTANCE_STALLED;
    }
    return LW_DISTANCE_CAPPED;
}

// libccd's opinion, for a search that ended without a proof.
static bool cores_meet(const struct side *a, const struct side *b)
{
    ccd_t ccd;
    CCD_INIT(&ccd);
    ccd.support1 = support;
    ccd.support2 = support;
    ccd.max_iterations = CAP;
    return ccdGJKIntersect(a, b, &ccd) != 0;
}

void lw_custom_distance(const struct lw_shape *a, const struct lw_shape *b, double d_max, struct lw_distance *out)
{
    struct side side_a, side_b;
    struct search g = {.a = &side_a, .b = &side_b};
    double start[3], bound = 0, qa[3] = {0};
    int iterations = 1;
    set_side(a, b->c, &side_a);
    set_side(b, b->c, &side_b);
    lw_vec_sub(a->c, b->c, start);
    if (!(lw_vec_dot(start, start) > 0))
        start[2] = 1;
    int flags = nearest(&g, start, d_max + a->r + b->r, &iterations, &bound);
    const bool open = flags & (LW_DISTANCE_CAPPED | LW_DISTANCE_STALLED);
    if (open && isfinite(g.simplex.square) && cores_meet(&side_a, &side_b))
        flags = LW_DISTANCE_CORE;
    if (flags & (LW_DISTANCE_FAR | LW_DISTANCE_CORE)) {
        *out = (struct lw_distance){.d = (flags & LW_DISTANCE_FAR ? bound : 0) - a->r - b->r,
                                    .flags = flags | LW_DISTANCE_NO_NORMAL,
                                    .iterations = iterations};
        return;
    }
    for (int i = 0; i < g.simplex.count; i++)
        lw_vec_add_scaled(g.simplex.lambda[i], g.xa[g.simplex.a[i]], qa);
    lw_closed_apart(qa, g.simplex.v, a->r, b->r, out);
    out->flags = flags;
    out->iterations = iterations;
    lw_clouds_shift(b->c, out);
}
