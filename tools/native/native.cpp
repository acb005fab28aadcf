// SPDX-License-Identifier: BSD-3-Clause
// Python module leeway._native: the arms, shapes, scenes and in-process runs of the C code, as NumPy arrays.
//
// Units    metres, radians, seconds.
// Frames   base frame of the arm.
// Arrays   float64, C order, batches over all leading axes.
// Memory   results are owned by Python.
// Errors   ValueError with the C code's text.
#include "arrays.hpp"    // Input, Output, Owned
#include "collision.hpp" // bind_collision, bind_clearance
#include "replay.hpp"    // bind_replay
#include "scene.hpp"     // Scene
#include "world.hpp"     // bind_world

#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cmath>      // NAN
#include <functional> // multiplies
#include <numeric>    // accumulate
#include <stdexcept>  // invalid_argument
#include <string>
#include <vector>

extern "C" {
#include "base/build.h"      // LW_BUILD
#include "simulator/batch.h" // lw_batch_run
}

namespace nb = nanobind;

namespace
{

struct Arm {
    const lw_arm *model;
    std::string name;
};

Arm make_arm(const std::string &name)
{
    for (int robot = 0; robot < LW_ROBOT_COUNT; robot++) {
        const lw_arm *model = lw_arm_get(static_cast<lw_robot>(robot));
        if (name == model->name)
            return {model, name};
    }
    throw std::invalid_argument("unknown arm \"" + name + "\": expected ur5 or ur10");
}

// Leading axes of a batch of configurations, then the given trailing ones.
std::vector<size_t> batch_shape(const Input &q, std::initializer_list<size_t> trailing)
{
    if (q.ndim() < 1 || q.shape(q.ndim() - 1) != LW_NJ)
        throw std::invalid_argument("q: expected an array of shape (..., 6) in rad");
    std::vector<size_t> shape;
    for (size_t i = 0; i + 1 < q.ndim(); i++)
        shape.push_back(q.shape(i));
    shape.insert(shape.end(), trailing);
    return shape;
}

// Calls write(frames, out + i * stride) for every configuration of a batch, without the GIL.
template <typename Write>
Output<double> for_each(const Arm &arm, const Input &q, std::initializer_list<size_t> trailing, Write write)
{
    Owned<double> out(batch_shape(q, trailing));
    const size_t stride = std::accumulate(trailing.begin(), trailing.end(), size_t{1}, std::multiplies<>());
    const size_t count = q.size() / LW_NJ;
    bool finite = true;
    {
        nb::gil_scoped_release released;
        for (size_t i = 0; i < count; i++) {
            lw_pose frame[LW_NJ];
            finite = finite && lw_arm_fk(arm.model, q.data() + i * LW_NJ, frame) == LW_OK;
            if (finite)
                write(frame, out.data.get() + i * stride);
        }
    }
    if (!finite)
        throw std::invalid_argument("q: holds a value that is not finite");
    return out.release();
}

void write_transform(const lw_pose &pose, double *out)
{
    for (int row = 0; row < 3; row++) {
        for (int column = 0; column < 3; column++)
            out[4 * row + column] = pose.r[3 * row + column];
        out[4 * row + 3] = pose.p[row];
    }
    out[15] = 1;
}

Output<double> fk(const Arm &arm, const Input &q)
{
    return for_each(arm, q, {4, 4}, [](const lw_pose *frame, double *out) { write_transform(frame[LW_NJ - 1], out); });
}

Output<double> frames(const Arm &arm, const Input &q)
{
    return for_each(arm, q, {LW_NJ, 4, 4}, [](const lw_pose *frame, double *out) {
        for (int i = 0; i < LW_NJ; i++)
            write_transform(frame[i], out + 16 * i);
    });
}

Output<double> jacobian(const Arm &arm, const Input &q)
{
    return for_each(arm, q, {6, LW_NJ}, [](const lw_pose *frame, double *out) { lw_arm_jacobian(frame, out); });
}

nb::dict simulate(const Scene &scene)
{
    const size_t rows = static_cast<size_t>(lw_scene_steps(&scene.data)) + 1;
    Owned<double> t({rows}), q({rows, LW_NJ}), qd({rows, LW_NJ}), tip({rows, 3}), deviation({rows}), clearance({rows}),
        self_clearance({rows});
    Owned<int> flags({rows}), outcome({rows});
    const lw_batch_result result = {t.data.get(),
                                    q.data.get(),
                                    qd.data.get(),
                                    tip.data.get(),
                                    deviation.data.get(),
                                    clearance.data.get(),
                                    self_clearance.data.get(),
                                    flags.data.get(),
                                    outcome.data.get()};
    lw_status status = LW_OK;
    {
        nb::gil_scoped_release released;
        status = lw_batch_run(&scene.data, &result);
    }
    if (status != LW_OK)
        throw std::invalid_argument(lw_status_text(status));
    nb::dict out;
    out["t"] = t.release();
    out["q"] = q.release();
    out["qd"] = qd.release();
    out["tip"] = tip.release();
    out["deviation"] = deviation.release();
    out["clearance"] = clearance.release();
    out["self_clearance"] = self_clearance.release();
    out["flags"] = flags.release();
    out["outcome"] = outcome.release();
    return out;
}

} // namespace

NB_MODULE(_native, m)
{
    m.doc() = "C code of Leeway: arms, shapes, scenes, in-process runs.";
    m.attr("BUILD") = LW_BUILD;

    nb::class_<Arm>(m, "Arm", "Kinematics of a robot. Frames: base frame of the arm. Source: DH table of the maker.")
        .def(
            "__init__", [](Arm *self, const std::string &name) { new (self) Arm(make_arm(name)); }, nb::arg("name"),
            "An arm by name: \"ur5\" or \"ur10\".")
        .def_ro("name", &Arm::name)
        .def("fk", &fk, nb::arg("q"), "Pose of the tip, (..., 6) rad -> (..., 4, 4).")
        .def("frames", &frames, nb::arg("q"), "Poses of the DH frames 1 to 6, (..., 6) rad -> (..., 6, 4, 4).")
        .def("jacobian", &jacobian, nb::arg("q"),
             "Geometric Jacobian of the tip, (..., 6) rad -> (..., 6, 6), linear rows (m/rad) first, base axes.");

    nb::class_<Scene>(m, "Scene", "Everything a run is made of; read and checked by the C code.")
        .def("to_dict", &Scene::to_dict, "All keys and values; limits that are off are infinite.")
        .def("to_yaml", &Scene::to_yaml, "The whole scene as YAML, exact to the last bit.");
    m.def("read_scene", &Scene::read, nb::arg("text"), nb::arg("name"), nb::arg("sets"),
          "Reads a scene from YAML text; sets is a list of \"key=value\".");
    m.def("describe_scene", &describe_scene, "Reference of all keys of a scene, for people.");
    bind_collision(m);
    bind_clearance(m);
    m.def("simulate", &simulate, nb::arg("scene"), "Runs a scene in process; arrays by name.");
    bind_world(m);
    bind_replay(m);
}
