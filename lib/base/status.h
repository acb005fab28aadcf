// SPDX-License-Identifier: BSD-3-Clause
// Status codes: what a function that can fail returns. An outcome (goal reached, limit active) is not a status.
//
// Units    none.
// Frames   none.
// Arrays   none.
// Memory   texts are constants.
// Errors   LW_OK is 0; everything else is a failure, and then outputs are unchanged.
#ifndef LW_BASE_STATUS_H
#define LW_BASE_STATUS_H

#define LW_MUST_CHECK __attribute__((warn_unused_result))

// One line a code: name, text for people.
#define LW_STATUS_LIST(X)                                                                                              \
    X(LW_OK, "ok")                                                                                                     \
    X(LW_E_ARGUMENT, "argument out of range")                                                                          \
    X(LW_E_NOT_FINITE, "value is not a finite number")                                                                 \
    X(LW_E_SIZE, "message has the wrong size")                                                                         \
    X(LW_E_DECODE, "message is of another type or version")                                                            \
    X(LW_E_OLD, "message was overtaken by a newer one")                                                                \
    X(LW_E_FULL, "no room left")                                                                                       \
    X(LW_E_UNKNOWN, "vertices of this hull were never told")                                                           \
    X(LW_E_IO, "file or memory error")                                                                                 \
    X(LW_E_SCENE, "scene refused")                                                                                     \
    X(LW_E_BUS, "bus not available")

enum lw_status {
#define LW_STATUS_NAME(name, text) name,
    LW_STATUS_LIST(LW_STATUS_NAME)
#undef LW_STATUS_NAME
};

// Text of a status for people, never NULL.
const char *lw_status_text(enum lw_status status);

#endif
