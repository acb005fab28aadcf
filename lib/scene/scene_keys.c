// SPDX-License-Identifier: BSD-3-Clause
// The table of every key a scene may have, and the defaults of those it may leave out.
//
// Units    stated per key.
// Frames   base frame of the arm.
// Arrays   see scene.h.
// Memory   constants.
// Errors   none.
#include "scene/scene.h"

#include <math.h>   // HUGE_VAL
#include <stddef.h> // offsetof

#define PI 3.14159265358979323846

static const char *const robot_names[] = {"ur5", "ur10", NULL};
static const char *const law_names[] = {"apf", NULL};
static const char *const control_point_names[] = {"joints", "capsules", "capsules_fine", NULL};
static const char *const attraction_names[] = {"cone", "cone_par", NULL};
static const char *const remedy_names[] = {"none", "vortex", "rollout", NULL};

// Field of the scene, and the ranges that come again.
#define AT(field) .offset = offsetof(struct lw_scene, field)
#define JOINTS .kind = LW_VECTOR, .count = LW_NJ
#define LIMITS(limit_unit) .kind = LW_LIMITS, .count = LW_NJ, .min = 1e-6, .max = HUGE_VAL, .unit = limit_unit
#define POSITIVE .min = 0, .max = HUGE_VAL, .above_min = true
#define ANGLE .min = -2 * PI, .max = 2 * PI, .unit = "rad"
#define WORKSPACE .kind = LW_VECTOR, .count = 3, .min = -100, .max = 100, .unit = "m"
#define CHOICE(choices) .kind = LW_CHOICE, .names = (choices)
#define RATE .kind = LW_NUMBER, .max = 10000, .unit = "Hz"

// clang-format off: one key a line

static const struct lw_key limit_keys[] = {
    {.name = "position_min", JOINTS, AT(limits.position_min), ANGLE, .help = "lower end of the joint ranges"},
    {.name = "position_max", JOINTS, AT(limits.position_max), ANGLE, .help = "upper end of the joint ranges"},
    {.name = "velocity", LIMITS("rad/s"), AT(limits.velocity), .help = "joint speed limit of the guard"},
    {.name = "acceleration", LIMITS("rad/s^2"), AT(limits.acceleration),
     .help = "joint acceleration limit of the guard"},
    {.name = "clearance", .kind = LW_LIMITS, .count = 1, AT(limits.clearance), .min = 0, .max = 10, .unit = "m",
     .help = "distance that the guard keeps from obstacles and between links, as far as the arm can brake for it"},
    {.name = NULL}};

static const struct lw_key plant_keys[] = {
    {.name = "rate_hz", RATE, .min = 0, AT(plant.rate_hz),
     .help = "own rate of the plant, a whole multiple of the top-level rate_hz; 0 = the same"},
    {.name = "timeout_s", .kind = LW_NUMBER, AT(plant.timeout_s), .min = 0, .above_min = true, .max = 60, .unit = "s",
     .help = "without a command for this long the plant ramps to rest"},
    {.name = "velocity", LIMITS("rad/s"), AT(plant.velocity), .help = "joint speed limit of the plant"},
    {.name = "acceleration", LIMITS("rad/s^2"), AT(plant.acceleration),
     .help = "joint acceleration limit of the plant"},
    {.name = NULL}};

static const struct lw_key law_keys[] = {
    {.name = "name", CHOICE(law_names), AT(law.name), .help = "law that moves the arm"},
    {.name = "control_points", CHOICE(control_point_names), AT(law.control_points),
     .help = "what obstacles repel: joints = origins of the DH frames 2 to 6; capsules = the whole arm, 6 of them; "
             "capsules_fine = 10 closer ones"},
    {.name = "attraction", CHOICE(attraction_names), AT(law.apf.attraction),
     .help = "cone: constant pull; cone_par: proportional within r0 of the goal"},
    {.name = "gamma", .kind = LW_INTEGER, .min = 1, .max = 2, AT(law.apf.gamma),
     .help = "exponent of the repulsive potential"},
    {.name = "k_a", .kind = LW_NUMBER, AT(law.apf.k_a), POSITIVE, .unit = "rad/s per m",
     .help = "gain of the attraction"},
    {.name = "r0", .kind = LW_NUMBER, AT(law.apf.r0), POSITIVE, .unit = "m",
     .help = "radius of the proportional zone of cone_par"},
    {.name = "eta", .kind = LW_NUMBER, AT(law.apf.eta), POSITIVE, .help = "gain of the repulsion"},
    {.name = "rho_rep", .kind = LW_NUMBER, AT(law.apf.rho_rep), POSITIVE, .unit = "m",
     .help = "reach of the repulsion from an obstacle's surface"},
    {.name = "distance_min", .kind = LW_NUMBER, AT(law.apf.distance_min), POSITIVE, .unit = "m",
     .help = "smaller distances count as this, which bounds the force"},
    {.name = "approach_s", .kind = LW_NUMBER, AT(law.apf.approach_s), .min = 0, .max = 10, .unit = "s",
     .help = "an obstacle that comes counts as nearer by its way in this time; 0 = only where it is now"},
    {.name = "eta_self", .kind = LW_NUMBER, AT(law.apf.eta_self), .min = 0, .max = HUGE_VAL,
     .help = "gain of the repulsion between links, 0 = none"},
    {.name = "rho_self", .kind = LW_NUMBER, AT(law.apf.rho_self), POSITIVE, .unit = "m",
     .help = "reach of the repulsion between links"},
    {.name = "remedy", CHOICE(remedy_names), AT(law.remedy.kind),
     .help = "against standing still away from the goal: vortex = always circulate about axis; rollout = when stuck try "
             "circulations ahead and keep the best"},
    {.name = "axis", .kind = LW_VECTOR, .count = 3, AT(law.remedy.axis), .min = -10, .max = 10,
     .help = "axis of the vortex, used as it is"},
    {.name = "circulation", .kind = LW_NUMBER, AT(law.remedy.circulation), .min = 0, .max = 10,
     .help = "strength of the circulation as a part of the repulsion"},
    {.name = NULL}};

