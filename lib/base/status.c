// SPDX-License-Identifier: BSD-3-Clause
// Texts of the status codes.
//
// Units    none.
// Frames   none.
// Arrays   none.
// Memory   constants only.
// Errors   none.
#include "base/status.h"

#include <stddef.h> // size_t

static const char *const status_text[] = {
#define LW_STATUS_TEXT(name, text) text,
    LW_STATUS_LIST(LW_STATUS_TEXT)
#undef LW_STATUS_TEXT
};

const char *lw_status_text(enum lw_status status)
{
    const size_t count = sizeof status_text / sizeof status_text[0];
    return (size_t)status < count ? status_text[status] : "unknown status";
}
