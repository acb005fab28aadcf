// SPDX-License-Identifier: BSD-3-Clause
// Plant: a kinematic arm that follows joint velocity commands within its own limits. Pure functions, time passed in.
//
// Units    radians, seconds; ns where a name says so.
// Frames   none.
// Arrays   one entry a joint, base to wrist 3.
// Memory   plain data, nothing allocated.
// Errors   none.
#ifndef LW_SIMULATOR_PLANT_H
#define LW_SIMULATOR_PLANT_H

#include "arm/joint.h"   // struct lw_joint_command, struct lw_joint_state
#include "scene/scene.h" // struct lw_scene

#include <stdbool.h> // bool

// Constant for the life of a run.
struct lw_plant {
    int64_t session; // this plant's, on the wire
    int64_t period_ns;
    double period_s;
    int64_t timeout_ns;
    double velocity[LW_NJ];     // rad/s, infinite = off
    double acceleration[LW_NJ]; // rad/s^2, infinite = off
};

struct lw_plant_state {
    enum lw_plant_mode mode;
    double q[LW_NJ];         // rad
    double qd[LW_NJ];        // rad/s
    double target[LW_NJ];    // rad/s, command in force
    int64_t tick;            // periods since the first accepted command
    int64_t command_session; // controller obeyed last
    int64_t command_seq;
    int64_t command_ns; // when its newest command was accepted
};

void lw_plant_init(struct lw_plant *plant, struct lw_plant_state *state, const struct lw_scene *scene, int64_t session);

// Obeys a command from the next step on; bus/gate.h has judged it.
void lw_plant_obey(struct lw_plant_state *state, const struct lw_joint_command *command, int64_t now_ns);

// Ramps to rest from the next step on, until a command is accepted.
void lw_plant_stop(struct lw_plant_state *state);

// One period: velocity towards the command within the limits, then q += period * qd. A plant that holds does not move;
// one that has had no command for longer than its timeout ramps to rest.
void lw_plant_step(const struct lw_plant *plant, struct lw_plant_state *state, int64_t now_ns);

bool lw_plant_at_rest(const struct lw_plant_state *state);

// The state as it is published (without stamp).
void lw_plant_report(const struct lw_plant *plant, const struct lw_plant_state *state, struct lw_joint_state *out);

#endif
