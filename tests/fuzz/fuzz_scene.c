// SPDX-License-Identifier: BSD-3-Clause
// Fuzz target: a scene's text and overrides. A line that starts with "--set " is an override, every other line belongs
// to the text. An accepted scene keeps the ranges that controller and plant rely on, and reads back the same.
//
// Units    metres, radians, seconds, Hz.
// Frames   base frame.
// Arrays   see scene/scene.h.
// Memory   the text is a block of its own, so that a read beyond its end is found.
// Errors   see fuzz.h.
#define _GNU_SOURCE // open_memstream
#include "fuzz.h"
#include "scene/scene.h"
#include "scene/sensor.h"           // lw_sensor_*
#include "tests/unit/wire_ranges.h" // within

#include <string.h> // strncmp

enum { SETS_MAX = 8 };
static const char prefix[] = "--set ";

// --- input ---

struct input {
    char *text;  // YAML
    char *lines; // holds the overrides
    const char *set[SETS_MAX];
    int set_count;
};

// Hands each line to the text or to the overrides.
static void split(struct input *in, const uint8_t *data, size_t size)
{
    *in = (struct input){.text = calloc(1, size + 1), .lines = calloc(1, size + 1)};
    CHECK(in->text != NULL && in->lines != NULL);
    char *to_text = in->text, *to_lines = in->lines;
    for (size_t at = 0, end; at < size; at = end) {
        const uint8_t *newline = memchr(data + at, '\n', size - at);
        end = newline != NULL ? (size_t)(newline - data) + 1 : size;
        const size_t length = end - at, skip = sizeof prefix - 1;
        const bool is_set = length > skip && memcmp(data + at, prefix, skip) == 0 && in->set_count < SETS_MAX;
        if (!is_set) {
            memcpy(to_text, data + at, length);
            to_text += length;
            continue;
        }
        const size_t value = length - skip - (newline != NULL);
        memcpy(to_lines, data + at + skip, value);
        in->set[in->set_count++] = to_lines;
        to_lines += value + 1;
    }
}

// --- what an accepted scene promises ---

static void check_joints(const struct lw_scene *s)
{
    for (int j = 0; j < LW_NJ; j++) {
        CHECK(s->limits.position_min[j] < s->limits.position_max[j]);
        CHECK(s->q0[j] >= s->limits.position_min[j] && s->q0[j] <= s->limits.position_max[j]);
        CHECK(s->limits.velocity[j] > 0 && s->plant.velocity[j] >= s->limits.velocity[j]);
        CHECK(s->limits.acceleration[j] > 0 && s->plant.acceleration[j] >= s->limits.acceleration[j]);
    }
}

static void check_law(const struct lw_apf_params *apf)
{
    const double gains[] = {apf->k_a, apf->r0, apf->eta, apf->rho_rep, apf->distance_min};
    CHECK(lw_all_finite(gains, 5));
    for (int i = 0; i < 5; i++)
        CHECK(gains[i] > 0);
    CHECK(apf->gamma == 1 || apf->gamma == 2);
}

// What is told of the scene is what the bus takes, at any time.
static void check_obstacles(const struct lw_scene *s)
{
    static const int64_t times_ns[] = {0, 1, 40000000, 1234567890, 60000000000, 86400000000000};
    static struct lw_sensor sensor;
    lw_sensor_init(&sensor, s);
    for (size_t k = 0; k < sizeof times_ns / sizeof times_ns[0]; k++) {
        struct lw_obstacle_change change;
        (void)lw_sensor_look(&sensor, times_ns[k]);
        for (int i = 0; lw_sensor_tell(&sensor, times_ns[k], i, &change); i++)
            CHECK(change.vertex_count > 0 ? hull_keeps_its_ranges(&change) : obstacles_keep_their_ranges(&change));
    }
}

static void check_scene(const struct lw_scene *s)
{
    CHECK(s->robot == LW_UR5 || s->robot == LW_UR10);
    CHECK(s->rate_hz >= 1 && s->rate_hz <= 10000 && lw_scene_steps(s) >= 1 && lw_scene_plant_ratio(s) >= 1);
    CHECK(lw_scene_period_ns(s->rate_hz) > 0 && lw_scene_period_ns(s->plant.rate_hz) > 0);
    CHECK(within(s->goal, 3, 100));
    check_joints(s);
    check_law(&s->law.apf);
    check_obstacles(s);
}

// --- writing ---

// The scene as text; the caller frees.
static char *write_scene(const struct lw_scene *scene)
{
    char *text = NULL;
    size_t size = 0;
    FILE *to = open_memstream(&text, &size);
    CHECK(to != NULL);
    lw_scene_write(scene, to);
    CHECK(fclose(to) == 0 && text != NULL);
    return text;
}

// What is written is read, and means the same.
static void check_round_trip(const struct lw_scene *scene)
{
    struct lw_scene again;
    struct lw_error error;
    char *text = write_scene(scene);
    const struct lw_source source = {.name = "written", .text = text};
    CHECK(lw_scene_read(&source, &again, &error) == LW_OK);
    char *second = write_scene(&again);
    CHECK(strcmp(text, second) == 0);
    free(second);
    free(text);
}

// --- entry ---

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct input in;
    struct lw_scene scene;
    struct lw_error error;
    memset(&scene, 0x5a, sizeof scene);
    memset(&error, 0, sizeof error);
    split(&in, data, size);
    const struct lw_source source = {.name = "fuzz", .text = in.text, .set = in.set, .set_count = in.set_count};
    if (lw_scene_read(&source, &scene, &error) == LW_OK) {
        check_scene(&scene);
        check_round_trip(&scene);
    } else {
        CHECK(error.text[0] != '\0' && memchr(error.text, '\0', sizeof error.text) != NULL);
        for (size_t i = 0; i < sizeof scene; i++)
            CHECK(((const unsigned char *)&scene)[i] == 0x5a);
    }
    free(in.text);
    free(in.lines);
    return 0;
}
