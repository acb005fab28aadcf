// SPDX-License-Identifier: BSD-3-Clause
// Replay for Python.
//
// Units    see replay.hpp.
// Frames   see replay.hpp.
// Arrays   see replay.hpp.
// Memory   see replay.hpp.
// Errors   see replay.hpp.
#include "replay.hpp"

#include "scene.hpp" // Scene
#include "world.hpp" // World, decode

#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <algorithm> // copy
#include <array>
#include <cstdint>   // int64_t
#include <optional>  // optional
#include <stdexcept> // invalid_argument
#include <string>    // string

extern "C" {
#include "bus/wire.h"        // lw_wire_*
#include "collision/world.h" // lw_world_apply
#include "controller/tick.h" // lw_tick
}

namespace nb = nanobind;

namespace
{

// For each of the messages of a channel, one behind the other: 1 = a program would take it, 0 = refuse it.
nb::bytes acceptable(const std::string &channel, const nb::bytes &messages)
{
    int number = 0;
    while (number < LW_CHANNEL_COUNT && channel != lw_wire_channel_name(static_cast<lw_channel>(number)))
        number++;
    if (number == LW_CHANNEL_COUNT)
        throw std::invalid_argument("no channel " + channel);
    const auto known = static_cast<lw_channel>(number);
    const uint32_t size = lw_wire_size(known);
    std::string verdicts(messages.size() / size, '\0');
    for (size_t i = 0; i < verdicts.size(); i++) {
        lw_message message;
        const auto *data = static_cast<const char *>(messages.data()) + i * size;
        verdicts[i] = lw_wire_decode(known, data, size, &message) == LW_OK ? 1 : 0;
    }
    return nb::bytes(verdicts.data(), verdicts.size());
}

struct Controller {
    lw_controller config = {};
    lw_controller_state state = {}, before = {};
    lw_joint_state joint = {};
    lw_request asked = {};

    Controller(const Scene &scene, int64_t session)
    {
        if (lw_controller_init(&config, &state, &scene.data, session) != LW_OK)
            throw std::invalid_argument("no controller can run this scene: its robot or law is unknown");
        before = state;
    }

    // None is the state before the first one was heard.
    bool joint_state(const std::optional<nb::bytes> &data)
    {
        lw_message message = {};
        if (data && !decode(LW_CHANNEL_JOINT_STATE, *data, message))
            return false;
        joint = data ? message.joint_state : lw_joint_state{};
        return true;
    }

    bool request(const nb::bytes &data, bool stop)
    {
        lw_message message;
        if (!decode(stop ? LW_CHANNEL_STOP : LW_CHANNEL_GOAL, data, message))
            return false;
        asked = message.request;
        return true;
    }

    // A request counts for one tick: its repetitions change nothing.
    nb::bytes tick(int64_t time_ns, int64_t state_age_ns, bool warming_up, const World &world)
    {
        const lw_tick_input in = {time_ns, state_age_ns, warming_up, &joint, &world.look(), &asked};
        lw_message message = {};
        unsigned char wire[LW_WIRE_MAX];
        before = state;
        lw_tick(&config, &state, &in, &message.joint_command);
        asked = {};
        const uint32_t size = lw_wire_encode(LW_CHANNEL_JOINT_COMMAND, &message, wire);
        return nb::bytes(wire, size);
    }

    nb::tuple in_force() const
    {
        const lw_stamp &stamp = state.request.stamp;
        return nb::make_tuple(state.request.kind == LW_REQUEST_STOP, stamp.session, stamp.seq);
    }

    // Goes on from a recorded command, whose own inputs are not known.
    void adopt(int64_t tick, int64_t plant_session, int64_t state_seq, const std::array<double, LW_NJ> &qd)
    {
        state.tick = tick;
        state.plant_session = plant_session;
        state.state_seq = state_seq;
        std::copy(qd.begin(), qd.end(), state.velocity);
    }

    // What the tick remembers beyond the last command, as far as a command tells it.
    void adopt_memory(int64_t stuck_since_ns, const std::array<double, 3> &circulation)
    {
        state.escape.stuck.since_ns = stuck_since_ns;
        std::copy(circulation.begin(), circulation.end(), state.escape.circulation);
    }

    void adopt_request(int64_t session, int64_t seq, bool stop, const std::array<double, 3> &goal)
    {
        lw_request request = {};
        request.stamp.session = session;
        request.stamp.seq = seq;
        request.kind = stop ? LW_REQUEST_STOP : LW_REQUEST_GOAL;
        std::copy(goal.begin(), goal.end(), request.goal);
        (void)lw_request_is_new(&state.requests, &request);
        state.request = request;
    }
};

} // namespace

void bind_replay(nb::module_ &m)
{
    nb::class_<Controller>(m, "Controller", "The controller's tick, fed with messages of a log.")
        .def(nb::init<const Scene &, int64_t>(), nb::arg("scene"), nb::arg("session"),
             "A controller as its process starts; session is the one it sends with.")
        .def("joint_state", &Controller::joint_state, nb::arg("data").none(),
             "Takes the JOINT_STATE of the next ticks; False when it is refused. None: none heard yet.")
        .def("request", &Controller::request, nb::arg("data"), nb::arg("stop"),
             "Takes a GOAL or STOP for the next tick; False when it is refused.")
        .def(
            "shutdown", [](Controller &c) { c.asked = lw_request_shutdown; },
            "Takes the stop that the process asks of itself at its end, for the next tick.")
        .def("tick", &Controller::tick, nb::arg("time_ns"), nb::arg("state_age_ns"), nb::arg("warming_up"),
             nb::arg("world"), "One tick; returns JOINT_COMMAND without what the process fills in.")
        .def(
            "undo", [](Controller &c) { c.state = c.before; }, "Back to before the last tick.")
        .def("adopt", &Controller::adopt, nb::arg("tick"), nb::arg("plant_session"), nb::arg("state_seq"),
             nb::arg("qd"), "Goes on from a recorded command whose own inputs are not known.")
        .def("adopt_memory", &Controller::adopt_memory, nb::arg("stuck_since_ns"), nb::arg("circulation"),
             "Sets what it remembers of being stuck to what a recorded command tells.")
        .def_prop_ro(
            "looks_back", [](const Controller &c) { return c.config.params.remedy.kind == LW_REMEDY_ROLLOUT; },
            "Whether commands depend on more than the last second.")
        .def("adopt_request", &Controller::adopt_request, nb::arg("session"), nb::arg("seq"), nb::arg("stop"),
             nb::arg("goal"), "Sets the request in force to that of a recorded command.")
        .def_prop_ro("in_force", &Controller::in_force,
                     "Request in force: whether a stop, session, seq; 0 = the scene's.")
        .def_prop_ro(
            "scene_digest", [](const Controller &c) { return c.config.scene_digest; }, "Digest of the scene.")
        .def_prop_ro("ticks", [](const Controller &c) { return c.state.tick; }, "Ticks so far.");
    m.def("acceptable", &acceptable, nb::arg("channel"), nb::arg("messages"),
          "For each message of a channel, one behind the other: 1 = a program would take it, 0 = refuse it.");
    m.attr("SHUTDOWN") = lw_request_shutdown.stamp.session;
}
