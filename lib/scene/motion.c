// SPDX-License-Identifier: BSD-3-Clause
// Ways that obstacles take: waypoints, circles, and sums of sines that the seed draws.
//
// Units    see motion.h.
// Frames   see motion.h.
// Arrays   see motion.h.
// Memory   stack only.
// Errors   see motion.h.
#include "scene/motion.h"

#include "base/noise.h" // lw_noise_uniform
#include "base/vec.h"   // lw_vec_*

#include <math.h>   // sin, cos, fmod
#include <string.h> // memcpy

#define PI 3.14159265358979323846

// --- waypoints ---

// Place number k of a way: 0 is where it starts, a loop ends there too.
static const double *place(const struct lw_scene *scene, const struct lw_scene_obstacle *o, int k)
{
    const struct lw_rows *points = &o->motion.waypoints;
    return k == 0 || k > points->count ? o->at : &scene->number[points->first + 3 * (k - 1)];
}

// Legs of the way, with the way back of a loop.
static int count_legs(const struct lw_scene_motion *motion)
{
    return motion->waypoints.count + (motion->repeat == LW_REPEAT_LOOP);
}

// Time that leg k takes, from place k to place k + 1.
static double leg_time(const struct lw_scene *scene, const struct lw_scene_obstacle *o, int k)
{
    const struct lw_scene_motion *motion = &o->motion;
    const double *times = &scene->number[motion->times_s.first];
    if (motion->times_s.count > 0)
        return k == 0 ? times[0] : times[k] - times[k - 1];
    double way[3];
    lw_vec_sub(place(scene, o, k + 1), place(scene, o, k), way);
    return lw_vec_norm(way) / motion->speed;
}

double lw_motion_length_s(const struct lw_scene *scene, const struct lw_scene_obstacle *obstacle)
{
    double length = 0;
    for (int k = 0; k < count_legs(&obstacle->motion); k++)
        length += leg_time(scene, obstacle, k);
    return length;
}

// Time on the way there, of the first time round; *back when it goes the other way.
static double fold(const struct lw_scene_motion *motion, double t, double length, bool *back)
{
    *back = false;
    if (motion->repeat == LW_REPEAT_LOOP)
        return fmod(t, length);
    if (motion->repeat == LW_REPEAT_ONCE)
        return t;
    const double within = fmod(t, 2 * length);
    *back = within > length;
    return *back ? 2 * length - within : within;
}

static void follow_waypoints(const struct lw_scene *scene, const struct lw_scene_obstacle *o, double t,
                             struct lw_moving *out)
{
    bool back = false;
    double left = fold(&o->motion, t, lw_motion_length_s(scene, o), &back);
    const int legs = count_legs(&o->motion);
    for (int k = 0; k < legs; k++) {
        const double time = leg_time(scene, o, k);
        if (left > time) {
            left -= time;
            continue;
        }
        // On this leg.
        double way[3];
        lw_vec_sub(place(scene, o, k + 1), place(scene, o, k), way);
        memcpy(out->p, place(scene, o, k), sizeof out->p);
        if (time > 0) {
            lw_vec_add_scaled(left / time, way, out->p);
            lw_vec_add_scaled((back ? -1 : 1) / time, way, out->v);
        }
        return;
    }
    memcpy(out->p, place(scene, o, legs), sizeof out->p);
}

// --- circle ---

static void follow_circle(const struct lw_scene_obstacle *o, double t, struct lw_moving *out)
{
    const struct lw_scene_motion *motion = &o->motion;
    const double length = lw_vec_norm(motion->axis), rate = 2 * PI / motion->period_s;
    const double angle = 2 * PI * fmod(t / motion->period_s, 1), c = cos(angle), s = sin(angle);
    double axis[3], arm[3], across[3];
    for (int i = 0; i < 3; i++)
        axis[i] = motion->axis[i] / length;

    // The arm from the axis to the start turns about the axis; what lies along the axis stays.
    lw_vec_sub(o->at, motion->centre, arm);
    lw_vec_add_scaled(-lw_vec_dot(arm, axis), axis, arm);
    lw_vec_cross(axis, arm, across);
    memcpy(out->p, o->at, sizeof out->p);
    lw_vec_add_scaled(c - 1, arm, out->p);
    lw_vec_add_scaled(s, across, out->p);
    lw_vec_add_scaled(-s * rate, arm, out->v);
    lw_vec_add_scaled(c * rate, across, out->v);
}

