// SPDX-License-Identifier: BSD-3-Clause
// Wire: bytes of an LCM message <-> Leeway's structs, with every check that a hostile sender calls for.
//
// Units    those of lcmtypes/*.lcm.
// Frames   base frame of the arm.
// Arrays   fixed sizes only: no message carries a length that could lie.
// Memory   encode and decode never allocate.
// Errors   LW_E_SIZE, LW_E_DECODE (other type or version), LW_E_NOT_FINITE, LW_E_ARGUMENT (value out of range).
#ifndef LW_BUS_WIRE_H
#define LW_BUS_WIRE_H

#include "arm/joint.h"          // struct lw_joint_state, struct lw_joint_command, struct lw_request
#include "bus/report.h"         // struct lw_report
#include "collision/obstacle.h" // struct lw_obstacle_change

#include <stdbool.h> // bool
#include <stdint.h>  // uint32_t

enum lw_channel {
    LW_CHANNEL_JOINT_STATE,
    LW_CHANNEL_JOINT_COMMAND,
    LW_CHANNEL_OBSTACLES,
    LW_CHANNEL_HULL,
    LW_CHANNEL_GOAL,
    LW_CHANNEL_STOP,
    LW_CHANNEL_WORLD,
    LW_CHANNEL_WORLD_HULL,
    LW_CHANNEL_STATUS,
    LW_CHANNEL_PLANT_STATUS,
    LW_CHANNEL_COUNT
};

enum { LW_WIRE_MAX = 6144 }; // bytes, more than any message

// Any message; the channel says which member holds it.
union lw_message {
    struct lw_stamp stamp; // every member starts with its stamp
    struct lw_joint_state joint_state;
    struct lw_joint_command joint_command;
    struct lw_obstacle_change obstacles; // OBSTACLES, HULL, WORLD and WORLD_HULL
    struct lw_request request;           // GOAL and STOP
    struct lw_report report;             // STATUS and PLANT_STATUS
};

// Name of a channel without a robot's prefix.
const char *lw_wire_channel_name(enum lw_channel channel);

// Whether all robots of a bus share a channel; every other channel belongs to one.
bool lw_wire_is_shared(enum lw_channel channel);

// Exact size in bytes of a channel's message, fingerprint included.
uint32_t lw_wire_size(enum lw_channel channel);

// Fingerprint of a channel's type.
int64_t lw_wire_fingerprint(enum lw_channel channel);

// Decodes and validates. `size` is LCM's data_size, which a malformed packet can make huge.
LW_MUST_CHECK enum lw_status lw_wire_decode(enum lw_channel channel, const void *data, uint32_t size,
                                            union lw_message *message);

// Encodes into a buffer of LW_WIRE_MAX bytes; returns the number of bytes.
uint32_t lw_wire_encode(enum lw_channel channel, const union lw_message *message, void *data);

#endif
