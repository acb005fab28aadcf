// SPDX-License-Identifier: BSD-3-Clause
// Roll-outs of circulations.
//
// Units    metres, radians, seconds; ns where a name says so.
// Frames   base frame of the arm.
// Arrays   one entry a joint.
// Memory   see escape.h; the surroundings of a step are on the stack.
// Errors   none.
#include "controller/escape.h"

#include "base/clock.h"           // LW_NS_PER_S
#include "base/digest.h"          // lw_digest_word
#include "base/vec.h"             // lw_vec_*
#include "controller/clearance.h" // lw_clearance_command

#include <math.h>   // fmin, HUGE_VAL
#include <string.h> // memcpy

enum { CIRCULATIONS = 4, ASIDES = 12, CANDIDATES = 1 + CIRCULATIONS + ASIDES, STEPS = 625 };
static const int64_t step_ns = 8 * 1000 * 1000;
// Of the tick's period for one step, and again for so many near pairs: it takes a tenth of that, in a crowd a quarter.
// So a roll-out takes half a second, in a crowd longer.
static const int64_t share_ns = 50 * 1000;
enum { SHARE_PAIRS = 64 };
static const double aside_speed = 1.0; // rad/s
static const int64_t aside_ns = 1500 * INT64_C(1000000);
static const double worth_m = 0.02;                 // a way has to bring the tip this much nearer
static const int64_t patience_ns = LW_NS_PER_S / 4; // after an attempt, doubled with each one ...
enum { PATIENCE_DOUBLINGS = 3 };
static const int64_t progress_ns = 5 * LW_NS_PER_S; // without coming nearer for this long it goes in circles

void lw_escape_reset(struct lw_escape *escape, const struct lw_remedy_params *params)
{
    *escape = (struct lw_escape){.rollout = {.candidate = -1}};
    if (params->kind == LW_REMEDY_VORTEX)
        for (int i = 0; i < 3; i++)
            escape->circulation[i] = params->circulation * params->axis[i];
}

void lw_escape_pause(struct lw_escape *escape)
{
    lw_stuck_reset(&escape->stuck);
    escape->rollout.candidate = -1;
    escape->nearest_ns = 0;
    escape->aside_until_ns = 0;
}

const double *lw_escape_aside(const struct lw_escape *escape, int64_t time_ns)
{
    return time_ns < escape->aside_until_ns ? escape->aside : NULL;
}

// A number in [-1, 1) that depends on its arguments alone.
static double scatter(uint64_t attempt, uint64_t candidate, uint64_t joint)
{
    uint64_t x = lw_digest_word(lw_digest_word(lw_digest_word(LW_DIGEST_START, attempt), candidate), joint);
    x = lw_digest_word(x ^ (x >> 29), joint);
    return (double)(x >> 11) * 0x1p-52 - 1;
}

// The ways to try: on as it is; around obstacles to either side of the way to the goal, over or under them; aside in
// any direction of the joints, others in each attempt.
static struct lw_way_out candidate_way(int candidate, int attempt, double strength, const struct lw_escape_now *now)
{
    const double way[2] = {now->goal[0] - now->tip[0], now->goal[1] - now->tip[1]};
    const double length = hypot(way[0], way[1]);
    const double across[3] = {length > 0 ? -way[1] / length : 1, length > 0 ? way[0] / length : 0, 0};
    const double up[3] = {0, 0, 1};
    struct lw_way_out out = {.moves_aside = false};
    out.moves_aside = candidate > CIRCULATIONS;
    if (out.moves_aside)
        for (int j = 0; j < LW_NJ; j++)
            out.aside[j] = aside_speed * scatter((uint64_t)attempt, (uint64_t)candidate, (uint64_t)j);
    else if (candidate > 0)
        lw_vec_add_scaled(candidate % 2 == 1 ? -strength : strength, candidate <= 2 ? up : across, out.circulation);
    return out;
}

// Starts a candidate from where the arm was.
static void begin(struct lw_escape *escape, int candidate, const struct lw_remedy_params *params,
                  const struct lw_escape_now *now)
{
    struct lw_rollout *rollout = &escape->rollout;
    rollout->candidate = candidate;
    rollout->steps = 0;
    memcpy(rollout->q, rollout->from_q, sizeof rollout->q);
    memcpy(rollout->velocity, rollout->from_velocity, sizeof rollout->velocity);
    // Later attempts turn harder.
    const double strength = params->circulation * (1 + escape->attempts % 3);
    rollout->way = candidate_way(candidate, escape->attempts, strength, now);
}

