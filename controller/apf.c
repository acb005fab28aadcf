// SPDX-License-Identifier: BSD-3-Clause
// Potential field: attraction pulls the tip, everything near pushes the nearest point of every link, and the joints
// follow qdot = sum J_i^T f_rep(x_i) + J_P^T f_total(p_P), equation (6), evaluated by the wrench recursion.
//
// Units    metres, radians, seconds.
// Frames   base frame of the arm.
// Arrays   see law.h.
// Memory   see law.h.
// Errors   see law.h.
#include "controller/apf.h"

#include "base/vec.h" // lw_vec_*

#include <math.h> // fmax

static const double goal_reached = 1e-12;     // m, no direction to pull in below this
static const double tolerance_default = 0.02; // m

void lw_apf_attraction(const struct lw_apf_params *params, const double tip[3], const double goal[3], double force[3])
{
    double to_goal[3];
    lw_vec_sub(goal, tip, to_goal);
    const double deviation = lw_vec_norm(to_goal);
    const double reach = params->attraction == LW_ATTRACTION_CONE_PAR ? fmax(deviation, params->r0) : deviation;
    for (int i = 0; i < 3; i++)
        force[i] = deviation < goal_reached ? 0.0 : params->k_a * to_goal[i] / reach;
}

double lw_apf_repulsion(const struct lw_apf_field *field, double distance)
{
    if (distance > field->rho)
        return 0.0;
    const double d = fmax(distance, field->distance_min);
    if (field->gamma == 1)
        return field->eta / (2 * d * d);
    // Above rho only where distance_min exceeds it: then there is no field.
    return field->eta * fmax(1 / d - 1 / field->rho, 0.0) / (d * d);
}

struct lw_apf_field lw_apf_field_of(const struct lw_apf_params *params, bool self)
{
    return (struct lw_apf_field){.gamma = params->gamma,
                                 .eta = self ? params->eta_self : params->eta,
                                 .rho = self ? params->rho_self : params->rho_rep,
                                 .distance_min = params->distance_min};
}

// Pushes a part away from an obstacle, along the normal or, with a circulation c, turned aside by c x (-n).
static void repel_obstacle(const struct lw_apf_params *params, const struct lw_law_input *in,
                           const struct lw_near *pair, struct lw_wrench *wrench)
{
    const struct lw_apf_field field = lw_apf_field_of(params, false);
    const struct lw_distance *d = &pair->distance;
    const double closing = fmax(lw_vec_dot(d->n, pair->velocity), 0.0);
    const double size = lw_apf_repulsion(&field, d->d - params->approach_s * closing);
    if (size == 0.0)
        return;
    double force[3] = {0}, aside[3];
    lw_vec_add_scaled(size, d->n, force);
    lw_vec_cross(in->circulation, d->n, aside);
    lw_vec_add_scaled(-size, aside, force);
    lw_wrench_add(wrench, in->body->part[pair->part].link, d->pa, force);
}

// Pushes two parts of the arm apart.
static void repel_self(const struct lw_apf_params *params, const struct lw_law_input *in, const struct lw_near *pair,
                       struct lw_wrench *wrench)
{
    const struct lw_apf_field field = lw_apf_field_of(params, true);
    const struct lw_distance *d = &pair->distance;
    const double size = lw_apf_repulsion(&field, d->d);
    double force[3] = {0}, back[3] = {0};
    lw_vec_add_scaled(size, d->n, force);
    lw_vec_add_scaled(-size, d->n, back);
    lw_wrench_add(wrench, in->body->part[pair->part].link, d->pa, force);
    lw_wrench_add(wrench, in->body->part[pair->other].link, d->pb, back);
}

static struct lw_law_reach apf_reach(const struct lw_law_params *law, double speed)
{
    const struct lw_apf_params *params = &law->apf;
    return (struct lw_law_reach){.obstacles = params->rho_rep + params->approach_s * speed, .self = params->rho_self};
}

// Inside the parabolic zone the tip comes ever slower and still arrives.
static double apf_tolerance(const struct lw_law_params *law)
{
    const bool slows = law->apf.attraction == LW_ATTRACTION_CONE_PAR;
    return slows ? fmax(tolerance_default, law->apf.r0) : tolerance_default;
}

static void apf_step(const struct lw_law_params *law, const struct lw_law_input *in, double qd[LW_NJ])
{
    const struct lw_apf_params *params = &law->apf;
    const struct lw_surroundings *around = in->around;
    struct lw_wrench wrench = {0};

    // Attraction at the tip, equation (5).
    const double *tip = around->frame[LW_NJ - 1].p;
    double force[3];
    lw_apf_attraction(params, tip, in->goal, force);
    lw_wrench_add(&wrench, LW_NJ, tip, force);

    // Repulsion at the nearest point of every part, equation (4).
    for (int i = 0; i < around->near.count; i++) {
        const struct lw_near *pair = &around->near.pair[i];
        if (pair->fixed)
            continue;
        if (pair->obstacle != 0)
            repel_obstacle(params, in, pair, &wrench);
        else
            repel_self(params, in, pair, &wrench);
    }

    // Joint velocities, equation (6).
    lw_arm_joint_effect(around->frame, &wrench, qd);
}

const struct lw_law lw_apf_law = {.name = "apf", .reach = apf_reach, .tolerance = apf_tolerance, .step = apf_step};
