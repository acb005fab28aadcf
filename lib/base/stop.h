// SPDX-License-Identifier: BSD-3-Clause
// Stop: SIGINT, SIGTERM and SIGHUP as a flag that a program's main loop looks at.
//
// Units    none.
// Frames   none.
// Arrays   none.
// Memory   one static flag a process.
// Errors   none.
#ifndef LW_BASE_STOP_H
#define LW_BASE_STOP_H

// Catches SIGINT, SIGTERM and SIGHUP from now on, and ignores SIGPIPE: a closed stderr does not end the program.
void lw_stop_install(void);

// Signal that asked to stop, 0 = none yet; and how many came.
int lw_stop_signal(void);
int lw_stop_count(void);

// Exit status of a program that ended in good order: 130 after SIGINT, as shells expect, else 0.
int lw_stop_exit_status(void);

#endif
