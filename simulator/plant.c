// SPDX-License-Identifier: BSD-3-Clause
// Kinematic plant.
//
// Units    radians, seconds; ns where a name says so.
// Frames   none.
// Arrays   one entry a joint.
// Memory   the caller's.
// Errors   see plant.h.
#include "simulator/plant.h"

#include "base/clock.h" // LW_NS_PER_S

#include <math.h>   // fmax, fmin, llround
#include <string.h> // memcpy, memset

void lw_plant_init(struct lw_plant *plant, struct lw_plant_state *state, const struct lw_scene *scene, int64_t session)
{
    const int64_t period_ns = lw_scene_period_ns(scene->plant.rate_hz);
    *plant = (struct lw_plant){.session = session,
                               .period_ns = period_ns,
                               .period_s = (double)period_ns / (double)LW_NS_PER_S,
                               .timeout_ns = llround(scene->plant.timeout_s * (double)LW_NS_PER_S)};
    memcpy(plant->velocity, scene->plant.velocity, sizeof plant->velocity);
    memcpy(plant->acceleration, scene->plant.acceleration, sizeof plant->acceleration);
    *state = (struct lw_plant_state){.mode = LW_PLANT_HOLD};
    memcpy(state->q, scene->q0, sizeof state->q);
}

void lw_plant_obey(struct lw_plant_state *state, const struct lw_joint_command *command, int64_t now_ns)
{
    state->mode = LW_PLANT_MOVING;
    state->command_session = command->stamp.session;
    state->command_seq = command->stamp.seq;
    state->command_ns = now_ns;
    memcpy(state->target, command->qd, sizeof state->target);
}

void lw_plant_stop(struct lw_plant_state *state)
{
    if (state->mode == LW_PLANT_MOVING)
        state->mode = LW_PLANT_STOPPING;
    memset(state->target, 0, sizeof state->target);
}

static double clamp(double value, double centre, double half_width)
{
    return fmax(centre - half_width, fmin(centre + half_width, value));
}

void lw_plant_step(const struct lw_plant *plant, struct lw_plant_state *state, int64_t now_ns)
{
    if (state->mode == LW_PLANT_HOLD)
        return;
    if (state->mode == LW_PLANT_MOVING && now_ns - state->command_ns > plant->timeout_ns)
        lw_plant_stop(state);
    for (int j = 0; j < LW_NJ; j++) {
        const double wanted = clamp(state->target[j], 0, plant->velocity[j]);
        state->qd[j] = clamp(wanted, state->qd[j], plant->acceleration[j] * plant->period_s);
        state->q[j] += plant->period_s * state->qd[j];
    }
    state->tick++;
}

bool lw_plant_at_rest(const struct lw_plant_state *state)
{
    for (int j = 0; j < LW_NJ; j++)
        if (state->qd[j] != 0.0)
            return false;
    return true;
}

void lw_plant_report(const struct lw_plant *plant, const struct lw_plant_state *state, struct lw_joint_state *out)
{
    *out = (struct lw_joint_state){.stamp = {.session = plant->session},
                                   .mode = state->mode,
                                   .command_session = state->command_session,
                                   .command_seq = state->command_seq,
                                   .tick = state->tick,
                                   .period_ns = plant->period_ns};
    memcpy(out->q, state->q, sizeof out->q);
    memcpy(out->qd, state->qd, sizeof out->qd);
}