// --- random ---

enum { TERMS = 3 };
// Shares of the reach, and spread of the frequencies: no two terms of an axis are close.
static const double share[TERMS] = {0.5, 0.3, 0.2}, spread[TERMS] = {1, 1.7, 2.9};

// One sine of one axis, with frequencies still to be scaled.
struct term {
    double frequency, phase;
};

static struct term draw(const struct lw_scene *scene, const struct lw_scene_obstacle *o, int axis, int i)
{
    struct lw_noise noise = {.seed = scene->seed, .owner = o->id, .number = -1 - axis, .part = 2 * i};
    const double frequency = spread[i] * (0.7 + 0.3 * lw_noise_uniform(&noise));
    noise.part++;
    return (struct term){frequency, 2 * PI * lw_noise_uniform(&noise)};
}

// Each coordinate is at + reach/2 * sum share (sin(w t + phase) - sin(phase)): it starts at `at` and stays within
// reach. All frequencies are scaled so that even if all sines rose at once the speed would be the limit.
static void follow_random(const struct lw_scene *scene, const struct lw_scene_obstacle *o, double t,
                          struct lw_moving *out)
{
    double fastest[3] = {0, 0, 0};
    for (int axis = 0; axis < 3; axis++)
        for (int i = 0; i < TERMS; i++)
            fastest[axis] += 0.5 * o->motion.reach[axis] * share[i] * draw(scene, o, axis, i).frequency;
    const double scale = o->motion.speed / lw_vec_norm(fastest);
    for (int axis = 0; axis < 3; axis++) {
        out->p[axis] = o->at[axis];
        for (int i = 0; i < TERMS; i++) {
            const struct term term = draw(scene, o, axis, i);
            const double size = 0.5 * o->motion.reach[axis] * share[i], w = scale * term.frequency;
            out->p[axis] += size * (sin(w * t + term.phase) - sin(term.phase));
            out->v[axis] += size * w * cos(w * t + term.phase);
        }
    }
}

// --- entry ---

// a after b: quaternions w x y z.
static void multiply(const double a[4], const double b[4], double out[4])
{
    out[0] = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3];
    out[1] = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2];
    out[2] = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1];
    out[3] = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0];
}

// Turns by spin * t.
static void turn(const struct lw_scene_obstacle *o, double t, struct lw_moving *out)
{
    const double rate = lw_vec_norm(o->spin);
    if (rate == 0)
        return;
    const double half = 0.5 * rate * t, s = sin(half) / rate;
    const double turned[4] = {cos(half), s * o->spin[0], s * o->spin[1], s * o->spin[2]};
    double start[4];
    memcpy(start, out->quat, sizeof start);
    multiply(turned, start, out->quat);
    memcpy(out->omega, o->spin, sizeof out->omega);
}

void lw_motion_at(const struct lw_scene *scene, const struct lw_scene_obstacle *obstacle, double t,
                  struct lw_moving *out)
{
    *out = (struct lw_moving){.p = {obstacle->at[0], obstacle->at[1], obstacle->at[2]}};
    lw_scene_obstacle_quat(obstacle, out->quat);
    const double since = t - obstacle->start_s;
    if (!(since > 0))
        return;
    switch (obstacle->motion.kind) {
    case LW_MOTION_WAYPOINTS: follow_waypoints(scene, obstacle, since, out); break;
    case LW_MOTION_CIRCLE: follow_circle(obstacle, since, out); break;
    case LW_MOTION_RANDOM: follow_random(scene, obstacle, since, out); break;
    default: break;
    }
    lw_vec_add_scaled(since, obstacle->velocity, out->p);
    lw_vec_add_scaled(1, obstacle->velocity, out->v);
    turn(obstacle, since, out);
}

bool lw_motion_moves(const struct lw_scene_obstacle *obstacle)
{
    return obstacle->motion.kind != LW_MOTION_NONE || lw_vec_norm(obstacle->velocity) > 0 ||
           lw_vec_norm(obstacle->spin) > 0;
}
