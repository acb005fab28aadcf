// SPDX-License-Identifier: BSD-3-Clause
// Shapes and distances for Python, of two shapes and of an arm among many.
//
// Units    metres.
// Frames   see collision/shape.h.
// Arrays   see arrays.hpp.
// Memory   a shape owns its vertices.
// Errors   ValueError with the C code's text.
#ifndef LEEWAY_NATIVE_COLLISION_HPP
#define LEEWAY_NATIVE_COLLISION_HPP

#include <nanobind/nanobind.h>

#include <vector>

extern "C" {
#include "collision/shape.h" // lw_solid, lw_shape_make
}

// A solid with the memory of its vertices.
struct Shape {
    std::vector<double> vertices;
    lw_solid data{};

    lw_solid solid() const
    {
        lw_solid out = data;
        out.vertex = vertices.data();
        return out;
    }
};

// A shape in a place, with the memory of its vertices there.
struct Placed {
    double room[LW_HULL_ROOM];
    lw_shape shape;
};

// A pose from 4x4 numbers by rows.
lw_pose to_pose(const double *matrix);

// Puts a shape into its place; throws what lw_shape_make says.
void place(const Shape &shape, const double *matrix, Placed &placed);

// Adds Shape and distance to the module.
void bind_collision(nanobind::module_ &m);

// Adds clearance and body to the module.
void bind_clearance(nanobind::module_ &m);

#endif
