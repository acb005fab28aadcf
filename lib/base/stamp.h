// SPDX-License-Identifier: BSD-3-Clause
// Stamp: who sent a message, when, and which one it is (header_t on the wire).
//
// Units    us for utime, ns for mono_ns.
// Frames   none.
// Arrays   none.
// Memory   plain data.
// Errors   none.
#ifndef LW_BASE_STAMP_H
#define LW_BASE_STAMP_H

#include <stdint.h> // int64_t

struct lw_stamp {
    int64_t utime;   // us since the Unix epoch, sender's wall clock; for aligning logs
    int64_t mono_ns; // ns, sender's CLOCK_MONOTONIC at publish; one host only
    int64_t session; // > 0, drawn once per process start
    int64_t seq;     // 1, 2, 3 ... per channel and session
};

#endif
