// SPDX-License-Identifier: BSD-3-Clause
// leeway-controller: command line, wiring, and the choice between live and lockstep.
//
// Units    none.
// Frames   none.
// Arrays   none.
// Memory   static, lives as long as the process.
// Errors   exit status 0 ok, 1 failed, 2 usage or scene refused, 130 after Ctrl-C.
#include "controller/control.h"

#include "base/stop.h" // lw_stop_install

int main(int argc, char **argv)
{
    static struct lw_program program = {
        .name = "leeway-controller",
        .summary = "Moves an arm to its goal and keeps it clear of obstacles: hears JOINT_STATE, OBSTACLES, GOAL and "
                   "STOP, answers with JOINT_COMMAND at a fixed rate.\v"
                   "It moves nothing before it has heard a joint state and an OBSTACLES message. Ctrl-C brakes the arm "
                   "to rest first.\n\n"
                   "Example, in two terminals:\n"
                   "  leeway-simulator scenarios/c1.yaml\n"
                   "  leeway-controller scenarios/c1.yaml",
    };
    static struct lw_control control = {.program = &program};
    lw_program_start(&program, argc, argv);
    if (lw_controller_init(&control.config, &control.state, &program.scene, program.bus_config.session) != LW_OK) {
        lw_program_fail(&program, "%s: scene not usable", program.path);
        return 2;
    }
    lw_stop_install();
    return program.lockstep ? lw_control_lockstep(&control) : lw_control_live(&control);
}
