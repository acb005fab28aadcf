// SPDX-License-Identifier: BSD-3-Clause
// The whole pipeline on one page: estimate -> select request -> look around -> law -> guard -> explain.
//
// Units    metres, radians, seconds; ns where a name says so.
// Frames   base frame of the arm.
// Arrays   one entry a joint.
// Memory   see tick.h.
// Errors   see tick.h.
#include "controller/tick.h"

#include "base/clock.h"           // LW_NS_PER_S
#include "base/vec.h"             // lw_vec_*, lw_all_finite
#include "controller/clearance.h" // lw_clearance_command
#include "controller/explain.h"   // lw_explain_*

#include <math.h>   // fmax, isfinite
#include <string.h> // memcpy

static const int64_t stale_after_ns = 20 * 1000 * 1000;
enum { STALE_PERIODS = 3 };

enum lw_status lw_controller_init(struct lw_controller *config, struct lw_controller_state *state,
                                  const struct lw_scene *scene, int64_t session)
{
    if (scene->robot < 0 || scene->robot >= LW_ROBOT_COUNT || scene->law.name != LW_LAW_APF)
        return LW_E_ARGUMENT;
    const int64_t period_ns = lw_scene_period_ns(scene->rate_hz);
    const int64_t patience_ns = STALE_PERIODS * period_ns;
    *config = (struct lw_controller){.session = session,
                                     .scene_digest = lw_scene_digest(scene),
                                     .arm = lw_arm_get((enum lw_robot)scene->robot),
                                     .law = lw_law_get((enum lw_law_name)scene->law.name),
                                     .params = scene->law,
                                     .limits = scene->limits,
                                     .period_ns = period_ns,
                                     .stale_after_ns = patience_ns > stale_after_ns ? patience_ns : stale_after_ns};
    memcpy(config->goal, scene->goal, sizeof config->goal);
    lw_body_make((enum lw_robot)scene->robot, (enum lw_body_model)scene->law.control_points, &scene->tool,
                 &config->body);
    *state = (struct lw_controller_state){.request = {.kind = LW_REQUEST_GOAL}};
    memcpy(state->request.goal, scene->goal, sizeof state->request.goal);
    lw_escape_reset(&state->escape, &config->params.remedy);
    return LW_OK;
}

static double period_s(const struct lw_controller *config)
{
    return (double)config->period_ns / (double)LW_NS_PER_S;
}

// --- estimate ---

// Whether the plant moves by another controller's commands.
static bool is_foreign(const struct lw_controller *config, const struct lw_joint_state *joint)
{
    return joint->mode == LW_PLANT_MOVING && joint->command_session != config->session;
}

// Adopts the plant's own velocity where the plant does not follow our commands: a new plant, one that ramps to rest, or
// one that obeys another controller. Once a state: a plant that died while it ramped must not keep us from coming to
// rest.
static void estimate(const struct lw_controller *config, struct lw_controller_state *state,
                     const struct lw_tick_input *in)
{
    const struct lw_joint_state *joint = in->joint;
    const bool new_plant = joint->stamp.session != state->plant_session;
    const bool new_state = joint->stamp.seq != state->state_seq;
    const bool follows = joint->mode == LW_PLANT_MOVING && !is_foreign(config, joint);
    if (new_plant || (new_state && !follows))
        for (int j = 0; j < LW_NJ; j++)
            state->velocity[j] = isfinite(joint->qd[j]) ? joint->qd[j] : 0.0;
    state->plant_session = joint->stamp.session;
    state->state_seq = joint->stamp.seq;
}

// --- select request ---

// Adopts a new request. A stop has no goal of its own: the arm still knows where it was going.
static void select_request(const struct lw_controller *config, struct lw_controller_state *state,
                           const struct lw_request *request)
{
    if (!lw_request_is_new(&state->requests, request))
        return;
    const struct lw_request before = state->request;
    state->request = *request;
    if (request->kind == LW_REQUEST_STOP)
        memcpy(state->request.goal, before.goal, sizeof before.goal);
    lw_escape_reset(&state->escape, &config->params.remedy);
}

// --- look around ---

// Finds all that the law or the guard may have to know of. False when the configuration is no number.
//   brake  out  how far the guard has to see
static bool look(const struct lw_controller *config, struct lw_controller_state *state, const struct lw_tick_input *in,
                 struct lw_surroundings *around, struct lw_law_reach *brake)
{
    if (lw_surroundings_place(config->arm, &config->body, in->joint->q, around) != LW_OK)
        return false;
    const double speed = in->world->speed_max;
    const struct lw_guard_input motion = {
        .limits = &config->limits, .period_s = period_s(config), .velocity = state->velocity};
    const struct lw_law_reach reach = config->law->reach(&config->params, speed);
    *brake = lw_clearance_reach(&motion, &config->body, around, speed);
    const struct lw_eyes eyes = {.body = &config->body,
                                 .world = in->world,
                                 .time_ns = in->time_ns,
                                 .reach = fmax(reach.obstacles, brake->obstacles),
                                 .self_reach = fmax(reach.self, brake->self),
                                 .warm = &state->warm};
    if (state->tick % LW_WARM_TICKS == 0)
        memset(&state->warm, 0, sizeof state->warm);
    lw_surroundings_look(&eyes, around);
    return true;
}

