// SPDX-License-Identifier: BSD-3-Clause
// In-process run of a scene.
//
// Units    metres, radians, seconds; ns where a name says so.
// Frames   base frame of the arm.
// Arrays   see batch.h.
// Memory   the heap while it runs.
// Errors   see batch.h.
#include "simulator/batch.h"

#include "base/clock.h"      // LW_NS_PER_S
#include "collision/world.h" // lw_world_apply
#include "controller/tick.h" // lw_tick
#include "scene/sensor.h"    // lw_sensor_*
#include "simulator/plant.h" // lw_plant_step

#include <stdlib.h> // calloc
#include <string.h> // memcpy

// Sessions of the two parties; any two numbers do, nobody else is there.
enum { PLANT_SESSION = 1, CONTROLLER_SESSION = 2 };

static void store(const struct lw_batch_result *result, int64_t row, const struct lw_controller *config,
                  const struct lw_joint_command *command)
{
    struct lw_pose frame[LW_NJ];
    result->t[row] = (double)command->tick_ns / (double)LW_NS_PER_S;
    memcpy(&result->q[row * LW_NJ], command->q, sizeof command->q);
    memcpy(&result->qd[row * LW_NJ], command->qd, sizeof command->qd);
    if (lw_arm_fk(config->arm, command->q, frame) == LW_OK)
        memcpy(&result->tip[row * 3], frame[LW_NJ - 1].p, sizeof frame->p);
    result->deviation[row] = command->deviation;
    result->clearance[row] = command->nearest.clearance;
    result->self_clearance[row] = command->self_clearance;
    result->flags[row] = (int)command->flags;
    result->outcome[row] = (int)command->law_outcome;
}

// All that a run needs, on the heap: a snapshot is too large for a stack.
struct run {
    struct lw_controller config;
    struct lw_controller_state state;
    struct lw_plant plant;
    struct lw_plant_state arm;
    struct lw_sensor sensor;
    int64_t told; // messages of it
    struct lw_world world;
    struct lw_snapshot seen; // the world as the tick sees it
};

// Takes in what the sensor tells at a time of motion.
static enum lw_status hear(struct run *run, int64_t now_ns)
{
    enum lw_status status = LW_OK;
    if (!lw_sensor_look(&run->sensor, now_ns))
        return LW_OK;
    struct lw_obstacle_change change;
    for (int i = 0; status == LW_OK && lw_sensor_tell(&run->sensor, now_ns, i, &change); i++) {
        change.stamp = (struct lw_stamp){.session = PLANT_SESSION, .seq = ++run->told};
        status = lw_world_apply(&run->world, &change);
    }
    return status == LW_OK ? lw_world_build(&run->world, &run->seen) : status;
}

// One controller period.
static enum lw_status step(struct run *run, int64_t k, int ratio, struct lw_joint_command *command)
{
    static const struct lw_request no_request = {0};
    struct lw_joint_state joint;
    const int64_t now_ns = run->arm.tick * run->plant.period_ns;
    const enum lw_status status = hear(run, now_ns);
    lw_plant_report(&run->plant, &run->arm, &joint);
    joint.stamp.seq = k + 1;
    const struct lw_tick_input in = {.time_ns = now_ns, .joint = &joint, .world = &run->seen, .request = &no_request};
    lw_tick(&run->config, &run->state, &in, command);
    command->stamp = (struct lw_stamp){.session = CONTROLLER_SESSION, .seq = k + 1};
    lw_plant_obey(&run->arm, command, now_ns);
    for (int i = 0; i < ratio; i++)
        lw_plant_step(&run->plant, &run->arm, run->arm.tick * run->plant.period_ns);
    return status;
}

enum lw_status lw_batch_run(const struct lw_scene *scene, const struct lw_batch_result *result)
{
    struct run *run = calloc(1, sizeof *run);
    if (run == NULL)
        return LW_E_FULL;
    enum lw_status status = lw_controller_init(&run->config, &run->state, scene, CONTROLLER_SESSION);
    lw_plant_init(&run->plant, &run->arm, scene, PLANT_SESSION);
    lw_sensor_init(&run->sensor, scene);
    const int64_t steps = lw_scene_steps(scene);
    const int ratio = lw_scene_plant_ratio(scene);
    for (int64_t k = 0; status == LW_OK && k <= steps; k++) {
        struct lw_joint_command command;
        status = step(run, k, ratio, &command);
        store(result, k, &run->config, &command);
    }
    free(run);
    return status;
}
