// SPDX-License-Identifier: BSD-3-Clause
// Post-mortem: after a fault that brakes the arm, the last two seconds of what the controller was given and what it
// commanded, as an LCM log that every tool for logs reads.
//
// Units    ns of CLOCK_MONOTONIC.
// Frames   base frame of the arm.
// Arrays   none.
// Memory   plain data and a mutex between two normal threads; the real-time thread has no part in it.
// Errors   a file that cannot be written is said on stderr, once a fault.
#ifndef LW_CONTROLLER_POSTMORTEM_H
#define LW_CONTROLLER_POSTMORTEM_H

#include "collision/world.h" // struct lw_world
#include "controller/tell.h" // struct lw_tell
#include "program/health.h"  // struct lw_health
#include "program/program.h" // struct lw_program

#include <pthread.h> // pthread_mutex_t

enum { LW_HEARD_MAX = 256 };

// What the world thread took in: the newest messages, and the obstacles before them.
struct lw_heard_past {
    struct lw_world before; // all older messages merged
    struct lw_heard_message {
        int channel; // enum lw_channel
        union lw_message message;
        int64_t time_ns;
    } newest[LW_HEARD_MAX];
    int count, next;
};

struct lw_heard {
    pthread_mutex_t lock;
    struct lw_heard_past past;
};

void lw_heard_init(struct lw_heard *heard);

// World thread: notes a message that was taken.
void lw_heard_note(struct lw_heard *heard, enum lw_channel channel, const union lw_message *message);

struct lw_postmortem {
    unsigned seen;              // faults that braked the arm of late
    int64_t faulty_ns;          // when the newest of them was
    int written;                // files
    unsigned fault;             // those to write about, 0 = none
    int64_t due_ns;             // when: a moment later, so that the file shows what followed
    int64_t looked_ns;          // time of the newest tick looked at
    struct lw_heard_past heard; // copy that is written
    struct lw_tell tell;        // of the obstacles in it
};

// Main thread, often: looks for new faults in the ticks since the last look, and writes the file when it is time.
//   now_ns  in  INT64_MAX at the end of the process: what is due later is written now
void lw_postmortem_watch(struct lw_postmortem *postmortem, const struct lw_program *program, struct lw_bus *bus,
                         const struct lw_health *health, struct lw_heard *heard, int64_t now_ns);

#endif
