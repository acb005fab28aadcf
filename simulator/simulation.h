// SPDX-License-Identifier: BSD-3-Clause
// Simulation: the two ways of running the plant in a process of its own.
//
// Units    see plant.h.
// Frames   see plant.h.
// Arrays   none.
// Memory   lives as long as the process.
// Errors   a run returns the program's exit status and has said why on stderr.
#ifndef LW_SIMULATOR_SIMULATION_H
#define LW_SIMULATOR_SIMULATION_H

#include "bus/gate.h"        // struct lw_gate
#include "program/program.h" // struct lw_program
#include "scene/sensor.h"    // struct lw_sensor
#include "simulator/plant.h" // struct lw_plant

struct lw_simulation {
    struct lw_program *program;
    struct lw_plant plant;
    struct lw_plant_state arm;
    int64_t last_tick; // plant periods after which the scene is done
};

// Fixed rate, own clock, real-time threads. Ends when done, or on SIGINT or SIGTERM after ramping to rest; a
// second one ends it at once.
int lw_simulation_live(struct lw_simulation *simulation);

// Waits for the controller's answer once per controller period. Ends when done, or on SIGINT or SIGTERM.
int lw_simulation_lockstep(struct lw_simulation *simulation);

// The gate of this plant, shut for a moment from now on.
struct lw_gate lw_simulation_gate(const struct lw_simulation *simulation);

// Publishes the arm's state.
//   out  the state as sent, stamp included; NULL = not wanted
LW_MUST_CHECK enum lw_status lw_simulation_publish_state(const struct lw_simulation *simulation, struct lw_bus *bus,
                                                         struct lw_joint_state *out);

// How far a sample of the sensor has been told.
struct lw_told {
    int count;                     // of its messages
    bool all;                      // there are no more
    enum lw_world_channel channel; // of the last one
    int64_t seq;                   // of the last one, on its channel
};

// Publishes the next messages of a sample, behind those told already.
//   now_ns  in      as lw_sensor_tell
//   most    in      as many of them at most
//   told    in/out  {0} at first
LW_MUST_CHECK enum lw_status lw_simulation_tell(const struct lw_sensor *sensor, int64_t now_ns, int most,
                                                struct lw_bus *bus, struct lw_told *told);

#endif
