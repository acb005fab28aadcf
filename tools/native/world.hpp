// SPDX-License-Identifier: BSD-3-Clause
// World for Python: the set of obstacles that a controller believes in, fed with messages of a log.
//
// Units    metres, ns.
// Frames   base frame of the arm.
// Arrays   none.
// Memory   as much as the obstacles need; a copy shares nothing that changes.
// Errors   ValueError.
#ifndef LEEWAY_NATIVE_WORLD_HPP
#define LEEWAY_NATIVE_WORLD_HPP

#include "arrays.hpp" // Input

#include <nanobind/nanobind.h>

#include <memory> // shared_ptr

extern "C" {
#include "bus/wire.h"           // lw_wire_decode
#include "collision/snapshot.h" // lw_snapshot
#include "collision/world.h"    // lw_world
}

// A message of a log as the programs take it: decoded and validated by the same code.
bool decode(lw_channel channel, const nanobind::bytes &data, lw_message &message);

class World
{
  public:
    World();

    // A world of its own, equal to this one.
    World copy() const;

    // Takes an OBSTACLES or HULL message; false when it is refused.
    bool apply(const nanobind::bytes &change, bool hull);

    // Channel, session and seq of the newest message, number of changes: what a command echoes of its world.
    nanobind::tuple echo() const;

    // Takes the echo of a command for a world whose history is not known.
    void adopt(int channel, int64_t session, int64_t seq, int64_t version);

    // Every obstacle as a tuple of its values, in the order of its digest.
    nanobind::list obstacles() const;

    // Distance (m) of each point to the nearest surface at a time, and whose it is; infinite and 0 = no obstacle.
    //   points  (n, k, 3) m, k up to 12
    //   times   (n,) ns
    nanobind::tuple nearest(const Input &points,
                            const nanobind::ndarray<const int64_t, nanobind::c_contig> &times) const;

    // The world as the tick sees it.
    const lw_snapshot &look() const;

    const lw_world &data() const
    {
        return *data_;
    }

  private:
    std::shared_ptr<lw_world> data_;
    mutable std::shared_ptr<lw_snapshot> seen_; // of data_, once somebody looked
};

void bind_world(nanobind::module_ &m);

#endif
