// SPDX-License-Identifier: BSD-3-Clause
// In-process run of a scene.
//
// Units    metres, radians, seconds; ns where a name says so.
// Frames   base frame of the arm.
// Arrays   see batch.h.
// Memory   stack only.
// Errors   see batch.h.
#include "simulator/batch.h"

#include "base/clock.h"      // LW_NS_PER_S
#include "controller/tick.h" // lw_tick
#include "simulator/plant.h" // lw_plant_step

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
    result->distance[row] = command->nearest.clearance;
    result->flags[row] = (int)command->flags;
}

enum lw_status lw_batch_run(const struct lw_scene *scene, const struct lw_batch_result *result)
{
    struct lw_controller config;
    struct lw_controller_state state;
    enum lw_status status = lw_controller_init(&config, &state, scene, CONTROLLER_SESSION);
    if (status != LW_OK)
        return status;
    struct lw_plant plant;
    struct lw_plant_state arm;
    lw_plant_init(&plant, &arm, scene, PLANT_SESSION);

    // The world as the bus would have brought it.
    static const struct lw_request no_request = {0};
    struct lw_obstacle_change change;
    struct lw_world world = {0};
    lw_scene_obstacles(scene, &change);
    change.stamp = (struct lw_stamp){.session = PLANT_SESSION, .seq = 1};
    status = lw_world_apply(&world, &change);

    const int64_t steps = lw_scene_steps(scene);
    const int ratio = lw_scene_plant_ratio(scene);
    for (int64_t k = 0; status == LW_OK && k <= steps; k++) {
        struct lw_joint_state joint;
        struct lw_joint_command command;
        const int64_t now_ns = arm.tick * plant.period_ns;
        lw_plant_report(&plant, &arm, &joint);
        joint.stamp.seq = k + 1;
        const struct lw_tick_input in = {.time_ns = now_ns, .joint = &joint, .world = &world, .request = &no_request};
        lw_tick(&config, &state, &in, &command);
        store(result, k, &config, &command);

        command.stamp = (struct lw_stamp){.session = CONTROLLER_SESSION, .seq = k + 1};
        lw_plant_obey(&arm, &command, now_ns);
        for (int i = 0; i < ratio; i++)
            lw_plant_step(&plant, &arm, arm.tick * plant.period_ns);
    }
    return status;
}
