// SPDX-License-Identifier: BSD-3-Clause
// Scene for Python: reading, and its values as a dictionary, driven by the C table of keys.
//
// Units    metres, radians, seconds, Hz.
// Frames   base frame of the arm.
// Arrays   lists of numbers.
// Memory   plain data by value.
// Errors   ValueError with file, line, key, what was expected and found.
#ifndef LW_NATIVE_SCENE_HPP
#define LW_NATIVE_SCENE_HPP

#include <nanobind/nanobind.h>

#include <string>
#include <vector>

extern "C" {
#include "scene/scene.h" // struct lw_scene
}

struct Scene {
    lw_scene data;

    static Scene read(const std::string &text, const std::string &name, const std::vector<std::string> &sets);
    nanobind::dict to_dict() const;
    std::string to_yaml() const;
};

// Reference of all keys, for people.
std::string describe_scene();

#endif
