// SPDX-License-Identifier: BSD-3-Clause
// Potential field: attraction pulls the tip, every obstacle pushes every control point, and the joints follow
// qdot = sum J_i^T f_rep(p_i) + J_P^T f_total(p_P), equation (6), evaluated by the wrench recursion.
//
// Units    metres, radians, seconds.
// Frames   base frame of the arm.
// Arrays   see law.h.
// Memory   see law.h.
// Errors   see law.h.
#include "controller/apf.h"

#include "base/vec.h" // lw_vec_*

#include <math.h> // fmax, INFINITY

static const double goal_reached = 1e-12; // m, no direction to pull in below this

void lw_apf_attraction(const struct lw_apf_params *params, const double tip[3], const double goal[3], double force[3])
{
    double to_goal[3];
    lw_vec_sub(goal, tip, to_goal);
    const double deviation = lw_vec_norm(to_goal);
    const double reach = params->attraction == LW_ATTRACTION_CONE_PAR ? fmax(deviation, params->r0) : deviation;
    for (int i = 0; i < 3; i++)
        force[i] = deviation < goal_reached ? 0.0 : params->k_a * to_goal[i] / reach;
}

double lw_apf_repulsion(const struct lw_apf_params *params, double distance)
{
    if (distance > params->rho_rep)
        return 0.0;
    const double d = fmax(distance, params->distance_min);
    if (params->gamma == 1)
        return params->eta / (2 * d * d);
    // Above rho only where distance_min exceeds it: then there is no field.
    return params->eta * fmax(1 / d - 1 / params->rho_rep, 0.0) / (d * d);
}

// Pushes one control point away from one obstacle, and remembers the nearest pair.
static void repel(const struct lw_apf_params *params, const struct lw_obstacle *obstacle, int point, const double x[3],
                  struct lw_wrench *wrench, struct lw_nearest *nearest)
{
    double away[3], force[3] = {0};
    const double distance = lw_obstacle_distance(obstacle, x, away);
    if (nearest->link == 0 || distance < nearest->clearance)
        *nearest = (struct lw_nearest){.clearance = distance, .link = point, .obstacle = obstacle->id};
    const double size = lw_apf_repulsion(params, distance);
    if (size == 0.0)
        return;
    lw_vec_add_scaled(size, away, force);
    lw_wrench_add(wrench, point, x, force);
}

static void apf_step(const struct lw_law_params *law, const struct lw_law_input *in, struct lw_law_output *out)
{
    const struct lw_apf_params *params = &law->apf;
    struct lw_wrench wrench = {0};
    out->nearest = (struct lw_nearest){.clearance = (double)INFINITY};

    // Attraction at the tip, equation (5).
    double force[3];
    lw_apf_attraction(params, in->frame[LW_NJ - 1].p, in->goal, force);
    lw_wrench_add(&wrench, LW_NJ, in->frame[LW_NJ - 1].p, force);

    // Repulsion at the origins of frames 2..6, equation (4). The first lies on axis 1: it never moves, J_1 = 0.
    for (int k = 0; k < in->world->count; k++)
        for (int i = 1; i < LW_NJ; i++)
            repel(params, &in->world->obstacle[k], i + 1, in->frame[i].p, &wrench, &out->nearest);

    // Joint velocities, equation (6).
    lw_arm_joint_effect(in->frame, &wrench, out->qd);
}

const struct lw_law lw_apf_law = {.name = "apf", .step = apf_step};
