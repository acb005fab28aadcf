// SPDX-License-Identifier: BSD-3-Clause
// The tables of every key that obstacles, sensor and tool may have, and their defaults.
//
// Units    stated per key.
// Frames   base frame of the arm; the tool in frame 6.
// Arrays   see scene_obstacles.h.
// Memory   constants.
// Errors   none.
#include "scene/scene.h"

#include <math.h>   // HUGE_VAL
#include <stddef.h> // offsetof

static const char *const shape_names[] = {"sphere", "capsule", "box", "hull", "plane", NULL};
static const char *const motion_names[] = {"none", "waypoints", "circle", "random", NULL};
static const char *const repeat_names[] = {"once", "loop", "back_and_forth", NULL};
static const char *const tool_names[] = {"none", "capsule", "hull", NULL};

static const struct lw_pool pool = {.offset = offsetof(struct lw_scene, number),
                                    .used_offset = offsetof(struct lw_scene, number_count),
                                    .capacity = LW_SCENE_NUMBERS};

#define CHOICE(choices) .kind = LW_CHOICE, .names = (choices)
#define POINT .kind = LW_VECTOR, .count = 3, .min = -100, .max = 100, .unit = "m"
#define POINTS .kind = LW_ROWS, .count = LW_HULL_MAX, .width = 3, .pool = &pool, .min = -100, .max = 100, .unit = "m"
#define SIZE .kind = LW_NUMBER, .min = 0, .max = 100, .unit = "m"
#define DIRECTION .kind = LW_VECTOR, .count = 3, .min = -1e3, .max = 1e3
#define TIME .kind = LW_NUMBER, .min = 0, .max = 86400, .unit = "s"

// Keys of some shapes, motions or tools alone.
#define ONE(value) (1U << (value))
#define SHAPES(some) .choice = &lw_scene_obstacle_keys[1], .choices = (some)
#define ROUND (ONE(LW_SPHERE) | ONE(LW_CAPSULE))
#define EDGED (ONE(LW_BOX) | ONE(LW_HULL))
#define TURNED (ONE(LW_CAPSULE) | EDGED)
#define MOTIONS(some) .choice = &motion_keys[0], .choices = (some)
#define TOOLS(some) .choice = &lw_scene_tool_keys[0], .choices = (some)

// clang-format off: one key a line

#define OF(field) .offset = offsetof(struct lw_scene_obstacle, field)
static const struct lw_key motion_keys[] = {
    {.name = "kind", CHOICE(motion_names), OF(motion.kind),
     .help = "waypoints: straight from place to place; circle: about an axis; random: a smooth way that the seed draws"},
    {.name = "waypoints", POINTS, OF(motion.waypoints), .required = true, MOTIONS(ONE(LW_MOTION_WAYPOINTS)),
     .help = "where it goes from `at`"},
    {.name = "times_s", .kind = LW_ROWS, .count = LW_HULL_MAX + 1, .width = 1, .pool = &pool, .min = 0,
     .above_min = true, .max = 86400, .unit = "s", OF(motion.times_s), MOTIONS(ONE(LW_MOTION_WAYPOINTS)),
     .help = "when it is there, counted from start_s; a loop has one more, for the way back to `at`; [] = by speed"},
    {.name = "speed", .kind = LW_NUMBER, .min = 0, .max = 20, .unit = "m/s", OF(motion.speed),
     MOTIONS(ONE(LW_MOTION_WAYPOINTS) | ONE(LW_MOTION_RANDOM)),
     .help = "waypoints: of the whole way, instead of times_s; random: it is never faster"},
    {.name = "repeat", CHOICE(repeat_names), OF(motion.repeat), MOTIONS(ONE(LW_MOTION_WAYPOINTS)),
     .help = "once: it stays at the last place; loop: from there straight to `at` and so on"},
    {.name = "centre", POINT, OF(motion.centre), .required = true, MOTIONS(ONE(LW_MOTION_CIRCLE)),
     .help = "a point of the axis that it circles"},
    {.name = "axis", DIRECTION, OF(motion.axis), MOTIONS(ONE(LW_MOTION_CIRCLE)),
     .help = "direction of the axis, right-handed; its length does not matter"},
    {.name = "period_s", TIME, .above_min = true, OF(motion.period_s), .required = true,
     MOTIONS(ONE(LW_MOTION_CIRCLE)), .help = "of one circle"},
    {.name = "reach", .kind = LW_VECTOR, .count = 3, .min = 0, .max = 100, .unit = "m", OF(motion.reach),
     .required = true, MOTIONS(ONE(LW_MOTION_RANDOM)), .help = "it is never farther than this from `at`, each way"},
    {.name = NULL}};

