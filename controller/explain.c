// SPDX-License-Identifier: BSD-3-Clause
// Explanation of a command.
//
// Units    see explain.h.
// Frames   base frame of the arm.
// Arrays   see explain.h.
// Memory   none.
// Errors   none.
#include "controller/explain.h"

#include "base/digest.h" // lw_digest_*

#include <math.h>   // NAN, HUGE_VAL
#include <string.h> // memcpy

struct lw_joint_command lw_explain_nothing(void)
{
    const double nan = (double)NAN;
    return (struct lw_joint_command){.law_outcome = LW_LAW_NOT_ASKED,
                                     .qd_law = {nan, nan, nan, nan, nan, nan},
                                     .deviation = nan,
                                     .nearest = {.clearance = HUGE_VAL},
                                     .self_clearance = HUGE_VAL};
}

// Digest of all that the tick was given, so that a replay can tell that it was given the same.
// tools/leeway/replay/digest.py names these values in this order.
static int64_t digest_input(const struct lw_controller *config, const struct lw_controller_state *state,
                            const struct lw_tick_input *in)
{
    const struct lw_joint_state *joint = in->joint;
    const struct lw_request *request = &state->request;
    const int64_t words[] = {joint->stamp.utime,      joint->stamp.mono_ns,
                             joint->stamp.session,    joint->stamp.seq,
                             (int64_t)joint->mode,    joint->command_session,
                             joint->command_seq,      joint->tick,
                             joint->period_ns,        in->world->last_channel,
                             in->world->last.session, in->world->last.seq,
                             in->world->version,      in->world->digest,
                             request->stamp.session,  request->stamp.seq,
                             (int64_t)request->kind,  in->time_ns,
                             in->state_age_ns,        (int64_t)in->warming_up};
    uint64_t digest = lw_digest_int(LW_DIGEST_START, config->scene_digest);
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++)
        digest = lw_digest_int(digest, words[i]);
    digest = lw_digest_doubles(digest, joint->q, LW_NJ);
    digest = lw_digest_doubles(digest, joint->qd, LW_NJ);
    return (int64_t)lw_digest_doubles(digest, request->goal, 3);
}

void lw_explain_clearance(const struct lw_controller *config, struct lw_controller_state *state,
                          const struct lw_tick_input *in, const struct lw_surroundings *around,
                          struct lw_joint_command *out)
{
    struct lw_near found;
    const struct lw_near *nearest = lw_surroundings_nearest(around, false);
    const struct lw_near *self = lw_surroundings_nearest(around, true);
    const struct lw_near_query all = {.body = &config->body,
                                      .placed = &around->placed,
                                      .world = in->world,
                                      .time_ns = in->time_ns,
                                      .d_max = HUGE_VAL,
                                      .warm = &state->warm};
    if (nearest == NULL) {
        lw_near_smallest(&all, &found);
        nearest = found.obstacle != 0 ? &found : NULL;
    }
    if (nearest != NULL)
        out->nearest = (struct lw_nearest){.clearance = nearest->distance.d,
                                           .link = config->body.part[nearest->part].link,
                                           .obstacle = nearest->obstacle};
    if (self != NULL) {
        out->self_clearance = self->distance.d;
        out->self_link[0] = config->body.part[self->part].link;
        out->self_link[1] = config->body.part[self->other].link;
    }
}

void lw_explain_inputs(const struct lw_controller *config, const struct lw_controller_state *state,
                       const struct lw_tick_input *in, struct lw_joint_command *out)
{
    out->plant_session = in->joint->stamp.session;
    out->state_seq = in->joint->stamp.seq;
    out->state_tick = in->joint->tick;
    out->state_mono_ns = in->joint->stamp.mono_ns;
    memcpy(out->q, in->joint->q, sizeof out->q);
    memcpy(out->goal, state->request.goal, sizeof out->goal);
    out->request = state->request.stamp;
    out->world = in->world->last;
    out->world_channel = in->world->last_channel;
    out->world_version = in->world->version;
    out->obstacle_count = lw_snapshot_present(in->world, in->time_ns);
    out->tick = state->tick;
    out->tick_ns = in->time_ns;
    out->state_age_ns = in->state_age_ns;
    out->input_digest = digest_input(config, state, in);
}
