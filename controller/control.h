// SPDX-License-Identifier: BSD-3-Clause
// Control: the two ways of running the controller's tick in a process of its own.
//
// Units    see tick.h.
// Frames   see tick.h.
// Arrays   none.
// Memory   lives as long as the process.
// Errors   a run returns the program's exit status and has said why on stderr.
#ifndef LW_CONTROLLER_CONTROL_H
#define LW_CONTROLLER_CONTROL_H

#include "controller/tick.h" // struct lw_controller
#include "program/program.h" // struct lw_program

struct lw_control {
    struct lw_program *program;
    struct lw_controller config;
    struct lw_controller_state state;
};

// Fixed rate, own clock, real-time threads. Ends on SIGINT or SIGTERM, after the arm was braked to rest.
int lw_control_live(struct lw_control *control);

// One tick per joint state, whenever it comes. Ends on SIGINT or SIGTERM.
int lw_control_lockstep(struct lw_control *control);

#endif