const struct lw_key lw_scene_obstacle_keys[] = {
    {.name = "id", .kind = LW_INTEGER, OF(id), .min = 0, .max = 1e9,
     .help = "unique number; 0 or left out = place in the list, from 1"},
    {.name = "shape", CHOICE(shape_names), OF(shape), .help = "what it is; a plane is solid on one side"},
    {.name = "at", POINT, OF(at), .required = true,
     .help = "where it starts: its centre, the origin of a hull's vertices, any point of a plane"},
    {.name = "rpy_deg", .kind = LW_VECTOR, .count = 3, .min = -360, .max = 360, .unit = "degrees", OF(rpy_deg),
     SHAPES(TURNED), .help = "turned about x, then y, then z of the base; a capsule lies along its own z"},
    {.name = "normal", DIRECTION, OF(normal), SHAPES(ONE(LW_HALFSPACE)),
     .help = "out of the solid side; its length does not matter"},
    {.name = "radius", SIZE, OF(radius), SHAPES(ROUND), .help = "0 = a point, or a bare segment"},
    {.name = "half_length", SIZE, OF(half_length), .required = true, SHAPES(ONE(LW_CAPSULE)),
     .help = "from the middle to the end of its axis"},
    {.name = "half_extents", .kind = LW_VECTOR, .count = 3, .min = 0, .above_min = true, .max = 100, .unit = "m",
     OF(half_extents), .required = true, SHAPES(ONE(LW_BOX)), .help = "from the middle to its faces"},
    {.name = "vertices", POINTS, OF(vertices), .required = true, SHAPES(ONE(LW_HULL)),
     .help = "the hull is convex: inner and repeated ones do not matter"},
    {.name = "rounding", SIZE, OF(rounding), SHAPES(EDGED), .help = "added on all sides"},
    {.name = "velocity", .kind = LW_VECTOR, .count = 3, .min = -20, .max = 20, .unit = "m/s", OF(velocity),
     .help = "steady, added to its motion"},
    {.name = "spin", .kind = LW_VECTOR, .count = 3, .min = -20, .max = 20, .unit = "rad/s", OF(spin), SHAPES(TURNED),
     .help = "steady, about axes of the base through its own origin"},
    {.name = "start_s", TIME, OF(start_s), .help = "it stands still until then, in time of motion"},
    {.name = "visible_s", .kind = LW_LIMITS, .count = 2, .min = 0, .max = 86400, .unit = "s", OF(visible_s),
     .help = "from and until when the sensor sees it, in time of motion"},
    {.name = "motion", .kind = LW_SECTION, .keys = motion_keys, .help = "how it moves"},
    {.name = NULL}};

#undef OF
#define OF(field) .offset = offsetof(struct lw_scene, field)
const struct lw_key lw_scene_sensor_keys[] = {
    {.name = "rate_hz", .kind = LW_NUMBER, .min = 0, .max = 1000, .unit = "Hz", OF(sensor.rate_hz),
     .help = "rate of its samples; 0 = 30 when an obstacle moves, else 10"},
    {.name = "noise_m", .kind = LW_NUMBER, .min = 0, .max = 1, .unit = "m", OF(sensor.noise_m),
     .help = "standard deviation of each coordinate of a position; the seed draws it"},
    {.name = "latency_s", .kind = LW_NUMBER, .min = 0, .max = 1, .unit = "s", OF(sensor.latency_s),
     .help = "from a sample until it is told"},
    {.name = "valid_for_s", TIME, .above_min = true, OF(sensor.valid_for_s),
     .help = "an obstacle is forgotten this long after its last sample"},
    {.name = NULL}};

const struct lw_key lw_scene_tool_keys[] = {
    {.name = "kind", CHOICE(tool_names), OF(tool_told.kind), .help = "what is bolted to the flange"},
    {.name = "a", POINT, OF(tool_told.a), .required = true, TOOLS(ONE(LW_TOOL_CAPSULE)),
     .help = "one end of its axis, in the frame of the flange"},
    {.name = "b", POINT, OF(tool_told.b), .required = true, TOOLS(ONE(LW_TOOL_CAPSULE)), .help = "the other end"},
    {.name = "radius", SIZE, .above_min = true, OF(tool_told.radius), TOOLS(ONE(LW_TOOL_CAPSULE) | ONE(LW_TOOL_HULL)),
     .help = "of a capsule; of a hull what is added on all sides"},
    {.name = "vertices", POINTS, OF(tool_told.vertices), .required = true, TOOLS(ONE(LW_TOOL_HULL)),
     .help = "of the hull, in the frame of the flange"},
    {.name = NULL}};

// clang-format on

void lw_scene_obstacles_defaults(struct lw_scene *scene)
{
    for (int i = 0; i < LW_SCENE_OBSTACLES; i++)
        scene->obstacle[i] =
            (struct lw_scene_obstacle){.normal = {0, 0, 1}, .visible_s = {0, HUGE_VAL}, .motion = {.axis = {0, 0, 1}}};
    scene->sensor = (struct lw_sensor_config){.valid_for_s = 2};
    scene->tool_told = (struct lw_scene_tool){.radius = 0.01};
}
