// SPDX-License-Identifier: BSD-3-Clause
// Bus connections, threads and words of a program.
//
// Units    none.
// Frames   none.
// Arrays   none.
// Memory   see program.h.
// Errors   see program.h.
#define _GNU_SOURCE // strerrordesc_np
#include "program/program.h"

#include "base/clock.h"  // lw_clock_mono_ns
#include "base/thread.h" // lw_thread_start

#include <errno.h>  // errno
#include <stdarg.h> // va_list
#include <string.h> // strerrordesc_np

// --- words ---

static void print(const struct lw_program *program, const char *format, va_list args)
    __attribute__((format(printf, 2, 0)));

static void print(const struct lw_program *program, const char *format, va_list args)
{
    char text[600];
    vsnprintf(text, sizeof text, format, args);
    fprintf(stderr, "%s: %s\n", program->name, text);
}

void lw_program_say(const struct lw_program *program, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    if (!program->quiet)
        print(program, format, args);
    va_end(args);
}

void lw_program_fail(const struct lw_program *program, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    print(program, format, args);
    va_end(args);
}

void lw_program_say_sent(const struct lw_program *program, const char *channel, bool sent, bool *failing)
{
    if (sent == *failing)
        lw_program_say(program, sent ? "%s is sent again" : "%s cannot be sent", channel);
    *failing = !sent;
}

// --- bus ---

static enum lw_status open_bus(const struct lw_program *program, bool own_socket, struct lw_bus **bus)
{
    struct lw_error error;
    struct lw_bus_config config = program->bus_config;
    config.own_socket = own_socket;
    const enum lw_status status = lw_bus_open(&config, bus, &error);
    if (status != LW_OK)
        lw_program_fail(program, "%s", error.text);
    return status;
}

enum lw_status lw_program_open(const struct lw_program *program, struct lw_bus **bus)
{
    return open_bus(program, false, bus);
}

enum lw_status lw_program_open_stream(const struct lw_program *program, struct lw_bus **bus)
{
    return open_bus(program, !program->lcm_threads, bus);
}

enum lw_status lw_program_subscribe(const struct lw_program *program, struct lw_bus *bus, enum lw_channel channel,
                                    lw_bus_handler handler, void *user)
{
    struct lw_error error;
    const enum lw_status status = lw_bus_subscribe(bus, channel, handler, user, &error);
    if (status != LW_OK)
        lw_program_fail(program, "%s", error.text);
    return status;
}

struct lw_bus_scene lw_program_scene(const struct lw_program *program)
{
    return (struct lw_bus_scene){.program = program->name,
                                 .mode = program->lockstep ? "lockstep" : "realtime",
                                 .file = program->path,
                                 .yaml = program->yaml};
}

void lw_program_announce(struct lw_program *program, struct lw_bus *bus, int64_t *due_ns)
{
    const int64_t now_ns = lw_clock_mono_ns();
    if (now_ns < *due_ns)
        return;
    *due_ns = now_ns + LW_NS_PER_S;
    const struct lw_bus_scene scene = lw_program_scene(program);
    lw_program_say_sent(program, "SCENE", lw_bus_publish_scene(bus, &scene) == LW_OK, &program->no_scene);
}

void lw_program_report(struct lw_program *program, struct lw_bus *bus, struct lw_health *health,
                       struct lw_report *report)
{
    const enum lw_channel channel = program->is_simulator ? LW_CHANNEL_PLANT_STATUS : LW_CHANNEL_STATUS;
    union lw_message message;
    report->realtime = program->realtime;
    lw_health_report(health, &program->refusals, report);
    message.report = *report;
    const bool sent = lw_bus_publish(bus, channel, &message) == LW_OK;
    lw_program_say_sent(program, lw_wire_channel_name(channel), sent, &program->no_status);
}

bool lw_program_write_histogram(const struct lw_program *program, const struct lw_health *health)
{
    if (program->histogram == NULL)
        return true;
    FILE *to = fopen(program->histogram, "w");
    if (to != NULL)
        lw_health_write(health, program->name, program->realtime, to);
    // A failure in the middle shows in ferror alone.
    const bool written = to != NULL && fflush(to) == 0 && !ferror(to);
    if (!written)
        lw_program_fail(program, "%s: cannot write the statistics: %s", program->histogram, strerrordesc_np(errno));
    return (to == NULL || fclose(to) == 0) && written;
}

bool lw_program_thread(const struct lw_program *program, pthread_t *thread, void *(*run)(void *), void *user)
{
    if (lw_thread_start(thread, run, user))
        return true;
    lw_program_fail(program, "cannot start a thread");
    return false;
}
