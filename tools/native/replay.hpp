// SPDX-License-Identifier: BSD-3-Clause
// Replay for Python: the controller's tick and its world, fed with messages as they are in a log.
//
// Units    metres, radians, seconds; ns where a name says so.
// Frames   base frame of the arm.
// Arrays   messages are whole LCM payloads, fingerprint included.
// Memory   plain data by value.
// Errors   ValueError for a scene that no controller can run; a message that a controller would refuse is answered
// False.
#ifndef LW_NATIVE_REPLAY_HPP
#define LW_NATIVE_REPLAY_HPP

#include <nanobind/nanobind.h>

// Adds the classes World and Controller to a module.
void bind_replay(nanobind::module_ &m);

#endif
