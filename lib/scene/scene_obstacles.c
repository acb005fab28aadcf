// SPDX-License-Identifier: BSD-3-Clause
// Obstacles, sensor and tool of a scene: what one key leaves to others, and the checks that concern several keys.
//
// Units    see scene_obstacles.h.
// Frames   see scene_obstacles.h.
// Arrays   see scene_obstacles.h.
// Memory   stack only.
// Errors   see scene_obstacles.h.
#include "scene/scene_obstacles.h"

#include "base/vec.h"     // lw_vec_*
#include "scene/motion.h" // lw_motion_moves, lw_motion_length_s

#include <math.h>   // sin, cos, sqrt, hypot, fabs
#include <stdarg.h> // va_list
#include <string.h> // memcpy

#define PI 3.14159265358979323846

static const double speed_max = 20; // m/s, of an obstacle on its way

// --- where an error stands ---

struct check {
    const struct lw_scene *scene;
    const struct lw_source *source;
    struct lw_error *error;
    int obstacle; // place in the list
};

static enum lw_status refuse(const struct check *c, const char *format, ...) __attribute__((format(printf, 2, 3)));

// Fills the error: file, line where it is known, obstacle, then the text.
static enum lw_status refuse(const struct check *c, const char *format, ...)
{
    char line[16] = "", what[400];
    const int number = c->scene->obstacle[c->obstacle].line;
    if (number > 0)
        snprintf(line, sizeof line, ":%d", number);
    va_list args;
    va_start(args, format);
    vsnprintf(what, sizeof what, format, args);
    va_end(args);
    snprintf(c->error->text, sizeof c->error->text, "%.100s%s: obstacles.%d%s", c->source->name, line, c->obstacle,
             what);
    return LW_E_SCENE;
}

// --- defaults that are other keys' values ---

static struct lw_tool make_tool(const struct lw_scene *scene)
{
    const struct lw_scene_tool *from = &scene->tool_told;
    struct lw_tool tool = {.kind = (enum lw_tool_kind)from->kind, .radius = from->radius};
    if (tool.kind == LW_TOOL_CAPSULE) {
        memcpy(tool.capsule.a, from->a, sizeof tool.capsule.a);
        memcpy(tool.capsule.b, from->b, sizeof tool.capsule.b);
        tool.capsule.r = from->radius;
    }
    if (tool.kind == LW_TOOL_HULL) {
        tool.count = from->vertices.count;
        memcpy(tool.vertex, &scene->number[from->vertices.first], (size_t)tool.count * 3 * sizeof *tool.vertex);
    }
    return tool;
}

void lw_scene_obstacles_resolve(struct lw_scene *scene)
{
    bool moving = false;
    for (int i = 0; i < scene->obstacle_count; i++) {
        moving |= lw_motion_moves(&scene->obstacle[i]);
        if (scene->obstacle[i].id == 0)
            scene->obstacle[i].id = i + 1;
    }
    if (scene->sensor.rate_hz == 0)
        scene->sensor.rate_hz = moving ? 30 : 10;
    scene->tool = make_tool(scene);
}

// --- orientation ---

// The shortest turn from z to a direction. Of sine and cosine of half the angle the larger one is computed, the other
// follows from it: so both keep their digits.
static void turn_to(const double direction[3], double quat[4])
{
    const double length = lw_vec_norm(direction), z = direction[2] / length;
    const double side = hypot(direction[0], direction[1]) / length, larger = sqrt(0.5 * (1 + fabs(z)));
    const double smaller = side / (2 * larger), s = z < 0 ? larger : smaller;
    quat[0] = z < 0 ? smaller : larger;
    quat[1] = side > 0 ? -s * direction[1] / (side * length) : s;
    quat[2] = side > 0 ? s * direction[0] / (side * length) : 0;
    quat[3] = 0;
}

void lw_scene_obstacle_quat(const struct lw_scene_obstacle *obstacle, double quat[4])
{
    if (obstacle->shape == LW_HALFSPACE) {
        turn_to(obstacle->normal, quat);
        return;
    }
    double c[3], s[3];
    for (int i = 0; i < 3; i++) {
        c[i] = cos(obstacle->rpy_deg[i] * PI / 360);
        s[i] = sin(obstacle->rpy_deg[i] * PI / 360);
    }
    quat[0] = c[2] * c[1] * c[0] + s[2] * s[1] * s[0];
    quat[1] = c[2] * c[1] * s[0] - s[2] * s[1] * c[0];
    quat[2] = c[2] * s[1] * c[0] + s[2] * c[1] * s[0];
    quat[3] = s[2] * c[1] * c[0] - c[2] * s[1] * s[0];
}

// --- shapes ---

static enum lw_status check_shape(const struct check *c, const struct lw_scene_obstacle *o)
{
    static const char *const names[] = {"sphere", "capsule", "box", "hull", "plane"};
    if (o->shape == LW_HALFSPACE && lw_vec_norm(o->normal) == 0)
        return refuse(c, ".normal: expected a direction, found [0, 0, 0]");
    const struct lw_solid solid = {.kind = (enum lw_shape_kind)o->shape,
                                   .radius = o->shape == LW_BOX || o->shape == LW_HULL ? o->rounding : o->radius,
                                   .half_length = o->half_length,
                                   .half = {o->half_extents[0], o->half_extents[1], o->half_extents[2]},
                                   .normal = {0, 0, 1},
                                   .count = o->vertices.count,
                                   .vertex = &c->scene->number[o->vertices.first]};
    double quat[4], room[LW_HULL_ROOM];
    struct lw_pose pose;
    struct lw_shape shape;
    const char *reason = "its orientation is not a number";
    lw_scene_obstacle_quat(o, quat);
    enum lw_status status = lw_pose_make(o->at, quat, &pose);
    if (status == LW_OK)
        status = lw_shape_make(&solid, &pose, room, &shape, &reason);
    return status == LW_OK ? LW_OK : refuse(c, ": expected a %s, found that %s", names[o->shape], reason);
}