// Whether the axis of a link is inside an obstacle, or the distances are not known: nothing to steer by.
static bool is_contact(const struct lw_controller *config, const struct lw_surroundings *around)
{
    if (isinf(config->limits.clearance))
        return false;
    bool contact = around->near.needed > around->near.count;
    for (int i = 0; i < around->near.count; i++) {
        const struct lw_near *pair = &around->near.pair[i];
        contact |= !isfinite(pair->distance.d);
        contact |= pair->obstacle != 0 && !pair->fixed && (pair->distance.flags & LW_DISTANCE_CORE);
    }
    return contact;
}

// --- law ---

// Reasons to brake to rest instead of asking the law.
static unsigned brake_reasons(const struct lw_controller *config, const struct lw_controller_state *state,
                              const struct lw_tick_input *in)
{
    unsigned flags = 0;
    if (in->warming_up)
        flags |= LW_WARMING_UP;
    if (in->world->version == 0 || in->joint->stamp.session == 0)
        flags |= LW_WAITING;
    if (state->request.kind == LW_REQUEST_STOP)
        flags |= LW_STOPPED;
    if (in->state_age_ns > config->stale_after_ns)
        flags |= LW_STALE;
    if (is_foreign(config, in->joint))
        flags |= LW_FOREIGN;
    return flags;
}

static void ask_law(const struct lw_controller *config, const struct lw_controller_state *state, int64_t time_ns,
                    const struct lw_surroundings *around, struct lw_joint_command *out)
{
    const double *aside = lw_escape_aside(&state->escape, time_ns);
    const struct lw_law_input in = {.around = around,
                                    .body = &config->body,
                                    .goal = aside != NULL ? around->frame[LW_NJ - 1].p : state->request.goal,
                                    .circulation = state->escape.circulation};
    config->law->step(&config->params, &in, out->qd_law);
    for (int j = 0; aside != NULL && j < LW_NJ; j++)
        out->qd_law[j] += aside[j];
    out->law_outcome = !lw_all_finite(out->qd_law, LW_NJ) ? LW_LAW_NO_NUMBER : aside != NULL ? LW_LAW_ASIDE : LW_LAW_OK;
    memcpy(out->circulation, state->escape.circulation, sizeof out->circulation);
    double to_goal[3];
    lw_vec_sub(state->request.goal, around->frame[LW_NJ - 1].p, to_goal);
    out->deviation = lw_vec_norm(to_goal);
}

// Watches for standstill away from the goal; a braked arm stands for another reason.
static void escape(const struct lw_controller *config, struct lw_controller_state *state,
                   const struct lw_tick_input *in, const struct lw_surroundings *around, struct lw_joint_command *out)
{
    const struct lw_escape_model model = {.law = config->law,
                                          .params = &config->params,
                                          .limits = &config->limits,
                                          .arm = config->arm,
                                          .body = &config->body};
    const struct lw_escape_now now = {
        .world = in->world,
        .q = in->joint->q,
        .velocity = state->velocity,
        .tip = around->frame[LW_NJ - 1].p,
        .goal = state->request.goal,
        .deviation = out->deviation,
        .tick = {.number = state->tick, .period_ns = config->period_ns, .time_ns = in->time_ns}};
    if (lw_escape_step(&state->escape, &model, &now))
        out->law_outcome = LW_LAW_STUCK;
    out->stuck_since_ns = state->escape.stuck.since_ns;
}

// --- guard ---

// The last word; a reason to brake replaces the law's wish by rest.
//   rooms  in  count 0 where nothing is known
static void guard(const struct lw_controller *config, struct lw_controller_state *state, const struct lw_tick_input *in,
                  const struct lw_rooms *rooms, struct lw_joint_command *out)
{
    static const double rest[LW_NJ] = {0};
    const struct lw_guard_input guard_in = {.limits = &config->limits,
                                            .period_s = period_s(config),
                                            .q = in->joint->q,
                                            .velocity = state->velocity,
                                            .wish = out->flags ? rest : out->qd_law};
    out->flags |= lw_clearance_command(&guard_in, rooms, out->qd);
    out->mode = (out->flags & (LW_WAITING | LW_WARMING_UP)) ? LW_COMMAND_IDLE : LW_COMMAND_VELOCITY;
    memcpy(state->velocity, out->qd, sizeof state->velocity);
}

// --- the tick ---

void lw_tick(const struct lw_controller *config, struct lw_controller_state *state, const struct lw_tick_input *in,
             struct lw_joint_command *out)
{
    struct lw_surroundings around;
    struct lw_law_reach brake;
    struct lw_rooms rooms; // large, like the surroundings: only what is used is written
    *out = lw_explain_nothing();
    state->tick++;

    estimate(config, state, in);
    select_request(config, state, in->request);
    out->flags = brake_reasons(config, state, in);
    const bool seen = look(config, state, in, &around, &brake);
    if (seen) {
        out->flags |= is_contact(config, &around) ? LW_CONTACT : 0u;
        ask_law(config, state, in->time_ns, &around, out);
        lw_explain_clearance(config, state, in, &around, out);
    }
    if (seen && out->flags == 0)
        escape(config, state, in, &around, out);
    else
        lw_escape_pause(&state->escape);
    rooms.count = 0;
    if (seen)
        lw_clearance_rooms(&config->limits, brake, &config->body, &around, &rooms);
    guard(config, state, in, &rooms, out);
    lw_explain_inputs(config, state, in, out);
}

bool lw_controller_at_rest(const struct lw_controller_state *state)
{
    for (int j = 0; j < LW_NJ; j++)
        if (state->velocity[j] != 0.0)
            return false;
    return true;
}
