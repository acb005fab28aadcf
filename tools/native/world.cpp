// SPDX-License-Identifier: BSD-3-Clause
// World for Python.
//
// Units    see world.hpp.
// Frames   see world.hpp.
// Arrays   see world.hpp.
// Memory   pages of zeros from the system: what is never written costs nothing.
// Errors   see world.hpp.
#include "world.hpp"

#include <algorithm>  // copy
#include <cmath>      // INFINITY
#include <new>        // bad_alloc
#include <stdexcept>  // invalid_argument
#include <sys/mman.h> // mmap

extern "C" {
#include "collision/near.h" // lw_near_each
}

namespace nb = nanobind;

namespace
{

// A large struct, all zeros. The heap would clear it by hand where it was used before.
template <typename T> std::shared_ptr<T> zeroed()
{
    void *room = mmap(nullptr, sizeof(T), PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (room == MAP_FAILED)
        throw std::bad_alloc();
    return {static_cast<T *>(room), [](T *p) { munmap(p, sizeof(T)); }};
}

nb::tuple numbers(const double *values, int n)
{
    nb::list out;
    for (int i = 0; i < n; i++)
        out.append(values[i]);
    return nb::tuple(out);
}

} // namespace

bool decode(lw_channel channel, const nb::bytes &data, lw_message &message)
{
    return lw_wire_decode(channel, data.data(), static_cast<uint32_t>(data.size()), &message) == LW_OK;
}

World::World() : data_(zeroed<lw_world>())
{
}

World World::copy() const
{
    World other;
    lw_world_copy(data_.get(), other.data_.get());
    other.seen_ = seen_;
    return other;
}

bool World::apply(const nb::bytes &change, bool hull)
{
    lw_message message;
    if (!decode(hull ? LW_CHANNEL_HULL : LW_CHANNEL_OBSTACLES, change, message) ||
        lw_world_apply(data_.get(), &message.obstacles) != LW_OK)
        return false;
    seen_.reset();
    return true;
}

nb::tuple World::echo() const
{
    return nb::make_tuple(data_->last_channel, data_->last.session, data_->last.seq, data_->version);
}

void World::adopt(int channel, int64_t session, int64_t seq, int64_t version)
{
    data_->last_channel = channel;
    data_->last.session = session;
    data_->last.seq = seq;
    data_->version = version;
    seen_.reset();
}

nb::tuple World::nearest(const Input &points, const nb::ndarray<const int64_t, nb::c_contig> &times) const
{
    if (points.ndim() != 3 || points.shape(2) != 3 || points.shape(1) > LW_BODY_MAX || times.size() != points.shape(0))
        throw std::invalid_argument("points: expected (n, k, 3) with k up to 12, and n times");
    const size_t parts = points.shape(1);
    Owned<double> distance({points.shape(0), parts});
    Owned<int64_t> obstacle({points.shape(0), parts});
    lw_body body = {};
    lw_placed placed = {};
    lw_near near[LW_BODY_MAX];
    body.count = static_cast<int>(parts);
    body.tool_part = -1;
    for (size_t row = 0; row < points.shape(0); row++) {
        for (size_t part = 0; part < parts; part++) {
            const double *point = points.data() + 3 * (row * parts + part);
            std::copy(point, point + 3, placed.capsule[part].a);
            std::copy(point, point + 3, placed.capsule[part].b);
            lw_body_mark(&placed, static_cast<int>(part), 0);
        }
        const lw_near_query query = {&body, &placed, &look(), times.data()[row], INFINITY, nullptr};
        lw_near_each(&query, near);
        for (size_t part = 0; part < parts; part++) {
            distance.data[row * parts + part] = near[part].distance.d;
            obstacle.data[row * parts + part] = near[part].obstacle;
        }
    }
    return nb::make_tuple(distance.release(), obstacle.release());
}

nb::list World::obstacles() const
{
    nb::list out;
    for (int at = 0; at < data_->count; at++) {
        const lw_world_entry &entry = data_->entry[at];
        const lw_obstacle &o = entry.obstacle;
        double vertex[3 * LW_HULL_MAX];
        const int vertices = lw_world_vertices(data_.get(), &entry, vertex);
        out.append(nb::make_tuple(o.id, static_cast<int>(o.shape), numbers(o.p, 3), numbers(o.quat, 4), o.radius,
                                  numbers(o.size, 3), numbers(o.v, 3), numbers(o.omega, 3), entry.time_ns,
                                  data_->expires_ns[at], numbers(vertex, 3 * vertices), data_->owner[at]));
    }
    return out;
}

const lw_snapshot &World::look() const
{
    if (!seen_) {
        seen_ = zeroed<lw_snapshot>();
        const lw_status status = lw_world_build(data_.get(), seen_.get());
        if (status != LW_OK)
            throw std::invalid_argument(lw_status_text(status));
    }
    return *seen_;
}

void bind_world(nb::module_ &m)
{
    nb::class_<World>(m, "World", "The set of obstacles that a controller believes in.")
        .def(nb::init<>(), "Nothing heard yet.")
        .def("copy", &World::copy, "The same world, to go on from.")
        .def("apply", &World::apply, nb::arg("change"), nb::arg("hull") = false,
             "Takes an OBSTACLES or HULL message; False when it is refused.")
        .def("adopt", &World::adopt, nb::arg("channel"), nb::arg("session"), nb::arg("seq"), nb::arg("version"),
             "Takes the echo of a command for a world whose history is not known.")
        .def("obstacles", &World::obstacles,
             "Each as (id, shape, p m, quat, radius m, size m, v m/s, omega rad/s, time_ns, expires_ns, vertices m, "
             "owner).")
        .def("nearest", &World::nearest, nb::arg("points"), nb::arg("times"),
             "Distance (n, k) m of points (n, k, 3) m to the nearest surface at times (n,) ns, and whose it is (n, k).")
        .def_prop_ro("echo", &World::echo, "Channel, session and seq of the newest message, number of changes.")
        .def_prop_ro(
            "count", [](const World &w) { return w.data().count; }, "Number of obstacles.")
        .def_prop_ro("digest", [](const World &w) { return w.data().digest; }, "Digest of the obstacles.");
}