// --- motion ---

// Times rise, one a waypoint and one for the way back of a loop.
static enum lw_status check_times(const struct check *c, const struct lw_scene_motion *motion)
{
    const double *times = &c->scene->number[motion->times_s.first];
    const bool loop = motion->repeat == LW_REPEAT_LOOP;
    const int expected = motion->waypoints.count + loop;
    if (motion->times_s.count != expected)
        return refuse(c, ".motion.times_s: expected %d, one a waypoint%s, found %d", expected,
                      loop ? " and one for the way back" : "", motion->times_s.count);
    for (int k = 1; k < expected; k++)
        if (times[k] <= times[k - 1])
            return refuse(c, ".motion.times_s: expected times that rise, found %g after %g", times[k], times[k - 1]);
    return LW_OK;
}

static enum lw_status check_waypoints(const struct check *c, const struct lw_scene_obstacle *o)
{
    const struct lw_scene_motion *motion = &o->motion;
    const bool by_times = motion->times_s.count > 0, by_speed = motion->speed > 0;
    if (motion->waypoints.count == 0)
        return refuse(c, ".motion.waypoints: expected at least one place, found none");
    if (by_times == by_speed)
        return refuse(c, ".motion: expected either times_s or a speed > 0, found %s", by_times ? "both" : "neither");
    if (by_times)
        return check_times(c, motion);
    if (!(lw_motion_length_s(c->scene, o) > 0))
        return refuse(c, ".motion.waypoints: expected a place other than `at`, found none");
    return LW_OK;
}

static enum lw_status check_circle(const struct check *c, const struct lw_scene_obstacle *o)
{
    double arm[3], across[3];
    const double length = lw_vec_norm(o->motion.axis);
    if (length == 0)
        return refuse(c, ".motion.axis: expected a direction, found [0, 0, 0]");
    lw_vec_sub(o->at, o->motion.centre, arm);
    lw_vec_cross(o->motion.axis, arm, across);
    const double speed = 2 * PI * lw_vec_norm(across) / length / o->motion.period_s;
    if (!(speed > 0 && speed <= speed_max))
        return refuse(c, ".motion: expected a circle at a speed > 0 and <= %g (m/s), found %g", speed_max, speed);
    return LW_OK;
}

static enum lw_status check_random(const struct check *c, const struct lw_scene_obstacle *o)
{
    if (lw_vec_norm(o->motion.reach) < 1e-3)
        return refuse(c, ".motion.reach: expected at least 0.001 (m) one way, found less");
    if (!(o->motion.speed > 0))
        return refuse(c, ".motion.speed: expected a number > 0 (m/s), found %g", o->motion.speed);
    return LW_OK;
}

static enum lw_status check_motion(const struct check *c, const struct lw_scene_obstacle *o)
{
    switch (o->motion.kind) {
    case LW_MOTION_WAYPOINTS: return check_waypoints(c, o);
    case LW_MOTION_CIRCLE: return check_circle(c, o);
    case LW_MOTION_RANDOM: return check_random(c, o);
    default: return LW_OK;
    }
}

// --- all of an obstacle ---

static enum lw_status check_obstacle(const struct check *c)
{
    const struct lw_scene_obstacle *o = &c->scene->obstacle[c->obstacle];
    for (int k = 0; k < c->obstacle; k++)
        if (o->id == c->scene->obstacle[k].id)
            return refuse(c, ".id: expected a number of its own, found %d again", o->id);
    if (!(o->visible_s[0] < o->visible_s[1]))
        return refuse(c, ".visible_s: expected from < until, found %g and %g", o->visible_s[0], o->visible_s[1]);
    const enum lw_status status = check_shape(c, o);
    return status == LW_OK ? check_motion(c, o) : status;
}

// --- sensor and tool ---

static enum lw_status check_sensor(const struct check *c)
{
    const struct lw_sensor_config *sensor = &c->scene->sensor;
    const double least = sensor->latency_s + 2 / sensor->rate_hz;
    if (sensor->valid_for_s >= least)
        return LW_OK;
    snprintf(c->error->text, sizeof c->error->text,
             "%.100s: sensor.valid_for_s: expected at least two samples and the latency, %g s, found %g",
             c->source->name, least, sensor->valid_for_s);
    return LW_E_SCENE;
}

static enum lw_status check_tool(const struct check *c)
{
    const char *reason = NULL;
    if (lw_tool_check(&c->scene->tool, &reason) == LW_OK)
        return LW_OK;
    snprintf(c->error->text, sizeof c->error->text, "%.100s: tool: expected a solid, found that %s", c->source->name,
             reason);
    return LW_E_SCENE;
}

enum lw_status lw_scene_obstacles_check(const struct lw_scene *scene, const struct lw_source *source,
                                        struct lw_error *error)
{
    struct check c = {.scene = scene, .source = source, .error = error};
    enum lw_status status = check_sensor(&c);
    if (status == LW_OK)
        status = check_tool(&c);
    for (; status == LW_OK && c.obstacle < scene->obstacle_count; c.obstacle++)
        status = check_obstacle(&c);
    return status;
}
