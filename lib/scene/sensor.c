// SPDX-License-Identifier: BSD-3-Clause
// Seeing a scene's obstacles at a sample, and the messages that tell it.
//
// Units    see sensor.h.
// Frames   see sensor.h.
// Arrays   see sensor.h.
// Memory   see sensor.h.
// Errors   see sensor.h.
#include "scene/sensor.h"

#include "base/noise.h"   // lw_noise_normal
#include "scene/motion.h" // lw_motion_at

#include <math.h>   // llround
#include <string.h> // memcpy

static const int64_t ns_per_s = 1000 * 1000 * 1000;

void lw_sensor_init(struct lw_sensor *sensor, const struct lw_scene *scene)
{
    const struct lw_sensor_config *config = &scene->sensor;
    *sensor = (struct lw_sensor){.scene = scene,
                                 .period_ns = lw_scene_period_ns(config->rate_hz),
                                 .latency_ns = llround(config->latency_s * 1e9),
                                 .valid_for_ms = (int)lround(config->valid_for_s * 1e3),
                                 .hull_samples = config->rate_hz > 1 ? lround(config->rate_hz) : 1,
                                 .sample = -1};
}

// --- seeing ---

static struct lw_obstacle see(const struct lw_sensor *sensor, const struct lw_scene_obstacle *o, double t)
{
    const bool edged = o->shape == LW_BOX || o->shape == LW_HULL;
    struct lw_obstacle seen = {.id = o->id, .shape = (enum lw_shape_kind)o->shape};
    seen.radius = o->shape == LW_HALFSPACE ? 0 : edged ? o->rounding : o->radius;
    if (o->shape == LW_BOX)
        memcpy(seen.size, o->half_extents, sizeof seen.size);
    else if (o->shape == LW_CAPSULE)
        seen.size[0] = o->half_length;

    struct lw_moving moving;
    lw_motion_at(sensor->scene, o, t, &moving);
    memcpy(seen.quat, moving.quat, sizeof seen.quat);
    memcpy(seen.v, moving.v, sizeof seen.v);
    memcpy(seen.omega, moving.omega, sizeof seen.omega);
    for (int i = 0; i < 3; i++) {
        const struct lw_noise noise = {sensor->scene->seed, o->id, sensor->sample, i};
        seen.p[i] = moving.p[i] + sensor->scene->sensor.noise_m * lw_noise_normal(&noise);
    }
    return seen;
}

// Whether it is there to be seen: in its time, and not so far away that nobody would take its message.
static bool is_visible(const struct lw_sensor *sensor, const struct lw_scene_obstacle *o, double t,
                       const struct lw_obstacle *seen)
{
    const double *vertex = &sensor->scene->number[o->vertices.first];
    return t >= o->visible_s[0] && t < o->visible_s[1] &&
           lw_obstacle_check(seen, vertex, o->shape == LW_HULL ? o->vertices.count : 0, NULL) == LW_OK;
}

// Whether a hull is to be told with its vertices: each place of the scene has its own samples, so that not all fall on
// the same one. Samples between `before` and this one may have been left out.
static bool needs_vertices(const struct lw_sensor *sensor, int place, int64_t before)
{
    const int64_t turn = sensor->hull_samples - place % sensor->hull_samples;
    return sensor->sample == 0 || !sensor->is_seen[place] ||
           (sensor->sample + turn) / sensor->hull_samples != (before + turn) / sensor->hull_samples;
}

static void see_all(struct lw_sensor *sensor, double t, int64_t before)
{
    const struct lw_scene *scene = sensor->scene;
    for (int i = 0; i < scene->obstacle_count; i++) {
        const struct lw_scene_obstacle *o = &scene->obstacle[i];
        sensor->seen[i] = see(sensor, o, t);
        const bool visible = is_visible(sensor, o, t, &sensor->seen[i]), was = sensor->is_seen[i];
        enum lw_telling telling = LW_TELL_GONE;
        if (visible && o->shape == LW_HULL)
            telling = needs_vertices(sensor, i, before) ? LW_TELL_VERTICES : LW_TELL_NAMES;
        else if (visible)
            telling = LW_TELL_OTHERS;
        sensor->is_seen[i] = visible;
        if (visible || was)
            sensor->place[telling][sensor->count[telling]++] = i;
    }
}

bool lw_sensor_look(struct lw_sensor *sensor, int64_t motion_ns)
{
    const int64_t told_ns = motion_ns - sensor->latency_ns;
    const int64_t sample = told_ns > 0 ? told_ns / sensor->period_ns : 0, sample_ns = sample * sensor->period_ns;
    const int64_t before = sensor->sample;
    // Before the arm moves nothing does: what is told then was seen the latency ago.
    sensor->age_ns = told_ns > 0 ? motion_ns - sample_ns : sensor->latency_ns;
    if (sample == before)
        return false;
    const double t = (double)sample_ns / (double)ns_per_s;
    sensor->sample = sample;
    memset(sensor->count, 0, sizeof sensor->count);
    see_all(sensor, t, before);
    return true;
}

// --- telling ---

static void tell_hull(const struct lw_sensor *sensor, int place, struct lw_obstacle_change *change)
{
    const struct lw_rows *vertices = &sensor->scene->obstacle[place].vertices;
    change->count = 1;
    change->obstacle[0] = sensor->seen[place];
    change->vertex_count = vertices->count;
    memcpy(change->vertex, &sensor->scene->number[vertices->first],
           (size_t)vertices->count * 3 * sizeof *change->vertex);
}

static void tell_some(const struct lw_sensor *sensor, const int *place, int count, struct lw_obstacle_change *change)
{
    change->count = count < LW_CHANGE_MAX ? count : LW_CHANGE_MAX;
    for (int k = 0; k < change->count; k++)
        change->obstacle[k] = sensor->seen[place[k]];
}

bool lw_sensor_tell(const struct lw_sensor *sensor, int64_t now_ns, int i, struct lw_obstacle_change *change)
{
    const int64_t seen_ns = now_ns - sensor->age_ns;
    // Time 0 would say that the time is not told.
    *change = (struct lw_obstacle_change){
        .op = LW_UPSERT, .time_ns = seen_ns > 0 ? seen_ns : 1, .valid_for_ms = sensor->valid_for_ms};
    int left = i;
    for (int telling = 0; telling < LW_TELLINGS; telling++) {
        const int each = telling == LW_TELL_VERTICES ? 1 : LW_CHANGE_MAX;
        const int count = sensor->count[telling], messages = (count + each - 1) / each;
        if (left >= messages) {
            left -= messages;
            continue;
        }
        const int *place = &sensor->place[telling][left * each];
        change->op = telling == LW_TELL_GONE ? LW_REMOVE : LW_UPSERT;
        if (telling == LW_TELL_VERTICES)
            tell_hull(sensor, *place, change);
        else
            tell_some(sensor, place, count - left * each, change);
        return true;
    }
    return i == 0; // nothing at all is told, too
}
