// SPDX-License-Identifier: BSD-3-Clause
// What plant and controller tell each other: joint state and joint command (lcmtypes/joint_*_t.lcm).
//
// Units    metres, radians, seconds; ns where a name says so.
// Frames   positions in the base frame.
// Arrays   one entry a joint, base to wrist 3.
// Memory   plain data, copied by value.
// Errors   none.
#ifndef LW_ARM_JOINT_H
#define LW_ARM_JOINT_H

#include "arm/arm.h"    // LW_NJ
#include "base/stamp.h" // struct lw_stamp

enum lw_plant_mode { LW_PLANT_HOLD, LW_PLANT_MOVING, LW_PLANT_STOPPING, LW_PLANT_ENDED };

// Plant -> controller, every plant period.
struct lw_joint_state {
    struct lw_stamp stamp;
    enum lw_plant_mode mode;
    int64_t command_session; // session of the controller obeyed last, 0 = none
    int64_t command_seq;     // its newest accepted command
    int64_t tick;            // plant periods since the first accepted motion command
    int64_t period_ns;       // nominal plant period
    double q[LW_NJ];         // rad
    double qd[LW_NJ];        // rad/s, after the plant's limits
};

enum lw_command_mode { LW_COMMAND_IDLE, LW_COMMAND_VELOCITY };

// Why the command is not what the law asked for. Bits, equal to those on the wire.
enum lw_flag {
    LW_LIMIT_POSITION = 1,
    LW_LIMIT_VELOCITY = 2,
    LW_LIMIT_ACCELERATION = 4,
    LW_STOPPED = 8,
    LW_STALE = 16,
    LW_NOT_FINITE = 32,
    LW_WAITING = 64,
    LW_FOREIGN = 128,
    LW_WARMING_UP = 256,
    LW_LIMIT_CLEARANCE = 512,
    LW_CONTACT = 1024,
};

// How a law fared in a tick.
enum lw_law_outcome { LW_LAW_NOT_ASKED, LW_LAW_OK, LW_LAW_NO_NUMBER, LW_LAW_STUCK, LW_LAW_ASIDE };

// Nearest pair of link and obstacle.
struct lw_nearest {
    double clearance; // m between their surfaces, negative inside; infinite when there is no obstacle
    int link;         // 1..6, 0 = none
    int obstacle;     // id, 0 = none
};

// Controller -> plant, every controller period: the command and its explanation.
struct lw_joint_command {
    struct lw_stamp stamp;
    int64_t plant_session; // echo of the state used
    int64_t state_seq;
    int64_t state_tick;
    int64_t state_mono_ns;
    enum lw_command_mode mode;
    unsigned flags; // set of enum lw_flag
    enum lw_law_outcome law_outcome;
    double qd[LW_NJ];        // rad/s, the command
    double qd_law[LW_NJ];    // rad/s, wish of the law before the guard
    double q[LW_NJ];         // rad, configuration it was computed for
    double goal[3];          // m
    struct lw_stamp request; // newest request obeyed (session and seq only)
    struct lw_stamp world;   // newest message about obstacles taken in (session and seq only)
    int world_channel;       // enum lw_world_channel: what it came by
    int64_t world_version;
    int obstacle_count; // without those that have expired
    double deviation;   // m, tip to goal
    struct lw_nearest nearest;
    double self_clearance;    // m, between two links watched against each other; infinite = none near
    int self_link[2];         // 0 = none
    int64_t stuck_since_ns;   // since when the tip has been stuck, 0 = it is not
    double circulation[3];    // axis times gain, 0 = none
    int64_t tick;             // 1, 2, 3 ...
    int64_t tick_ns;          // the tick's own time
    int64_t state_age_ns;     // age of the state at tick_ns
    int64_t input_digest;     // over everything the tick was given
    int64_t compute_ns;       // wake-up until computed
    int64_t wake_late_ns;     // wake-up after the deadline
    int64_t previous_exec_ns; // wake-up to publish of the previous tick
    int64_t skipped;          // periods skipped since start
};

// Operator -> controller.
enum lw_request_kind { LW_REQUEST_GOAL, LW_REQUEST_STOP };

struct lw_request {
    struct lw_stamp stamp;
    enum lw_request_kind kind;
    double goal[3]; // m, target of the tip; used by LW_REQUEST_GOAL
};

#endif
