// SPDX-License-Identifier: BSD-3-Clause
// leeway-simulator: command line, wiring, and the choice between live and lockstep.
//
// Units    none.
// Frames   none.
// Arrays   none.
// Memory   static, lives as long as the process.
// Errors   exit status 0 ok, 1 failed, 2 usage or scene refused, 130 after Ctrl-C.
#include "simulator/simulation.h"

#include "base/clock.h" // lw_clock_mono_ns
#include "base/stop.h"  // lw_stop_install

#include <string.h> // memcpy

// A controller of the plant before must notice first that its plant is gone.
static const int64_t start_guard_ns = LW_NS_PER_S / 4;
struct lw_gate lw_simulation_gate(const struct lw_simulation *simulation)
{
    const struct lw_plant *plant = &simulation->plant;
    struct lw_gate gate = {.plant_session = plant->session,
                           .open_ns = lw_clock_mono_ns() + start_guard_ns,
                           .lease_ns = lw_lease_ns(plant->timeout_ns),
                           .max_lag = 2 * plant->timeout_ns / plant->period_ns};
    memcpy(gate.velocity, plant->velocity, sizeof gate.velocity);
    return gate;
}

enum lw_status lw_simulation_publish_state(const struct lw_simulation *simulation, struct lw_bus *bus,
                                           struct lw_joint_state *out)
{
    union lw_message message;
    lw_plant_report(&simulation->plant, &simulation->arm, &message.joint_state);
    const enum lw_status status = lw_bus_publish(bus, LW_CHANNEL_JOINT_STATE, &message);
    if (out != NULL)
        *out = message.joint_state;
    return status;
}

enum lw_status lw_simulation_tell(const struct lw_sensor *sensor, int64_t now_ns, int most, struct lw_bus *bus,
                                  struct lw_told *told)
{
    union lw_message message;
    enum lw_status status = LW_OK;
    const int end = told->count + most;
    while (status == LW_OK && told->count < end && lw_sensor_tell(sensor, now_ns, told->count, &message.obstacles)) {
        told->channel = lw_change_channel(&message.obstacles);
        status = lw_bus_publish(bus, told->channel == LW_WORLD_HULL ? LW_CHANNEL_HULL : LW_CHANNEL_OBSTACLES, &message);
        told->seq = message.stamp.seq;
        told->count += status == LW_OK;
    }
    told->all = !lw_sensor_tell(sensor, now_ns, told->count, &message.obstacles);
    return status;
}

int main(int argc, char **argv)
{
    static struct lw_program program = {
        .name = "leeway-simulator",
        .summary = "A kinematic arm on the bus: publishes JOINT_STATE at its own rate, obeys JOINT_COMMAND within its "
                   "limits, and reports the scene's obstacles on OBSTACLES as a sensor would.\v"
                   "It holds still until a controller commands it, and ramps to rest when commands cease.\n\n"
                   "Example, in two terminals:\n"
                   "  leeway-simulator scenarios/c1.yaml\n"
                   "  leeway-controller scenarios/c1.yaml",
        .is_simulator = true,
    };
    static struct lw_simulation simulation = {.program = &program};
    lw_program_start(&program, argc, argv);
    lw_plant_init(&simulation.plant, &simulation.arm, &program.scene, program.bus_config.session);
    simulation.last_tick = lw_scene_steps(&program.scene) * lw_scene_plant_ratio(&program.scene);
    lw_stop_install();
    return program.lockstep ? lw_simulation_lockstep(&simulation) : lw_simulation_live(&simulation);
}
