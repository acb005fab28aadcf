// SPDX-License-Identifier: BSD-3-Clause
// Looking around.
//
// Units    see surroundings.h.
// Frames   base frame of the arm.
// Arrays   see surroundings.h.
// Memory   none.
// Errors   see surroundings.h.
#include "controller/surroundings.h"

#include "base/vec.h" // lw_vec_*

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

enum lw_status lw_surroundings_place(const struct lw_arm *arm, const struct lw_body *body, const double q[LW_NJ],
                                     struct lw_surroundings *out)
{
    const enum lw_status status = lw_arm_fk(arm, q, out->frame);
    if (status == LW_OK)
        lw_body_place(body, out->frame, &out->placed);
    return status;
}

double lw_surroundings_speed(const struct lw_surroundings *s, const struct lw_body *body, const double qd[LW_NJ])
{
    double fastest = 0;
    struct lw_twist twist[LW_NJ];
    lw_arm_twists(s->frame, qd, twist);
    for (int i = 0; i < body->count; i++) {
        // The ends of the axis bound all between them; the surface turns around it.
        const struct lw_capsule *c = &s->placed.capsule[i];
        const struct lw_twist *t = &twist[body->part[i].link - 1];
        const double around = c->r * lw_vec_norm(t->angular);
        for (int end = 0; end < 2; end++) {
            double velocity[3];
            lw_vec_cross(t->angular, end == 0 ? c->a : c->b, velocity);
            lw_vec_add_scaled(1, t->at_base, velocity);
            fastest = fmax(fastest, lw_vec_norm(velocity) + around);
        }
    }
    return fastest;
}

void lw_surroundings_look(const struct lw_eyes *eyes, struct lw_surroundings *out)
{
    const struct lw_near_query query = {.body = eyes->body,
                                        .placed = &out->placed,
                                        .world = eyes->world,
                                        .time_ns = eyes->time_ns,
                                        .d_max = eyes->reach,
                                        .warm = eyes->warm};
    lw_near_range(&query, &out->near);
    lw_near_self(eyes->body, &out->placed, eyes->self_reach, &out->near);
    find_fixed(eyes->body, out);
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
