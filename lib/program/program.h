// SPDX-License-Identifier: BSD-3-Clause
// Program: what controller and simulator have in common: command line, scene, bus, and words for people.
//
// Units    none.
// Frames   none.
// Arrays   none.
// Memory   points into argv; the scene's text is kept for the life of the process.
// Errors   a wrong command line or scene ends the program with exit status 2 and one message.
#ifndef LW_PROGRAM_PROGRAM_H
#define LW_PROGRAM_PROGRAM_H

#include "bus/bus.h"     // struct lw_bus_config
#include "scene/scene.h" // struct lw_scene

#include <pthread.h> // pthread_t

enum { LW_SETS_MAX = 64 };

struct lw_program {
    // Set by the program itself.
    const char *name;
    const char *summary; // for --help, with an example
    bool is_simulator;   // knows --until-done and --pace

    // From the command line.
    const char *path; // scene file
    const char *set[LW_SETS_MAX];
    int set_count;
    bool lockstep;
    bool until_done; // end after the scene's duration
    int pace;        // messages per second in lockstep
    bool quiet;
    struct lw_bus_config bus_config;

    // From the scene file and --set.
    struct lw_scene scene;
    char *yaml; // the scene in force, every key written out
};

// Parses the command line, loads the scene, draws the session. Prints help, or a message and ends the program.
void lw_program_start(struct lw_program *program, int argc, char **argv);

// Prints "NAME: text" to stderr: `say` unless --quiet, `fail` always.
void lw_program_say(const struct lw_program *program, const char *format, ...) __attribute__((format(printf, 2, 3)));
void lw_program_fail(const struct lw_program *program, const char *format, ...) __attribute__((format(printf, 2, 3)));

// Opens a bus connection, or subscribes on one; says why not.
LW_MUST_CHECK enum lw_status lw_program_open(const struct lw_program *program, struct lw_bus **bus);
LW_MUST_CHECK enum lw_status lw_program_subscribe(const struct lw_program *program, struct lw_bus *bus,
                                                  enum lw_channel channel, lw_bus_handler handler, void *user);

// Publishes the scene in force on SCENE, for the log, when a second has passed since it did so last.
//   due_ns  in/out  CLOCK_MONOTONIC of the next time; 0 = now
void lw_program_announce(const struct lw_program *program, struct lw_bus *bus, int64_t *due_ns);

// Asks for locked memory and SCHED_FIFO for the calling thread; says so when the system refuses.
void lw_program_go_realtime(const struct lw_program *program, int priority);

// Starts a thread; says so when there is none to be had.
LW_MUST_CHECK bool lw_program_thread(const struct lw_program *program, pthread_t *thread, void *(*run)(void *),
                                     void *user);

#endif
