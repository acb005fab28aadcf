// SPDX-License-Identifier: BSD-3-Clause
// The whole pipeline on one page: estimate -> select request -> law -> guard -> explain.
//
// Units    metres, radians, seconds; ns where a name says so.
// Frames   base frame of the arm.
// Arrays   one entry a joint.
// Memory   see tick.h.
// Errors   see tick.h.
#include "controller/tick.h"

#include "base/clock.h"       // LW_NS_PER_S
#include "base/digest.h"      // lw_digest_*
#include "base/vec.h"         // lw_vec_*, lw_all_finite
#include "controller/guard.h" // lw_guard_shape

#include <math.h>   // NAN, INFINITY
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
    *state = (struct lw_controller_state){.request = {.kind = LW_REQUEST_GOAL}};
    memcpy(state->request.goal, scene->goal, sizeof state->request.goal);
    return LW_OK;
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
static void select_request(struct lw_controller_state *state, const struct lw_request *request)
{
    if (!lw_request_is_new(&state->requests, request))
        return;
    const struct lw_request before = state->request;
    state->request = *request;
    if (request->kind == LW_REQUEST_STOP)
        memcpy(state->request.goal, before.goal, sizeof before.goal);
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

// Asks the law at the measured configuration. A configuration that is no number gives no wish either.
static enum lw_law_outcome ask_law(const struct lw_controller *config, const struct lw_controller_state *state,
                                   const struct lw_tick_input *in, struct lw_pose frame[LW_NJ],
                                   struct lw_law_output *law)
{
    if (lw_arm_fk(config->arm, in->joint->q, frame) == LW_OK) {
        const struct lw_law_input law_in = {.frame = frame, .world = in->world, .goal = state->request.goal};
        config->law->step(&config->params, &law_in, law);
        return lw_all_finite(law->qd, LW_NJ) ? LW_LAW_OK : LW_LAW_NO_NUMBER;
    }
    // Nothing is known then, neither the wish nor where the frames are.
    const double nan = (double)NAN;
    *law = (struct lw_law_output){.qd = {nan, nan, nan, nan, nan, nan}, .nearest = {.clearance = (double)INFINITY}};
    for (int i = 0; i < LW_NJ; i++)
        frame[i] = (struct lw_pose){.p = {nan, nan, nan}};
    return LW_LAW_NOT_ASKED;
}

// --- explain ---

// Digest of all that the tick was given, so that a replay can tell that it was given the same.
// tools/leeway/replay/digest.py names these values in this order.
static int64_t digest_input(const struct lw_controller *config, const struct lw_controller_state *state,
                            const struct lw_tick_input *in)
{
    const struct lw_joint_state *joint = in->joint;
    const struct lw_request *request = &state->request;
    const int64_t words[] = {
        joint->stamp.utime,   joint->stamp.mono_ns,    joint->stamp.session,   joint->stamp.seq,
        (int64_t)joint->mode, joint->command_session,  joint->command_seq,     joint->tick,
        joint->period_ns,     in->world->last.session, in->world->last.seq,    in->world->version,
        in->world->digest,    request->stamp.session,  request->stamp.seq,     (int64_t)request->kind,
        in->time_ns,          in->state_age_ns,        (int64_t)in->warming_up};
    uint64_t digest = lw_digest_int(LW_DIGEST_START, config->scene_digest);
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++)
        digest = lw_digest_int(digest, words[i]);
    digest = lw_digest_doubles(digest, joint->q, LW_NJ);
    digest = lw_digest_doubles(digest, joint->qd, LW_NJ);
    return (int64_t)lw_digest_doubles(digest, request->goal, 3);
}

static void explain(const struct lw_controller_state *state, const struct lw_tick_input *in, const double tip[3],
                    const struct lw_law_output *law, struct lw_joint_command *out)
{
    double to_goal[3];
    lw_vec_sub(state->request.goal, tip, to_goal);
    out->plant_session = in->joint->stamp.session;
    out->state_seq = in->joint->stamp.seq;
    out->state_tick = in->joint->tick;
    out->state_mono_ns = in->joint->stamp.mono_ns;
    memcpy(out->qd_law, law->qd, sizeof out->qd_law);
    memcpy(out->q, in->joint->q, sizeof out->q);
    memcpy(out->goal, state->request.goal, sizeof out->goal);
    out->request = state->request.stamp;
    out->world = in->world->last;
    out->world_channel = in->world->last_channel;
    out->world_version = in->world->version;
    out->obstacle_count = in->world->count;
    out->deviation = lw_vec_norm(to_goal);
    out->nearest = law->nearest;
    out->self_clearance = (double)INFINITY;
    out->tick = state->tick;
    out->tick_ns = in->time_ns;
    out->state_age_ns = in->state_age_ns;
}

void lw_tick(const struct lw_controller *config, struct lw_controller_state *state, const struct lw_tick_input *in,
             struct lw_joint_command *out)
{
    static const double rest[LW_NJ] = {0};
    struct lw_pose frame[LW_NJ];
    struct lw_law_output law;
    *out = (struct lw_joint_command){0};
    state->tick++;

    estimate(config, state, in);
    select_request(state, in->request);
    out->law_outcome = ask_law(config, state, in, frame, &law);

    // The guard has the last word; a reason to brake replaces the law's wish by rest.
    out->flags = brake_reasons(config, state, in);
    const double *wish = out->flags ? rest : law.qd;
    const double period_s = (double)config->period_ns / (double)LW_NS_PER_S;
    out->flags |= lw_guard_shape(&config->limits, period_s, in->joint->q, state->velocity, wish, out->qd);
    out->mode = (out->flags & (LW_WAITING | LW_WARMING_UP)) ? LW_COMMAND_IDLE : LW_COMMAND_VELOCITY;
    memcpy(state->velocity, out->qd, sizeof state->velocity);

    explain(state, in, frame[LW_NJ - 1].p, &law, out);
    out->input_digest = digest_input(config, state, in);
}

bool lw_controller_at_rest(const struct lw_controller_state *state)
{
    for (int j = 0; j < LW_NJ; j++)
        if (state->velocity[j] != 0.0)
            return false;
    return true;
}
