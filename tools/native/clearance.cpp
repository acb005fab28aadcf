// SPDX-License-Identifier: BSD-3-Clause
// Clearance of an arm among obstacles, and its capsules, for Python.
//
// Units    metres, radians.
// Frames   base frame; capsules and tools in the frame of their link.
// Arrays   see arrays.hpp.
// Memory   a snapshot of the obstacles lives as long as a call.
// Errors   ValueError with the C code's text.
#include "arrays.hpp"    // Input, Output, Owned
#include "collision.hpp" // Shape, Placed

#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm> // copy
#include <cmath>     // INFINITY
#include <memory>    // unique_ptr
#include <stdexcept> // invalid_argument
#include <string>
#include <vector>

extern "C" {
#include "collision/near.h" // lw_near_smallest
}

namespace nb = nanobind;

namespace
{

lw_robot robot_of(const std::string &name)
{
    for (int robot = 0; robot < LW_ROBOT_COUNT; robot++)
        if (name == lw_arm_get(static_cast<lw_robot>(robot))->name)
            return static_cast<lw_robot>(robot);
    throw std::invalid_argument("unknown arm \"" + name + "\"");
}

lw_body_model model_of(const std::string &name)
{
    const char *names[] = {"joints", "capsules", "capsules_fine"};
    for (int model = 0; model < 3; model++)
        if (name == names[model])
            return static_cast<lw_body_model>(model);
    throw std::invalid_argument("unknown model \"" + name + "\": expected joints, capsules or capsules_fine");
}

// --- tools ---

// Corners or vertices of a placed box or hull.
void fill_hull(const lw_shape &shape, lw_tool &tool)
{
    tool.kind = LW_TOOL_HULL;
    tool.radius = shape.r;
    tool.count = shape.kind == LW_BOX ? 8 : shape.hull.count;
    for (int i = 0; i < tool.count; i++)
        for (int k = 0; k < 3; k++) {
            double *x = &tool.vertex[3 * i + k];
            *x = shape.c[k];
            if (shape.kind == LW_HULL)
                *x += shape.hull.vertex[k * shape.hull.padded + i];
            for (int axis = 0; shape.kind == LW_BOX && axis < 3; axis++)
                *x += (i >> axis & 1 ? 1 : -1) * shape.box.half[axis] * shape.box.axes[3 * k + axis];
        }
}

// One shape, or none, on the flange.
lw_tool tool_of(const std::vector<const Shape *> &shapes, const Input &poses)
{
    lw_tool tool = {};
    Placed placed;
    if (shapes.empty())
        return tool;
    place(*shapes[0], poses.data(), placed);
    switch (placed.shape.kind) {
    case LW_SPHERE:
    case LW_CAPSULE:
        tool.kind = LW_TOOL_CAPSULE;
        tool.capsule = lw_shape_capsule(&placed.shape);
        break;
    case LW_BOX:
    case LW_HULL: fill_hull(placed.shape, tool); break;
    default: throw std::invalid_argument("tool: a half-space is none");
    }
    const char *reason = nullptr;
    if (lw_tool_check(&tool, &reason) != LW_OK)
        throw std::invalid_argument(std::string("tool: ") + reason);
    return tool;
}

// --- clearance ---

std::unique_ptr<lw_snapshot> snapshot_of(const std::vector<const Shape *> &shapes, const Input &poses)
{
    std::unique_ptr<lw_snapshot> world(new lw_snapshot); // not cleared: begin does what is needed
    lw_snapshot_begin(world.get());
    int id = 0;
    for (const Shape *shape : shapes) {
        Placed placed;
        const double *matrix = poses.data() + 16 * static_cast<size_t>(id);
        const lw_solid solid = shape->solid();
        const lw_pose pose = to_pose(matrix);
        place(*shape, matrix, placed); // says what is wrong
        if (lw_snapshot_add(world.get(), ++id, 1, &solid, &pose, nullptr) != LW_OK)
            throw std::invalid_argument("obstacles: at most 10000, with 262144 vertices in all");
    }
    lw_snapshot_end(world.get());
    return world;
}

Output<double> clearance(const std::string &robot, const Input &q, const std::vector<const Shape *> &shapes,
                         const Input &poses, const std::string &model, const nb::tuple &tool)
{
    const lw_robot which = robot_of(robot);
    const lw_tool held = tool_of(nb::cast<std::vector<const Shape *>>(tool[0]), nb::cast<Input>(tool[1]));
    lw_body body;
    lw_body_make(which, model_of(model), &held, &body);
    Owned<double> out({q.shape(0)});
    bool finite = true;
    {
        nb::gil_scoped_release released;
        const std::unique_ptr<lw_snapshot> world = snapshot_of(shapes, poses);
        lw_placed placed;
        // Cold queries: a result does not depend on its neighbours in the batch.
        const lw_near_query query = {&body, &placed, world.get(), 0, static_cast<double>(INFINITY), nullptr};
        for (size_t i = 0; i < q.shape(0) && finite; i++) {
            lw_pose frame[LW_NJ];
            lw_near nearest;
            finite = lw_arm_fk(lw_arm_get(which), q.data() + LW_NJ * i, frame) == LW_OK;
            if (!finite)
                break;
            lw_body_place(&body, frame, &placed);
            lw_near_smallest(&query, &nearest);
            out.data[i] = nearest.distance.d;
        }
    }
    if (!finite)
        throw std::invalid_argument("q: holds a value that is not finite");
    return out.release();
}

// Links (n,), ends (n, 2, 3) and radii (n,) of a model's capsules.
nb::tuple body(const std::string &robot, const std::string &model)
{
    lw_body made;
    lw_body_make(robot_of(robot), model_of(model), nullptr, &made);
    const size_t count = static_cast<size_t>(made.count);
    Owned<int> link({count});
    Owned<double> ends({count, 2, 3}), radius({count});
    for (size_t i = 0; i < count; i++) {
        const lw_capsule &capsule = made.part[i].capsule;
        link.data[i] = made.part[i].link;
        std::copy(capsule.a, capsule.a + 3, &ends.data[6 * i]);
        std::copy(capsule.b, capsule.b + 3, &ends.data[6 * i + 3]);
        radius.data[i] = capsule.r;
    }
    return nb::make_tuple(link.release(), ends.release(), radius.release());
}

} // namespace

void bind_clearance(nb::module_ &m)
{
    m.def(
        "clearance", &clearance, nb::arg("robot"), nb::arg("q"), nb::arg("shapes"), nb::arg("poses"), nb::arg("model"),
        nb::arg("tool"),
        "Smallest distances (n,) of n configurations (n, 6) to the shapes at their poses (m, 4, 4); tool is a list of "
        "no or one shape and its pose (1, 4, 4) in the frame of the flange.");
    m.def(
        "body", &body, nb::arg("robot"), nb::arg("model"),
        "Links (n,), ends (n, 2, 3) in the frames of the links and radii (n,) of the capsules that stand for a robot.");
}
