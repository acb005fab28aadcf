// SPDX-License-Identifier: BSD-3-Clause
// Explain: what a command was computed from and how near things were, written into the command itself.
//
// Units    metres, radians; ns where a name says so.
// Frames   base frame of the arm.
// Arrays   one entry a joint.
// Memory   none.
// Errors   none.
#ifndef LW_CONTROLLER_EXPLAIN_H
#define LW_CONTROLLER_EXPLAIN_H

#include "controller/surroundings.h" // struct lw_surroundings
#include "controller/tick.h"         // struct lw_controller

// The answer of a tick that knows nothing: neither the wish nor how near things are.
struct lw_joint_command lw_explain_nothing(void);

// Smallest clearances, of what is in reach or else of all.
void lw_explain_clearance(const struct lw_controller *config, struct lw_controller_state *state,
                          const struct lw_tick_input *in, const struct lw_surroundings *around,
                          struct lw_joint_command *out);

// Echoes of the inputs, and the digest over all of them.
void lw_explain_inputs(const struct lw_controller *config, const struct lw_controller_state *state,
                       const struct lw_tick_input *in, struct lw_joint_command *out);

#endif
