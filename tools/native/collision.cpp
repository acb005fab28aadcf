// SPDX-License-Identifier: BSD-3-Clause
// Shapes and distances for Python.
//
// Units    metres.
// Frames   see collision.hpp.
// Arrays   see arrays.hpp.
// Memory   see collision.hpp.
// Errors   see collision.hpp.
#include "collision.hpp"

#include "arrays.hpp" // Input, Output, Owned

#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm> // copy
#include <stdexcept> // invalid_argument
#include <string>
#include <utility> // move
#include <vector>

extern "C" {
#include "collision/distance.h" // lw_distance_shapes
}

namespace nb = nanobind;

lw_pose to_pose(const double *matrix)
{
    lw_pose pose;
    for (int row = 0; row < 3; row++) {
        std::copy(matrix + 4 * row, matrix + 4 * row + 3, pose.r + 3 * row);
        pose.p[row] = matrix[4 * row + 3];
    }
    return pose;
}

void place(const Shape &shape, const double *matrix, Placed &placed)
{
    const lw_solid solid = shape.solid();
    const lw_pose pose = to_pose(matrix);
    const char *reason = nullptr;
    if (lw_shape_make(&solid, &pose, placed.room, &placed.shape, &reason) != LW_OK)
        throw std::invalid_argument(reason);
}

namespace
{

// Refuses at once what no pose can mend.
Shape check(Shape shape)
{
    const double origin[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    Placed placed;
    place(shape, origin, placed);
    return shape;
}

Shape sphere(double radius)
{
    Shape shape;
    shape.data.kind = LW_SPHERE;
    shape.data.radius = radius;
    return check(std::move(shape));
}

Shape capsule(double radius, double half_length)
{
    Shape shape;
    shape.data.kind = LW_CAPSULE;
    shape.data.radius = radius;
    shape.data.half_length = half_length;
    return check(std::move(shape));
}

Shape box(const std::vector<double> &half_extents, double rounding)
{
    Shape shape;
    if (half_extents.size() != 3)
        throw std::invalid_argument("half_extents: expected three values in m");
    shape.data.kind = LW_BOX;
    shape.data.radius = rounding;
    std::copy(half_extents.begin(), half_extents.end(), shape.data.half);
    return check(std::move(shape));
}

Shape hull(const Input &vertices, double rounding)
{
    Shape shape;
    if (vertices.ndim() != 2 || vertices.shape(1) != 3)
        throw std::invalid_argument("vertices: expected an array of shape (n, 3) in m");
    shape.data.kind = LW_HULL;
    shape.data.radius = rounding;
    // A count too large for an int is too large for a hull: any other wrong one is refused with the same text.
    shape.data.count = vertices.shape(0) <= LW_HULL_MAX ? static_cast<int>(vertices.shape(0)) : LW_HULL_MAX + 1;
    shape.vertices.assign(vertices.data(), vertices.data() + vertices.size());
    return check(std::move(shape));
}

Shape halfspace(const std::vector<double> &normal, double offset)
{
    Shape shape;
    if (normal.size() != 3)
        throw std::invalid_argument("normal: expected three values");
    shape.data.kind = LW_HALFSPACE;
    shape.data.offset = offset;
    std::copy(normal.begin(), normal.end(), shape.data.normal);
    return check(std::move(shape));
}

size_t count_of(const Input &poses)
{
    if (poses.ndim() != 3 || poses.shape(1) != 4 || poses.shape(2) != 4)
        throw std::invalid_argument("pose: expected an array of shape (..., 4, 4)");
    return poses.shape(0);
}

nb::tuple distance(const Shape &a, const Input &poses_a, const Shape &b, const Input &poses_b)
{
    const size_t count = count_of(poses_a);
    if (count_of(poses_b) != count)
        throw std::invalid_argument("pose: as many poses of one shape as of the other");
    Owned<double> d({count}), pa({count, 3}), pb({count, 3}), n({count, 3}), gap({count});
    lw_status status = LW_OK;
    {
        nb::gil_scoped_release released;
        for (size_t i = 0; i < count && status == LW_OK; i++) {
            Placed placed_a, placed_b;
            lw_distance result;
            place(a, poses_a.data() + 16 * i, placed_a);
            place(b, poses_b.data() + 16 * i, placed_b);
            status = lw_distance_shapes(&placed_a.shape, &placed_b.shape, &result);
            if (status != LW_OK)
                break;
            d.data[i] = result.d;
            std::copy(result.pa, result.pa + 3, &pa.data[3 * i]);
            std::copy(result.pb, result.pb + 3, &pb.data[3 * i]);
            std::copy(result.n, result.n + 3, &n.data[3 * i]);
            gap.data[i] = lw_distance_shapes_gap(&placed_a.shape, &placed_b.shape, &result);
        }
    }
    if (status != LW_OK)
        throw std::invalid_argument("two half-spaces have no distance");
    return nb::make_tuple(d.release(), pa.release(), pb.release(), n.release(), gap.release());
}

} // namespace

void bind_collision(nb::module_ &m)
{
    nb::class_<Shape>(m, "Shape", "A convex solid in its own frame.");
    m.def("sphere", &sphere, nb::arg("radius"), "A ball about the origin.");
    m.def("capsule", &capsule, nb::arg("radius"), nb::arg("half_length"), "A segment along z swept by a ball.");
    m.def("box", &box, nb::arg("half_extents"), nb::arg("rounding"), "A box about the origin, swept by a ball.");
    m.def("hull", &hull, nb::arg("vertices"), nb::arg("rounding"), "A convex hull, swept by a ball.");
    m.def("halfspace", &halfspace, nb::arg("normal"), nb::arg("offset"), "All x with normal . x <= offset.");
    m.def(
        "distance", &distance, nb::arg("a"), nb::arg("poses_a"), nb::arg("b"), nb::arg("poses_b"),
        "Distances (n,), points on a (n, 3), points on b (n, 3), normals from b to a (n, 3), gaps of the certificates "
        "(n,) of n pairs of poses (n, 4, 4).");
}