// One step of law, guard and plant. Returns the deviation before it, infinite when the arm is nowhere.
//   pairs  out  near ones, which make the step long
static double roll(struct lw_rollout *rollout, const struct lw_escape_model *model, const struct lw_escape_now *now,
                   int *pairs)
{
    const double period_s = (double)step_ns / (double)LW_NS_PER_S;
    const struct lw_law_reach reach = model->law->reach(model->params, now->world->speed_max);
    double wish[LW_NJ], command[LW_NJ], to_goal[3];
    const struct lw_guard_input guard = {
        .limits = model->limits, .period_s = period_s, .q = rollout->q, .velocity = rollout->velocity, .wish = wish};
    struct lw_surroundings around;
    struct lw_rooms rooms;
    *pairs = 0;
    if (lw_surroundings_place(model->arm, model->body, rollout->q, &around) != LW_OK)
        return HUGE_VAL;
    const struct lw_law_reach brake = lw_clearance_reach(&guard, model->body, &around, now->world->speed_max);
    const struct lw_eyes eyes = {.body = model->body,
                                 .world = now->world,
                                 .time_ns = rollout->from_ns + rollout->steps * step_ns,
                                 .reach = fmax(reach.obstacles, brake.obstacles),
                                 .self_reach = fmax(reach.self, brake.self)};
    lw_surroundings_look(&eyes, &around);
    *pairs = around.near.count;
    const bool aside = rollout->way.moves_aside && rollout->steps * step_ns < aside_ns;
    const double *tip = around.frame[LW_NJ - 1].p;
    const struct lw_law_input in = {.around = &around,
                                    .body = model->body,
                                    .goal = aside ? tip : now->goal,
                                    .circulation = rollout->way.circulation};
    model->law->step(model->params, &in, wish);
    for (int j = 0; aside && j < LW_NJ; j++)
        wish[j] += rollout->way.aside[j];
    lw_clearance_rooms(model->limits, brake, model->body, &around, &rooms);
    (void)lw_clearance_command(&guard, &rooms, command);
    for (int j = 0; j < LW_NJ; j++)
        rollout->q[j] += period_s * command[j];
    memcpy(rollout->velocity, command, sizeof command);
    lw_vec_sub(now->goal, tip, to_goal);
    return lw_vec_norm(to_goal);
}

// Takes the best direction of a finished roll-out, or waits before the next one.
static void decide(struct lw_escape *escape, const struct lw_escape_now *now)
{
    struct lw_rollout *rollout = &escape->rollout;
    rollout->candidate = -1;
    const int doublings = escape->attempts < PATIENCE_DOUBLINGS ? escape->attempts : PATIENCE_DOUBLINGS;
    escape->wait_until_ns = now->tick.time_ns + (patience_ns << doublings);
    escape->attempts++;
    if (rollout->best > now->deviation - worth_m)
        return;
    memcpy(escape->circulation, rollout->best_way.circulation, sizeof escape->circulation);
    memcpy(escape->aside, rollout->best_way.aside, sizeof escape->aside);
    escape->aside_until_ns = rollout->best_way.moves_aside ? now->tick.time_ns + aside_ns : 0;
    // To go on as it is begins nothing anew, unless that leads somewhere.
    if (rollout->best_candidate == 0 && rollout->best > now->deviation - 2 * worth_m)
        return;
    lw_stuck_reset(&escape->stuck);
    escape->nearest = now->deviation;
    escape->nearest_ns = now->tick.time_ns;
}

// Goes on with a roll-out by as many steps as a tick may take.
static void roll_on(struct lw_escape *escape, const struct lw_escape_model *model, const struct lw_escape_now *now)
{
    struct lw_rollout *rollout = &escape->rollout;
    for (int64_t left_ns = now->tick.period_ns; left_ns > 0 && rollout->candidate >= 0;) {
        int pairs;
        const double deviation = roll(rollout, model, now, &pairs);
        left_ns -= share_ns * (1 + pairs / SHARE_PAIRS);
        if (++rollout->steps < STEPS)
            continue;
        // Another way has to be worth leaving this one; decide() takes that off again.
        const double score = rollout->candidate == 0 ? deviation - worth_m : deviation;
        if (score < rollout->best) {
            rollout->best = score;
            rollout->best_candidate = rollout->candidate;
            rollout->best_way = rollout->way;
        }
        if (rollout->candidate + 1 < CANDIDATES)
            begin(escape, rollout->candidate + 1, &model->params->remedy, now);
        else
            decide(escape, now);
    }
}

// Whether the tip has not come nearer for long, moving or not.
static bool is_idle(struct lw_escape *escape, const struct lw_escape_now *now)
{
    if (escape->nearest_ns == 0 || now->deviation < escape->nearest - worth_m) {
        escape->nearest = now->deviation;
        escape->nearest_ns = now->tick.time_ns;
    }
    return now->tick.time_ns - escape->nearest_ns > progress_ns;
}

bool lw_escape_step(struct lw_escape *escape, const struct lw_escape_model *model, const struct lw_escape_now *now)
{
    const double tolerance = model->law->tolerance(model->params);
    const bool stuck = lw_stuck_note(&escape->stuck, now->deviation, tolerance, &now->tick);
    if (model->params->remedy.kind != LW_REMEDY_ROLLOUT)
        return stuck;
    const bool arrived = now->deviation < tolerance, idle = is_idle(escape, now) && !arrived;
    if (arrived)
        memset(escape->circulation, 0, sizeof escape->circulation);
    if ((stuck || idle) && escape->rollout.candidate < 0 && now->tick.time_ns >= escape->wait_until_ns) {
        struct lw_rollout *rollout = &escape->rollout;
        rollout->from_ns = now->tick.time_ns;
        rollout->best = HUGE_VAL;
        memcpy(rollout->from_q, now->q, sizeof rollout->from_q);
        memcpy(rollout->from_velocity, now->velocity, sizeof rollout->from_velocity);
        begin(escape, 0, &model->params->remedy, now);
    }
    roll_on(escape, model, now);
    return stuck;
}
