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
#include "base/vec.h"             // lw_vec_*
#include "controller/clearance.h" // lw_clearance_command

#include <math.h>   // fmin, HUGE_VAL
#include <string.h> // memcpy

enum { CIRCULATIONS = 4, DETOURS = 6, CANDIDATES = 1 + CIRCULATIONS + DETOURS, STEPS = 500 };
static const int64_t step_ns = 8 * 1000 * 1000;
static const int64_t share_ns = 125 * 1000; // of the tick's period for one step: a roll-out takes a quarter of a second
static const double detour_m = 0.2;         // later attempts two and three times as far
static const int64_t detour_ns = 1500 * INT64_C(1000000);
static const double worth_m = 0.02;             // a direction has to bring the tip this much nearer
static const int64_t patience_ns = LW_NS_PER_S; // after an attempt, doubled with each one ...
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
}

const double *lw_escape_target(const struct lw_escape *escape, const double goal[3], int64_t time_ns)
{
    return time_ns < escape->by_until_ns ? escape->by : goal;
}

// The ways to try: on as it is; around obstacles to either side of the way to the goal, over or under them; by a point
// to either side, above, below, or back.
static struct lw_way_out candidate_way(int candidate, double strength, double detour, const struct lw_escape_now *now)
{
    const double way[2] = {now->goal[0] - now->tip[0], now->goal[1] - now->tip[1]};
    const double length = hypot(way[0], way[1]);
    const double ahead[3] = {length > 0 ? way[0] / length : 0, length > 0 ? way[1] / length : 1, 0};
    const double across[3] = {-ahead[1], ahead[0], 0}, up[3] = {0, 0, 1};
    const double *const axes[] = {up, across}, *const sides[] = {across, up, ahead};
    const double sign = candidate % 2 == 1 ? -1 : 1;
    struct lw_way_out out = {{0}, {0}};
    if (candidate == 0)
        return out;
    if (candidate <= CIRCULATIONS)
        lw_vec_add_scaled(sign * strength, axes[(candidate - 1) / 2], out.circulation);
    else
        lw_vec_add_scaled(sign * detour, sides[(candidate - CIRCULATIONS - 1) / 2], out.detour);
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
    // Later attempts turn harder and go farther.
    const double more = 1 + escape->attempts % 3;
    rollout->way = candidate_way(candidate, params->circulation * more, detour_m * more, now);
}

// One step of law, guard and plant. Returns the deviation before it, infinite when the arm is nowhere.
static double roll(struct lw_rollout *rollout, const struct lw_escape_model *model, const struct lw_escape_now *now)
{
    const double period_s = (double)step_ns / (double)LW_NS_PER_S;
    const struct lw_law_reach reach = model->law->reach(model->params, now->world->speed_max);
    double wish[LW_NJ], command[LW_NJ], to_goal[3];
    const struct lw_guard_input guard = {
        .limits = model->limits, .period_s = period_s, .q = rollout->q, .velocity = rollout->velocity, .wish = wish};
    struct lw_surroundings around;
    struct lw_rooms rooms;
    if (lw_surroundings_place(model->arm, model->body, rollout->q, &around) != LW_OK)
        return HUGE_VAL;
    const struct lw_law_reach brake = lw_clearance_reach(&guard, model->body, &around, now->world->speed_max);
    const struct lw_eyes eyes = {.body = model->body,
                                 .world = now->world,
                                 .time_ns = rollout->from_ns + rollout->steps * step_ns,
                                 .reach = fmax(reach.obstacles, brake.obstacles),
                                 .self_reach = fmax(reach.self, brake.self)};
    lw_surroundings_look(&eyes, &around);
    double by[3];
    memcpy(by, rollout->from_tip, sizeof by);
    lw_vec_add_scaled(1, rollout->way.detour, by);
    const bool detours = lw_vec_norm(rollout->way.detour) > 0 && rollout->steps * step_ns < detour_ns;
    const struct lw_law_input in = {.around = &around,
                                    .body = model->body,
                                    .goal = detours ? by : now->goal,
                                    .circulation = rollout->way.circulation};
    model->law->step(model->params, &in, wish);
    lw_clearance_rooms(model->limits, brake, model->body, &around, &rooms);
    (void)lw_clearance_command(&guard, &rooms, command);
    for (int j = 0; j < LW_NJ; j++)
        rollout->q[j] += period_s * command[j];
    memcpy(rollout->velocity, command, sizeof command);
    lw_vec_sub(now->goal, around.frame[LW_NJ - 1].p, to_goal);
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
    memcpy(escape->by, rollout->from_tip, sizeof escape->by);
    lw_vec_add_scaled(1, rollout->best_way.detour, escape->by);
    escape->by_until_ns = lw_vec_norm(rollout->best_way.detour) > 0 ? now->tick.time_ns + detour_ns : 0;
    lw_stuck_reset(&escape->stuck);
    escape->nearest = now->deviation;
    escape->nearest_ns = now->tick.time_ns;
}

// Goes on with a roll-out by as many steps as a tick may take.
static void roll_on(struct lw_escape *escape, const struct lw_escape_model *model, const struct lw_escape_now *now)
{
    struct lw_rollout *rollout = &escape->rollout;
    for (int64_t left_ns = now->tick.period_ns; left_ns > 0 && rollout->candidate >= 0; left_ns -= share_ns) {
        const double deviation = roll(rollout, model, now);
        if (++rollout->steps < STEPS)
            continue;
        if (deviation < rollout->best) {
            rollout->best = deviation;
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
        memcpy(rollout->from_tip, now->tip, sizeof rollout->from_tip);
        memcpy(rollout->from_velocity, now->velocity, sizeof rollout->from_velocity);
        begin(escape, 0, &model->params->remedy, now);
    }
    roll_on(escape, model, now);
    return stuck;
}
