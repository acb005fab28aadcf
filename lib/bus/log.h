// SPDX-License-Identifier: BSD-3-Clause
// Log: writes an LCM log as lcm-logger would, so that every tool for logs reads it.
//
// Units    us for times of events.
// Frames   none.
// Arrays   none.
// Memory   open allocates; not for real-time threads.
// Errors   LW_E_IO; errno says why.
#ifndef LW_BUS_LOG_H
#define LW_BUS_LOG_H

#include "bus/bus.h" // struct lw_bus, struct lw_bus_scene

struct lw_log;

// Starts a file; one that exists is overwritten.
//   bus  in  names the channels; kept by the log
LW_MUST_CHECK enum lw_status lw_log_open(const char *path, struct lw_bus *bus, struct lw_log **log);

// Appends a message with its own stamp. A failure is kept until close.
//   utime  in  us, when it came
void lw_log_write(struct lw_log *log, enum lw_channel channel, const union lw_message *message, int64_t utime);
void lw_log_write_scene(struct lw_log *log, const struct lw_bus_scene *scene, int64_t utime);

// Ends the file. Fails when anything was not written.
LW_MUST_CHECK enum lw_status lw_log_close(struct lw_log *log);

#endif
