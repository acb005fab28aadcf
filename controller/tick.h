// SPDX-License-Identifier: BSD-3-Clause
// Tick: one period of the controller as a pure function. The live process, lockstep, batch runs and tests call it.
//
// Units    metres, radians, seconds; ns where a name says so.
// Frames   base frame of the arm.
// Arrays   one entry a joint, base to wrist 3.
// Memory   no allocation, no static state; all that lives from tick to tick is in struct lw_controller_state.
// Errors   init refuses a bad configuration; a tick cannot fail, it brakes and says why in its flags.
#ifndef LW_CONTROLLER_TICK_H
#define LW_CONTROLLER_TICK_H

#include "arm/joint.h"          // struct lw_joint_state, struct lw_joint_command, struct lw_request
#include "collision/body.h"     // struct lw_body
#include "collision/snapshot.h" // struct lw_snapshot
#include "controller/escape.h"  // struct lw_escape
#include "controller/law.h"     // struct lw_law
#include "controller/request.h" // struct lw_request_memory
#include "scene/scene.h"        // struct lw_scene

#include <stdbool.h> // bool

// Warm starts reach into the last bits of a distance. Forgotten this often, they let a replay that begins in the middle
// of a run come to the same bits.
enum { LW_WARM_TICKS = 256 };

// Constant for the life of a run.
struct lw_controller {
    int64_t session;      // this controller's, on the wire
    int64_t scene_digest; // of the whole scene
    const struct lw_arm *arm;
    struct lw_body body;
    const struct lw_law *law;
    struct lw_law_params params;
    struct lw_limits limits;
    int64_t period_ns;      // nominal tick
    int64_t stale_after_ns; // a joint state older than this brakes the arm
    double goal[3];         // m, until a GOAL message comes
};

// Lives from tick to tick.
struct lw_controller_state {
    int64_t tick;                      // ticks so far
    int64_t plant_session;             // plant being controlled, 0 = none yet
    int64_t state_seq;                 // joint state used last
    double velocity[LW_NJ];            // rad/s, command in force
    struct lw_request request;         // request in force
    struct lw_request_memory requests; // those obeyed before
    struct lw_escape escape;           // whether the tip is stuck, and what is done about it
    struct lw_warm_table warm;         // where distance queries start; begun anew every LW_WARM_TICKS
};

struct lw_tick_input {
    int64_t time_ns;                    // the tick's own time
    int64_t state_age_ns;               // age of *joint at time_ns
    bool warming_up;                    // all is computed, nothing may move
    const struct lw_joint_state *joint; // newest joint state; session 0 = none yet
    const struct lw_snapshot *world;    // newest snapshot; version 0 = nothing heard yet
    const struct lw_request *request;   // newest request; session 0 = none yet
};

// Everything a run of `scene` needs, for the controller of a session. Fails LW_E_ARGUMENT when the scene names no
// known robot or law.
LW_MUST_CHECK enum lw_status lw_controller_init(struct lw_controller *config, struct lw_controller_state *state,
                                                const struct lw_scene *scene, int64_t session);

// One tick: estimate, select request, look around, law, guard, explain.
//   out  command and explanation; stamp, compute_ns, wake_late_ns, previous_exec_ns and skipped are left 0 for the
//        process to fill
// Cost: fixed, plus the broad phase over all obstacles, plus the pairs in reach; about 0.9 MB of stack.
void lw_tick(const struct lw_controller *config, struct lw_controller_state *state, const struct lw_tick_input *in,
             struct lw_joint_command *out);

// True when the command in force is zero.
bool lw_controller_at_rest(const struct lw_controller_state *state);

#endif
