// SPDX-License-Identifier: BSD-3-Clause
// Program: what controller and simulator have in common: command line (options.c), scene, bus, words for people, and
// what they ask of the system to keep time (realtime.c).
//
// Units    none.
// Frames   none.
// Arrays   none.
// Memory   points into argv; the scene's text is kept for the life of the process.
// Errors   a wrong command line or scene ends the program with exit status 2 and one message.
#ifndef LW_PROGRAM_PROGRAM_H
#define LW_PROGRAM_PROGRAM_H

#include "bus/bus.h"        // struct lw_bus_config
#include "program/health.h" // struct lw_health
#include "scene/scene.h"    // struct lw_scene

#include <pthread.h> // pthread_t

enum { LW_SETS_MAX = 64 };

// What a program asks of the system: what it can get, all of it or nothing.
enum lw_realtime_wish { LW_REALTIME_AUTO, LW_REALTIME_REQUIRE, LW_REALTIME_OFF };

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
    enum lw_realtime_wish realtime_wish;
    int cpu;                // that the real-time thread is bound to, -1 = any
    int priority;           // SCHED_FIFO of the real-time thread; its receive thread has one less
    bool lcm_threads;       // receive the peer's stream by LCM's own threads
    const char *postmortem; // folder of the files written after a fault, NULL = none
    const char *histogram;  // file for statistics at the end, NULL = none
    struct lw_bus_config bus_config;

    unsigned realtime;        // set of enum lw_realtime: what the system granted
    bool no_scene, no_status; // SCENE, STATUS or PLANT_STATUS cannot be sent for the moment
    struct lw_refusals refusals;

    // From the scene file and --set.
    struct lw_scene scene;
    char *yaml; // the scene in force, every key written out
};

// Parses the command line, loads the scene, draws the session. Prints help, or a message and ends the program.
void lw_program_start(struct lw_program *program, int argc, char **argv);

// Prints "NAME: text" to stderr: `say` unless --quiet, `fail` always.
void lw_program_say(const struct lw_program *program, const char *format, ...) __attribute__((format(printf, 2, 3)));
void lw_program_fail(const struct lw_program *program, const char *format, ...) __attribute__((format(printf, 2, 3)));

// Says that a channel's messages cannot be sent, once until they can: who reads stderr slowly must not hold us up.
//   failing  in/out  whether the message before failed; false at first
void lw_program_say_sent(const struct lw_program *program, const char *channel, bool sent, bool *failing);

// Opens a bus connection to publish on, one to receive on as --transport says, or subscribes on one; says why not.
LW_MUST_CHECK enum lw_status lw_program_open(const struct lw_program *program, struct lw_bus **bus);
LW_MUST_CHECK enum lw_status lw_program_open_stream(const struct lw_program *program, struct lw_bus **bus);
LW_MUST_CHECK enum lw_status lw_program_subscribe(const struct lw_program *program, struct lw_bus *bus,
                                                  enum lw_channel channel, lw_bus_handler handler, void *user);

// What the program runs, for logs.
struct lw_bus_scene lw_program_scene(const struct lw_program *program);

// Publishes the scene in force on SCENE, for the log, when a second has passed since it did so last.
//   due_ns  in/out  CLOCK_MONOTONIC of the next time; 0 = now
void lw_program_announce(struct lw_program *program, struct lw_bus *bus, int64_t *due_ns);

// Asks the system for all that keeps time, before any thread starts: memory locked and kept, CPUs kept awake,
// SCHED_FIFO and the CPU asked for. Says what it refuses; false when the user required it.
LW_MUST_CHECK bool lw_program_go_realtime(struct lw_program *program);

// Makes the calling thread the real-time thread, or (`behind` = 1) one that serves it, as far as the system grants it.
void lw_program_realtime_thread(const struct lw_program *program, int behind);
void lw_program_normal_thread(void);

// Publishes what a program's health is on its channel, 20 times a second; says so when it cannot.
//   report  in  state, faults and what is of its own; the rest is filled in
void lw_program_report(struct lw_program *program, struct lw_bus *bus, struct lw_health *health,
                       struct lw_report *report);

// Writes the statistics asked for by --histogram; false, and it says why, when it cannot.
LW_MUST_CHECK bool lw_program_write_histogram(const struct lw_program *program, const struct lw_health *health);

// Starts a thread; says so when there is none to be had.
LW_MUST_CHECK bool lw_program_thread(const struct lw_program *program, pthread_t *thread, void *(*run)(void *),
                                     void *user);

#endif
