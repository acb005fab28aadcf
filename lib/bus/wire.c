// SPDX-License-Identifier: BSD-3-Clause
// Every channel and the kind of its messages, one table row a channel.
//
// Units    those of lcmtypes/*.lcm.
// Frames   base frame of the arm.
// Arrays   fixed sizes.
// Memory   stack only.
// Errors   see wire.h.
#include "bus/wire.h"

#include "bus/wire_kind.h" // struct lw_wire_kind

static const struct row {
    const char *name;
    const struct lw_wire_kind *kind;
} rows[LW_CHANNEL_COUNT] = {
    [LW_CHANNEL_JOINT_STATE] = {"JOINT_STATE", &lw_wire_joint_state},
    [LW_CHANNEL_JOINT_COMMAND] = {"JOINT_COMMAND", &lw_wire_joint_command},
    [LW_CHANNEL_OBSTACLES] = {"OBSTACLES", &lw_wire_obstacles},
    [LW_CHANNEL_HULL] = {"HULL", &lw_wire_hull},
    [LW_CHANNEL_GOAL] = {"GOAL", &lw_wire_goal},
    [LW_CHANNEL_STOP] = {"STOP", &lw_wire_stop},
    [LW_CHANNEL_WORLD] = {"WORLD", &lw_wire_obstacles},
    [LW_CHANNEL_WORLD_HULL] = {"WORLD_HULL", &lw_wire_hull},
    [LW_CHANNEL_STATUS] = {"STATUS", &lw_wire_status},
    [LW_CHANNEL_PLANT_STATUS] = {"PLANT_STATUS", &lw_wire_status},
};

const char *lw_wire_channel_name(enum lw_channel channel)
{
    return rows[channel].name;
}

bool lw_wire_is_shared(enum lw_channel channel)
{
    return channel == LW_CHANNEL_OBSTACLES || channel == LW_CHANNEL_HULL;
}

uint32_t lw_wire_size(enum lw_channel channel)
{
    return (uint32_t)rows[channel].kind->size();
}

int64_t lw_wire_fingerprint(enum lw_channel channel)
{
    return rows[channel].kind->fingerprint();
}

enum lw_status lw_wire_decode(enum lw_channel channel, const void *data, uint32_t size, union lw_message *message)
{
    // Size before decode: a packet without a channel name arrives with a size near 2^32.
    if (size != lw_wire_size(channel))
        return LW_E_SIZE;
    return rows[channel].kind->decode(data, (int)size, message);
}

uint32_t lw_wire_encode(enum lw_channel channel, const union lw_message *message, void *data)
{
    return (uint32_t)rows[channel].kind->encode(data, message);
}
