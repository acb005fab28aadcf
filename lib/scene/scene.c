// SPDX-License-Identifier: BSD-3-Clause
// Reading a scene: defaults of its robot, then its keys, then the checks that concern several keys at once.
//
// Units    metres, radians, seconds, Hz.
// Frames   base frame of the arm.
// Arrays   see scene.h.
// Memory   the file's text is freed before return.
// Errors   see scene.h.
#define _GNU_SOURCE // strerrordesc_np, open_memstream
#include "scene/scene.h"

#include "base/digest.h" // lw_digest_word

#include <errno.h>  // errno
#include <math.h>   // round, llround
#include <stdarg.h> // va_list
#include <stdlib.h> // malloc, free
#include <string.h> // strerrordesc_np

enum { FILE_MAX = 1 << 20 };

static enum lw_status refuse(struct lw_error *error, const struct lw_source *source, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

static enum lw_status refuse(struct lw_error *error, const struct lw_source *source, const char *format, ...)
{
    char what[400];
    va_list args;
    va_start(args, format);
    vsnprintf(what, sizeof what, format, args);
    va_end(args);
    snprintf(error->text, sizeof error->text, "%.100s: %s", source->name, what);
    return LW_E_SCENE;
}

// Keys whose default is another key's value.
static void resolve(struct lw_scene *scene)
{
    if (scene->plant.rate_hz == 0)
        scene->plant.rate_hz = scene->rate_hz;
    lw_scene_obstacles_resolve(scene);
}

static enum lw_status check_start(const struct lw_scene *scene, const struct lw_source *source, struct lw_error *error)
{
    for (int j = 0; j < LW_NJ; j++) {
        const double low = scene->limits.position_min[j], high = scene->limits.position_max[j];
        if (low >= high)
            return refuse(error, source, "limits: joint %d: expected position_min < position_max, found %g and %g",
                          j + 1, low, high);
        if (scene->q0[j] < low || scene->q0[j] > high)
            return refuse(error, source, "q0: joint %d: expected %g to %g (rad, its range), found %g", j + 1, low, high,
                          scene->q0[j]);
    }
    return LW_OK;
}

// A plant weaker than the guard believes would overshoot what the guard brakes for.
static enum lw_status check_plant(const struct lw_scene *scene, const struct lw_source *source, struct lw_error *error)
{
    for (int j = 0; j < LW_NJ; j++) {
        const double velocity = scene->limits.velocity[j], acceleration = scene->limits.acceleration[j];
        if (scene->plant.velocity[j] < velocity)
            return refuse(error, source, "plant.velocity: joint %d: expected at least limits.velocity = %g, found %g",
                          j + 1, velocity, scene->plant.velocity[j]);
        if (scene->plant.acceleration[j] < acceleration)
            return refuse(error, source,
                          "plant.acceleration: joint %d: expected at least limits.acceleration = %g, found %g", j + 1,
                          acceleration, scene->plant.acceleration[j]);
    }
    return LW_OK;
}

static enum lw_status check_rates(const struct lw_scene *scene, const struct lw_source *source, struct lw_error *error)
{
    if (lw_scene_steps(scene) < 1)
        return refuse(error, source, "duration_s: expected at least one controller period, %g s, found %g",
                      1 / scene->rate_hz, scene->duration_s);
    const double ratio = scene->plant.rate_hz / scene->rate_hz;
    if (ratio < 1 || fabs(ratio - round(ratio)) > 1e-9)
        return refuse(error, source, "plant.rate_hz: expected a whole multiple of rate_hz = %g, found %g",
                      scene->rate_hz, scene->plant.rate_hz);
    if (scene->plant.timeout_s * scene->rate_hz < 2)
        return refuse(error, source, "plant.timeout_s: expected at least two controller periods, %g s, found %g",
                      2 / scene->rate_hz, scene->plant.timeout_s);
    return LW_OK;
}

// The robot decides the defaults, so it is read before everything else.
static enum lw_status read_robot(const struct lw_source *source, enum lw_robot *robot, struct lw_error *error)
{
    struct lw_scene probe = lw_scene_defaults(LW_UR5);
    enum lw_status status = lw_schema_read(lw_scene_keys(), source, &probe, sizeof probe, error);
    *robot = (enum lw_robot)probe.robot;
    return status;
}

enum lw_status lw_scene_read(const struct lw_source *source, struct lw_scene *scene, struct lw_error *error)
{
    enum lw_robot robot = LW_UR5;
    enum lw_status status = read_robot(source, &robot, error);
    struct lw_scene next = lw_scene_defaults(robot);
    if (status == LW_OK)
        status = lw_schema_read(lw_scene_keys(), source, &next, sizeof next, error);
    if (status == LW_OK)
        resolve(&next);
    if (status == LW_OK)
        status = check_start(&next, source, error);
    if (status == LW_OK)
        status = check_plant(&next, source, error);
    if (status == LW_OK)
        status = check_rates(&next, source, error);
    if (status == LW_OK)
        status = lw_scene_obstacles_check(&next, source, error);
    if (status == LW_OK)
        *scene = next;
    return status;
}

// Reads a whole file; NULL with errno set when that fails. The caller frees.
static char *read_file(const char *path)
{
    FILE *file = fopen(path, "rb");
    if (file == NULL)
        return NULL;
    char *text = calloc(1, FILE_MAX + 1);
    const size_t length = text != NULL ? fread(text, 1, FILE_MAX + 1, file) : 0;
    const bool is_text = text != NULL && strlen(text) == length; // a zero byte would hide what follows
    const int problem = ferror(file) ? errno : length > FILE_MAX ? EFBIG : is_text ? 0 : EILSEQ;
    (void)fclose(file); // it was only read
    if (text == NULL || problem == 0)
        return text;
    free(text);
    errno = problem;
    return NULL;
}

enum lw_status lw_scene_load(const char *path, const char *const *set, int set_count, struct lw_scene *scene,
                             struct lw_error *error)
{
    char *text = read_file(path);
    if (text == NULL) {
        snprintf(error->text, sizeof error->text, "%.200s: cannot read the scene: %s", path, strerrordesc_np(errno));
        return LW_E_IO;
    }
    const struct lw_source source = {.name = path, .text = text, .set = set, .set_count = set_count};
    enum lw_status status = lw_scene_read(&source, scene, error);
    free(text);
    return status;
}

void lw_scene_write(const struct lw_scene *scene, FILE *to)
{
    lw_schema_write(lw_scene_keys(), scene, to);
}

int64_t lw_scene_digest(const struct lw_scene *scene)
{
    char *text = NULL;
    size_t size = 0;
    FILE *to = open_memstream(&text, &size);
    if (to == NULL)
        return 0;
    lw_scene_write(scene, to);
    uint64_t digest = LW_DIGEST_START;
    if (fclose(to) == 0)
        for (size_t i = 0; i < size; i++)
            digest = lw_digest_word(digest, (unsigned char)text[i]);
    free(text);
    return (int64_t)digest;
}

void lw_scene_describe(FILE *to)
{
    const struct lw_scene defaults = lw_scene_defaults(LW_UR5);
    lw_schema_describe(lw_scene_keys(), &defaults, to);
}

int64_t lw_scene_steps(const struct lw_scene *scene)
{
    return llround(scene->duration_s * scene->rate_hz);
}

int lw_scene_plant_ratio(const struct lw_scene *scene)
{
    return (int)lround(scene->plant.rate_hz / scene->rate_hz);
}

int64_t lw_scene_period_ns(double rate_hz)
{
    return llround(1e9 / rate_hz);
}
