// SPDX-License-Identifier: BSD-3-Clause
// pingpong LINK RATE SECONDS: round trips between two processes at SCHED_FIFO 80, at a fixed rate. Prints one JSON
// object with a histogram of the round trips' times.
//
// Units    ns; us for the bins.
// Frames   none.
// Arrays   none.
// Memory   static, locked before the first round trip.
// Errors   exit status 0 ok, 1 failed, 2 usage.
#define _GNU_SOURCE // prctl
#include "link.h"

#include "base/clock.h"    // lw_clock_mono_ns
#include "base/periodic.h" // lw_periodic_*
#include "base/thread.h"   // lw_thread_*

#include <inttypes.h>  // PRId64
#include <signal.h>    // kill
#include <stdio.h>     // printf
#include <stdlib.h>    // strtod
#include <string.h>    // strcmp
#include <sys/prctl.h> // prctl
#include <sys/wait.h>  // waitpid
#include <unistd.h>    // fork

enum { PRIORITY = 80, BINS = 20000 };
static const int64_t timeout_ns = LW_LINK_TIMEOUT_MS * INT64_C(1000000);
static const int64_t patience_ns = 10 * LW_NS_PER_S; // for the first reply
static const int64_t warm_up_ns = LW_NS_PER_S / 2;

// What ping saw.
static struct {
    int64_t sent, lost, skipped;
    int64_t bin[BINS], over, max_ns;
} result;

// Locks memory and takes the priority. True when the system granted both.
static bool go_realtime(void)
{
    const bool locked = lw_thread_lock_memory();
    lw_thread_prefault_stack();
    return lw_thread_set_priority(PRIORITY) && locked;
}

// --- the two ends ---

// Answers until ping ends this process.
static void pong(const struct lw_link *link)
{
    int64_t number = 0;
    for (;;)
        if (link->receive(&number))
            (void)link->send(number); // a reply that is not sent is a lost one
}

// One round trip. Returns its time, -1 when it is lost.
static int64_t round_trip(const struct lw_link *link, int64_t number)
{
    int64_t heard = 0;
    const int64_t start_ns = lw_clock_mono_ns();
    if (!link->send(number))
        return -1;
    for (;;) {
        const bool came = link->receive(&heard);
        const int64_t elapsed_ns = lw_clock_mono_ns() - start_ns;
        if (came && heard == number)
            return elapsed_ns;
        if (elapsed_ns >= timeout_ns)
            return -1;
    }
}

static void count(int64_t ns)
{
    result.sent++;
    if (ns < 0) {
        result.lost++;
        return;
    }
    const int64_t us = ns / 1000;
    *(us < BINS ? &result.bin[us] : &result.over) += 1;
    result.max_ns = ns > result.max_ns ? ns : result.max_ns;
}

// Plays until pong answers. False when it never does.
static bool find_pong(const struct lw_link *link, int64_t *number)
{
    const int64_t end_ns = lw_clock_mono_ns() + patience_ns;
    while (round_trip(link, ++*number) < 0)
        if (lw_clock_mono_ns() > end_ns)
            return false;
    return true;
}

// Plays at a fixed rate, first to warm up, then for the record.
static void ping(const struct lw_link *link, int64_t number, int64_t period_ns, int64_t duration_ns)
{
    const int64_t warm_ns = lw_clock_mono_ns() + warm_up_ns, end_ns = warm_ns + duration_ns;
    struct lw_periodic loop = lw_periodic_start(lw_clock_mono_ns() + period_ns, period_ns);
    int64_t skipped_before = 0;
    while (loop.wake_ns < end_ns) {
        (void)lw_periodic_wait(&loop);
        const int64_t ns = round_trip(link, ++number);
        if (loop.wake_ns >= warm_ns)
            count(ns);
        else
            skipped_before = loop.skipped;
    }
    result.skipped = loop.skipped - skipped_before;
}

// --- the program ---

static void print_result(const struct lw_link *link, double rate_hz, bool realtime)
{
    int used = BINS;
    while (used > 0 && result.bin[used - 1] == 0)
        used--;
    printf("{\"link\": \"%s\", \"rate_hz\": %g, \"bytes_there\": %zu, \"bytes_back\": %zu, \"realtime\": %s,\n",
           link->name, rate_hz, lw_link_bytes(true), lw_link_bytes(false), realtime ? "true" : "false");
    printf("\"sent\": %" PRId64 ", \"lost\": %" PRId64 ", \"skipped\": %" PRId64 ",\n\"round_trip_us\": {\"bins\": [",
           result.sent, result.lost, result.skipped);
    for (int i = 0; i < used; i++)
        printf("%s%" PRId64, i ? "," : "", result.bin[i]);
    printf("], \"over\": %" PRId64 ", \"max_ns\": %" PRId64 "}}\n", result.over, result.max_ns);
}

static int play(const struct lw_link *link, double rate_hz, double seconds)
{
    int64_t number = 0;
    if (!link->open(true))
        return EXIT_FAILURE;
    const bool realtime = go_realtime();
    if (!find_pong(link, &number)) {
        fprintf(stderr, "pingpong: no reply over %s\n", link->name);
        return EXIT_FAILURE;
    }
    ping(link, number, (int64_t)((double)LW_NS_PER_S / rate_hz), (int64_t)(seconds * (double)LW_NS_PER_S));
    print_result(link, rate_hz, realtime);
    return EXIT_SUCCESS;
}

// Pong's process: ends with its parent, whichever way that ends.
static void answer(const struct lw_link *link, pid_t parent)
{
    if (prctl(PR_SET_PDEATHSIG, SIGKILL) != 0 || getppid() != parent)
        _exit(EXIT_FAILURE);
    if (!link->open(false))
        _exit(EXIT_FAILURE);
    (void)go_realtime(); // ping asks for the same and says what it got
    pong(link);
}

static const struct lw_link *find_link(const char *name)
{
    static const struct lw_link *const links[] = {&lw_link_udp, &lw_link_lcm, &lw_link_own};
    for (size_t i = 0; i < sizeof links / sizeof links[0]; i++)
        if (strcmp(links[i]->name, name) == 0)
            return links[i];
    return NULL;
}

int main(int argc, char **argv)
{
    const struct lw_link *link = argc == 4 ? find_link(argv[1]) : NULL;
    const double rate_hz = argc == 4 ? strtod(argv[2], NULL) : 0, seconds = argc == 4 ? strtod(argv[3], NULL) : 0;
    if (link == NULL || !(rate_hz >= 1 && rate_hz <= 1e5) || !(seconds > 0 && seconds <= 1e4)) {
        fprintf(stderr, "usage: pingpong udp|lcm|own RATE_HZ SECONDS\n");
        return 2;
    }
    const pid_t self = getpid();
    // Fork before anything of LCM exists: its threads would not live in the child.
    const pid_t child = fork();
    if (child < 0) {
        perror("pingpong: fork");
        return EXIT_FAILURE;
    }
    if (child == 0)
        answer(link, self);
    const int status = play(link, rate_hz, seconds);
    kill(child, SIGKILL);
    (void)waitpid(child, NULL, 0);
    return status;
}
