// SPDX-License-Identifier: BSD-3-Clause
// Shapes and distances for Python.
//
// Units    metres.
// Frames   see collision/shape.h.
// Arrays   see arrays.hpp.
// Memory   a shape owns its vertices.
// Errors   ValueError with the C code's text.
#ifndef LEEWAY_NATIVE_COLLISION_HPP
#define LEEWAY_NATIVE_COLLISION_HPP

#include <nanobind/nanobind.h>

// Adds Shape and distance to the module.
void bind_collision(nanobind::module_ &m);

#endif
