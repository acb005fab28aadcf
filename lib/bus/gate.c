// SPDX-License-Identifier: BSD-3-Clause
// Lease and verdicts.
//
// Units    see gate.h.
// Frames   none.
// Arrays   see gate.h.
// Memory   the caller's.
// Errors   see gate.h.
#include "bus/gate.h"

#include <math.h> // fabs, isfinite

// Sum that ends at the largest number: a hostile sender may skip as many numbers as it likes.
static int64_t add(int64_t sum, int64_t more)
{
    return more > INT64_MAX - sum ? INT64_MAX : sum + more;
}

int64_t lw_lease_ns(int64_t patience_ns)
{
    return patience_ns > LW_LEASE_NS ? patience_ns : LW_LEASE_NS;
}

enum lw_verdict lw_lease_take(struct lw_lease *lease, const struct lw_stamp *stamp, int64_t now_ns, int64_t lease_ns)
{
    const bool held = lease->session != 0;
    if (stamp->session == lease->session) {
        if (stamp->seq <= lease->seq)
            return stamp->seq == lease->seq ? LW_REFUSED_DUPLICATE : LW_REFUSED_BACKWARDS;
        lease->missed = add(lease->missed, stamp->seq - lease->seq - 1);
    } else {
        if (held && now_ns - lease->last_ns < lease_ns)
            return LW_REFUSED_FOREIGN;
        lease->takeovers += held;
        lease->session = stamp->session;
    }
    lease->seq = stamp->seq;
    lease->last_ns = now_ns;
    lease->taken++;
    return LW_TAKEN;
}

static bool in_range(const double limit[LW_NJ], const double qd[LW_NJ])
{
    for (int j = 0; j < LW_NJ; j++)
        if (!isfinite(qd[j]) || fabs(qd[j]) > limit[j])
            return false;
    return true;
}

enum lw_verdict lw_gate_judge(const struct lw_gate *gate, struct lw_lease *lease,
                              const struct lw_joint_command *command, int64_t state_seq, int64_t now_ns)
{
    if (!in_range(gate->velocity, command->qd))
        return LW_REFUSED_RANGE;
    if (now_ns < gate->open_ns)
        return LW_REFUSED_GUARD;
    if (command->plant_session != gate->plant_session)
        return LW_REFUSED_OTHER_PLANT;
    if (command->mode != LW_COMMAND_VELOCITY)
        return LW_REFUSED_IDLE;
    // Before the lease: a late message of a dead controller must not seize a free one. The sender chooses its number,
    // so it is only compared: a difference may not fit.
    if (command->state_seq > state_seq || command->state_seq < state_seq - gate->max_lag)
        return LW_REFUSED_STALE;
    return lw_lease_take(lease, &command->stamp, now_ns, gate->lease_ns);
}
