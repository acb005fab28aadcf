// SPDX-License-Identifier: BSD-3-Clause
// The smallest scene as text, and reading it with one override.
//
// Units    metres, radians, seconds, Hz.
// Frames   base frame.
// Arrays   none.
// Memory   static scenes: struct lw_scene is large.
// Errors   cmocka's.
#ifndef LW_TESTS_SCENE_TEXT_H
#define LW_TESTS_SCENE_TEXT_H

#include "helpers.h"
#include "scene/scene.h"

static const char smallest_scene[] = "robot: ur5\nq0: [0, 0, 0, 0, 0, 0]\nrequest: {goal: [0.5, 0, 0.5]}\n";

// `more` is text behind the smallest scene.
static inline enum lw_status read_scene(const char *more, const char *set, struct lw_scene *scene,
                                        struct lw_error *error)
{
    static char text[1 << 17];
    assert_true((size_t)snprintf(text, sizeof text, "%s%s", smallest_scene, more) < sizeof text);
    const struct lw_source source = {.name = "s.yaml", .text = text, .set = &set, .set_count = set != NULL};
    return lw_scene_read(&source, scene, error);
}

// The scene lasts until the next call.
static inline const struct lw_scene *accept_scene(const char *more, const char *set)
{
    static struct lw_scene scene;
    struct lw_error error = {""};
    if (read_scene(more, set, &scene, &error) != LW_OK)
        fail_msg("refused: %s", error.text);
    return &scene;
}

// Refused with these words, and the scene is as it was.
static inline void refuse_scene(const char *more, const char *words)
{
    static struct lw_scene scene, before;
    struct lw_error error = {""};
    memset(&scene, 0x5a, sizeof scene);
    memcpy(&before, &scene, sizeof scene);
    assert_int_equal(read_scene(more, NULL, &scene, &error), LW_E_SCENE);
    assert_string_equal(error.text, words);
    assert_same_bits(&scene, &before, sizeof scene);
}

#endif
