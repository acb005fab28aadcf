// SPDX-License-Identifier: BSD-3-Clause
// Looking around.
//
// Units    see surroundings.h.
// Frames   base frame of the arm.
// Arrays   see surroundings.h.
// Memory   none.
// Errors   see surroundings.h.
#include "controller/surroundings.h"

#include <math.h>   // fabs, fmax
#include <stddef.h> // NULL

// Shoulder and upper arm stand on a table as near as millimetres, and no motion of theirs changes that.
enum { LAST_MOUNTED = 2 };
static const double fixed_within = 0.05; // m
static const double fixed_lever = 0.02;  // m/rad

// Notes near pairs whose distance the joints cannot change: the arm and what it is mounted on.
static void find_fixed(const struct lw_body *body, struct lw_surroundings *s)
{
    for (int i = 0; i < s->near.count; i++) {
        struct lw_near *pair = &s->near.pair[i];
        if (pair->obstacle == 0 || pair->distance.d > fixed_within || body->part[pair->part].link > LAST_MOUNTED)
            continue;
        double gradient[LW_NJ], largest = 0;
        lw_surroundings_gradient(s, body, pair, gradient);
        for (int j = 0; j < LW_NJ; j++)
            largest = fmax(largest, fabs(gradient[j]));
        pair->fixed = largest < fixed_lever;
    }
}

enum lw_status lw_surroundings_look(const struct lw_eyes *eyes, const double q[LW_NJ], struct lw_surroundings *out)
{
    const enum lw_status status = lw_arm_fk(eyes->arm, q, out->frame);
    if (status != LW_OK)
        return status;
    lw_body_place(eyes->body, out->frame, &out->placed);
    const struct lw_near_query query = {.body = eyes->body,
                                        .placed = &out->placed,
                                        .world = eyes->world,
                                        .time_ns = eyes->time_ns,
                                        .d_max = eyes->reach,
                                        .warm = eyes->warm};
    lw_near_range(&query, &out->near);
    lw_near_self(eyes->body, &out->placed, eyes->self_reach, &out->near);
    find_fixed(eyes->body, out);
    return LW_OK;
}

void lw_surroundings_gradient(const struct lw_surroundings *s, const struct lw_body *body, const struct lw_near *pair,
                              double gradient[LW_NJ])
{
    const struct lw_distance *d = &pair->distance;
    double other[LW_NJ];
    lw_arm_point_effect(s->frame, body->part[pair->part].link, d->pa, d->n, gradient);
    if (pair->obstacle != 0)
        return;
    lw_arm_point_effect(s->frame, body->part[pair->other].link, d->pb, d->n, other);
    for (int j = 0; j < LW_NJ; j++)
        gradient[j] -= other[j];
}

const struct lw_near *lw_surroundings_nearest(const struct lw_surroundings *s, bool self)
{
    const struct lw_near *nearest = NULL;
    for (int i = 0; i < s->near.count; i++) {
        const struct lw_near *pair = &s->near.pair[i];
        if ((pair->obstacle == 0) == self && (nearest == NULL || pair->distance.d < nearest->distance.d))
            nearest = pair;
    }
    return nearest;
}
