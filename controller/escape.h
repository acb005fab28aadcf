// SPDX-License-Identifier: BSD-3-Clause
// Escape: out of places where the forces of goal and obstacles balance. When the arm is stuck, its motion is rolled out
// in several ways, on the plant model and with the guard, a bounded number of steps a tick: on as it is, with
// circulations around the obstacles, or aside for a moment. The way that ends nearest to the goal is taken.
//
// A circulation c turns the repulsion of obstacles aside by c x (-n): a vortex field (De Medio & Oriolo 1991). Choosing
// its direction by predicted motion follows Becker et al., "Circular fields and predictive multi-agents for online
// global trajectory planning", RA-L 6(2), 2021.
//
// Units    metres, radians, seconds; ns where a name says so.
// Frames   base frame of the arm.
// Arrays   one entry a joint.
// Memory   plain data, part of the controller's state.
// Errors   none: without a better direction the law goes on as it was, and tries again later.
#ifndef LW_CONTROLLER_ESCAPE_H
#define LW_CONTROLLER_ESCAPE_H

#include "controller/law.h"   // struct lw_law
#include "controller/stuck.h" // struct lw_stuck

// What a roll-out imitates.
struct lw_escape_model {
    const struct lw_law *law;
    const struct lw_law_params *params;
    const struct lw_limits *limits;
    const struct lw_arm *arm;
    const struct lw_body *body;
};

// The moment of a tick.
struct lw_escape_now {
    const struct lw_snapshot *world;
    const double *q, *velocity; // [6] rad, [6] rad/s
    const double *tip, *goal;   // [3] m
    double deviation;           // m
    struct lw_stuck_tick tick;
};

// A way out to try: turning around obstacles, or moving aside in any direction first.
struct lw_way_out {
    double circulation[3]; // axis times strength
    bool moves_aside;
    double aside[LW_NJ]; // rad/s, to move with first, the goal left alone
};

// A roll-out in progress.
struct lw_rollout {
    int candidate; // direction tried, -1 = none in progress
    int steps;     // done of this candidate
    int64_t from_ns;
    double from_q[LW_NJ], from_velocity[LW_NJ]; // where all candidates start
    double q[LW_NJ], velocity[LW_NJ];           // where this one is
    struct lw_way_out way;                      // of this candidate
    double best;                                // m, deviation at the end of the best candidate so far, of the first
                                                // one less what another has to be better by
    int best_candidate;
    struct lw_way_out best_way;
};

struct lw_escape {
    struct lw_stuck stuck;
    double circulation[3]; // in force
    double aside[LW_NJ];   // rad/s, motion that leaves the goal alone, until when; 0 = none
    int64_t aside_until_ns;
    int attempts;          // decisions for this goal so far
    int64_t wait_until_ns; // no roll-out begins before
    double nearest;        // m, smallest deviation since the last decision
    int64_t nearest_ns;    // when it was last undercut
    struct lw_rollout rollout;
};

// Begins anew, at the start and with a new goal.
void lw_escape_reset(struct lw_escape *escape, const struct lw_remedy_params *params);

// The arm is braked: it stands for another reason. The circulation found stays.
void lw_escape_pause(struct lw_escape *escape);

// The motion aside in force at a time; NULL = none.
const double *lw_escape_aside(const struct lw_escape *escape, int64_t time_ns);

// One tick: notes the deviation, rolls out, decides. The circulation in force afterwards is escape->circulation.
// Returns whether the tip is stuck. Cost: law and guard once for every 50 us of the period, or for as
// many times that as 64 near pairs are begun, nothing while it moves on.
bool lw_escape_step(struct lw_escape *escape, const struct lw_escape_model *model, const struct lw_escape_now *now);

#endif
