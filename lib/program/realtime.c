// SPDX-License-Identifier: BSD-3-Clause
// What a program asks of the system to keep time, in the order in which it must be asked.
//
// Units    none.
// Frames   none.
// Arrays   none.
// Memory   locked, where the system grants it.
// Errors   see program.h.
#define _GNU_SOURCE      // M_TRIM_THRESHOLD
#include "base/thread.h" // lw_thread_*
#include "program/program.h"

#include <fcntl.h>  // open
#include <malloc.h> // mallopt
#include <stdint.h> // int32_t
#include <string.h> // strlen
#include <unistd.h> // write

// Keeps the CPUs out of deep sleep as long as the file stays open: until the process ends.
static bool keep_awake(void)
{
    const int32_t latency_us = 0;
    const int file = open("/dev/cpu_dma_latency", O_RDWR | O_CLOEXEC);
    if (file < 0)
        return false;
    if (write(file, &latency_us, sizeof latency_us) == (ssize_t)sizeof latency_us)
        return true;
    close(file);
    return false;
}

// Asks for everything. Returns what was granted.
static unsigned ask(const struct lw_program *program)
{
    unsigned granted = 0;
    // Memory given back stays mapped, so that it need not be faulted in again.
    // NOLINTNEXTLINE(concurrency-mt-unsafe): no thread has started yet
    (void)(mallopt(M_TRIM_THRESHOLD, -1) && mallopt(M_MMAP_MAX, 0));
    if (lw_thread_lock_memory())
        granted |= LW_RT_LOCKED;
    if (keep_awake())
        granted |= LW_RT_AWAKE;
    // A trial: each thread asks for itself when it starts.
    if (lw_thread_set_priority(program->priority)) {
        granted |= LW_RT_FIFO;
        (void)lw_thread_set_priority(0);
    }
    if (program->cpu >= 0 && lw_thread_may_bind(program->cpu))
        granted |= LW_RT_PINNED;
    return granted;
}

// What was wanted and not granted, in words; empty when there is nothing.
static void list_missing(const struct lw_program *program, char *text, size_t size)
{
    static const struct {
        unsigned bit;
        const char *words;
    } rows[] = {
        {LW_RT_FIFO, "no real-time priority (as root, or rtprio in limits.conf)"},
        {LW_RT_LOCKED, "memory not locked (as root, or memlock in limits.conf)"},
        {LW_RT_PINNED, "no such CPU to bind to"},
    };
    text[0] = '\0';
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        const bool wanted = rows[i].bit != LW_RT_PINNED || program->cpu >= 0;
        const size_t used = strlen(text);
        if (wanted && !(program->realtime & rows[i].bit))
            snprintf(text + used, size - used, "%s%s", used ? "; " : "", rows[i].words);
    }
}

bool lw_program_go_realtime(struct lw_program *program)
{
    char missing[300];
    if (program->realtime_wish == LW_REALTIME_OFF)
        return true;
    program->realtime = ask(program);
    list_missing(program, missing, sizeof missing);
    if (missing[0] == '\0')
        return true;
    if (program->realtime_wish == LW_REALTIME_REQUIRE) {
        lw_program_fail(program, "--rt=require: %s; leeway doctor shows the remedies", missing);
        return false;
    }
    lw_program_say(program, "%s: deadlines depend on what else this machine does; leeway doctor shows the remedies",
                   missing);
    return true;
}

void lw_program_realtime_thread(const struct lw_program *program, int behind)
{
    lw_thread_prefault_stack();
    if (program->realtime & LW_RT_FIFO)
        (void)lw_thread_set_priority(program->priority - behind);
    if ((program->realtime & LW_RT_PINNED) && behind == 0)
        (void)lw_thread_bind(program->cpu);
}

void lw_program_normal_thread(void)
{
    (void)lw_thread_set_priority(0);
}
