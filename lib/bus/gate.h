// SPDX-License-Identifier: BSD-3-Clause
// Gate: who may speak, and which of its messages count. LCM gives no order, no ownership and no liveness; this does.
// Pure: time is passed in.
//
// Units    ns of one clock; rad/s.
// Frames   none.
// Arrays   one entry a joint.
// Memory   plain data, one thread.
// Errors   a verdict with the reason.
#ifndef LW_BUS_GATE_H
#define LW_BUS_GATE_H

#include "arm/joint.h"    // struct lw_joint_command
#include "base/verdict.h" // enum lw_verdict

#include <stdbool.h> // bool

// Silence after which another sender may take over, at least.
#define LW_LEASE_NS INT64_C(100000000)

// The same for a receiver with patience of its own: as long as it still goes by the holder's last message, nobody takes
// over, however slow the holder's rate is.
int64_t lw_lease_ns(int64_t patience_ns);

// The sender obeyed, one at a time, and what came of its stream.
struct lw_lease {
    int64_t session;   // of the holder, 0 = none yet
    int64_t seq;       // newest taken from it
    int64_t last_ns;   // when that was
    int64_t taken;     // messages, of all holders
    int64_t missed;    // numbers skipped in the holders' sequences
    int64_t takeovers; // times that another session took over
};

// Takes a message when its sender holds the lease, or when the holder has been silent for lease_ns, and when its
// number is higher than the last one.
enum lw_verdict lw_lease_take(struct lw_lease *lease, const struct lw_stamp *stamp, int64_t now_ns, int64_t lease_ns);

// What a plant asks of a command.
struct lw_gate {
    int64_t plant_session;  // only commands meant for this plant
    int64_t open_ns;        // none before this time: a controller of the plant before must notice first
    int64_t lease_ns;       // silence after which another controller may take over
    int64_t max_lag;        // states published since the one it was computed from
    double velocity[LW_NJ]; // rad/s, largest value, infinite = any
};

// Judges a validated command; when it is taken, the lease is its sender's.
//   state_seq  in  number of the newest state published
enum lw_verdict lw_gate_judge(const struct lw_gate *gate, struct lw_lease *lease,
                              const struct lw_joint_command *command, int64_t state_seq, int64_t now_ns);

#endif