static const struct lw_key request_keys[] = {
    {.name = "goal", WORKSPACE, AT(goal), .required = true, .help = "target of the tip"},
    {.name = NULL}};

static const struct lw_key scene_keys[] = {
    {.name = "robot", CHOICE(robot_names), AT(robot), .required = true, .help = "arm"},
    {.name = "rate_hz", RATE, .min = 1, AT(rate_hz), .help = "rate of the controller"},
    {.name = "duration_s", .kind = LW_NUMBER, AT(duration_s), .min = 0, .above_min = true, .max = 86400, .unit = "s",
     .help = "length of the run, counted in time of motion"},
    {.name = "q0", JOINTS, AT(q0), ANGLE, .required = true, .help = "joint positions at the start"},
    {.name = "limits", .kind = LW_SECTION, .keys = limit_keys, .help = "guard of the controller"},
    {.name = "plant", .kind = LW_SECTION, .keys = plant_keys, .help = "simulated arm"},
    {.name = "law", .kind = LW_SECTION, .keys = law_keys, .help = "what moves the arm"},
    {.name = "request", .kind = LW_SECTION, .keys = request_keys, .help = "what the arm is asked to do"},
    {.name = "seed", .kind = LW_INTEGER, .min = 0, .max = 1e9, AT(seed),
     .help = "of everything that is drawn: noise, random motion"},
    {.name = "tool", .kind = LW_SECTION, .keys = lw_scene_tool_keys, .help = "what the flange carries"},
    {.name = "sensor", .kind = LW_SECTION, .keys = lw_scene_sensor_keys,
     .help = "how the simulator's sensor reports obstacles"},
    {.name = "obstacles", .kind = LW_LIST, AT(obstacle), .count = LW_SCENE_OBSTACLES, .keys = lw_scene_obstacle_keys,
     .stride = sizeof(struct lw_scene_obstacle), .count_offset = offsetof(struct lw_scene, obstacle_count),
     .line_offset = offsetof(struct lw_scene_obstacle, line),
     .help = "what the simulator's sensor reports on the bus"},
    {.name = NULL}};

// clang-format on

const struct lw_key *lw_scene_keys(void)
{
    return scene_keys;
}

static void fill(double *values, double value)
{
    for (int j = 0; j < LW_NJ; j++)
        values[j] = value;
}

struct lw_scene lw_scene_defaults(enum lw_robot robot)
{
    struct lw_scene scene = {
        .robot = (int)robot,
        .rate_hz = 500,
        .duration_s = 8,
        .plant = {.timeout_s = 0.02},
        .law = {.name = LW_LAW_APF,
                .control_points = LW_BODY_CAPSULES,
                .apf = {.attraction = LW_ATTRACTION_CONE_PAR,
                        .gamma = 2,
                        .k_a = 2,
                        .r0 = 0.02,
                        .eta = 5e-5,
                        .rho_rep = 0.05,
                        .distance_min = 0.005,
                        .approach_s = 0.2,
                        .eta_self = 2e-5,
                        .rho_self = 0.05},
                .remedy = {.kind = LW_REMEDY_ROLLOUT, .axis = {0, 0, -1}, .circulation = 1}},
        .limits = {.clearance = 0.01},
    };
    const struct lw_arm *arm = lw_arm_get(robot);
    for (int j = 0; j < LW_NJ; j++) {
        scene.limits.position_min[j] = -arm->position_max[j];
        scene.limits.position_max[j] = arm->position_max[j];
        scene.limits.velocity[j] = scene.plant.velocity[j] = arm->velocity_max[j];
    }
    // The plant holds the guard's limit too: after a lost command it does not make up for it in one step.
    fill(scene.limits.acceleration, 8);
    fill(scene.plant.acceleration, 8);
    lw_scene_obstacles_defaults(&scene);
    return scene;
}
