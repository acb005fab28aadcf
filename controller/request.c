// SPDX-License-Identifier: BSD-3-Clause
// Memory of the requests obeyed.
//
// Units    none.
// Frames   none.
// Arrays   none.
// Memory   the caller's.
// Errors   none.
#include "controller/request.h"

// No message comes from such a session (bus/wire.c), so nobody can make it look like one obeyed before.
const struct lw_request lw_request_shutdown = {.stamp = {.session = -1, .seq = 1}, .kind = LW_REQUEST_STOP};

bool lw_request_is_new(struct lw_request_memory *memory, const struct lw_request *request)
{
    const struct lw_stamp *stamp = &request->stamp;
    if (stamp->session == 0)
        return false;
    for (int i = 0; i < LW_REQUEST_SENDERS; i++) {
        struct lw_request_sender *sender = &memory->sender[i];
        if (sender->session != stamp->session || sender->kind != request->kind)
            continue;
        const bool newer = stamp->seq > sender->seq;
        sender->seq = newer ? stamp->seq : sender->seq;
        return newer;
    }
    memory->sender[memory->next] =
        (struct lw_request_sender){.kind = request->kind, .session = stamp->session, .seq = stamp->seq};
    memory->next = (memory->next + 1) % LW_REQUEST_SENDERS;
    return true;
}
