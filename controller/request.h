// SPDX-License-Identifier: BSD-3-Clause
// Requests: each is obeyed once. Senders repeat GOAL and STOP until they see the echo, and a late repetition must not
// undo what somebody else asked for since.
//
// Units    none.
// Frames   none.
// Arrays   none.
// Memory   plain data.
// Errors   none.
#ifndef LW_CONTROLLER_REQUEST_H
#define LW_CONTROLLER_REQUEST_H

#include "arm/joint.h" // struct lw_request

#include <stdbool.h> // bool

enum { LW_REQUEST_SENDERS = 16 };

// Newest seq of each kind from the senders heard last; seq is counted per channel, so each kind has its own.
struct lw_request_memory {
    struct lw_request_sender {
        enum lw_request_kind kind;
        int64_t session;
        int64_t seq;
    } sender[LW_REQUEST_SENDERS];
    int next; // place of the next new sender: the oldest makes room
};

// The request to stop that a program makes of itself when it is to end. Its session is below 0: no message has it.
extern const struct lw_request lw_request_shutdown;

// Whether a request is new; then it is remembered. Session 0 is no request. Cost: fixed.
bool lw_request_is_new(struct lw_request_memory *memory, const struct lw_request *request);

#endif
