// SPDX-License-Identifier: BSD-3-Clause
// flood RATE [CHANNEL]: full OBSTACLES messages at a rate, until a signal; on the channel FLOOD, which nobody wants, or
// on another, where each is a new change of the world. Every 100 ms it prints one line: CLOCK_MONOTONIC in ns, and how
// many it has sent.
//
// Units    ns.
// Frames   none.
// Arrays   none.
// Memory   static, and LCM's.
// Errors   exit status 0 ok, 1 failed, 2 usage.
#include "base/clock.h" // lw_clock_*
#include "base/stop.h"  // lw_stop_install
#include "bus/wire.h"   // lw_wire_encode

#include <inttypes.h> // PRId64
#include <lcm/lcm.h>  // lcm_publish
#include <stdbool.h>  // bool
#include <stdio.h>    // printf
#include <stdlib.h>   // strtod
#include <string.h>   // memcpy

// Small batches: a big one would stop the world for as long as it takes. What it falls behind by more than
// BACKLOG_NS is given up, so that it never makes up for seconds at a higher rate.
static const int64_t batch_ns = 500000, backlog_ns = 10000000, print_ns = 100000000;

struct flood {
    lcm_t *lcm;
    unsigned char message[LW_WIRE_MAX];
    uint32_t size;
    const char *channel;
    double rate;
    int64_t sent;
};

// The largest message there is: every place for an obstacle taken.
static void fill(struct flood *flood)
{
    union lw_message message = {.obstacles = {.op = LW_UPSERT, .count = LW_CHANGE_MAX}};
    message.stamp = (struct lw_stamp){.utime = lw_clock_utime(), .session = lw_clock_session(), .seq = 1};
    for (int i = 0; i < LW_CHANGE_MAX; i++)
        message.obstacles.obstacle[i] = (struct lw_obstacle){.id = i + 1, .p = {20, 2, 3}, .quat = {1}, .radius = 0.1};
    flood->size = lw_wire_encode(LW_CHANNEL_OBSTACLES, &message, flood->message);
}

// The number in the header, and the last bits of a place: no message is a repetition.
static void count(struct flood *flood)
{
    enum { PLACE_OF_SEQ = 8 + 3 * 8, PLACE_OF_P = 70 };
    for (int i = 0; i < 8; i++)
        flood->message[PLACE_OF_SEQ + i] = (unsigned char)((flood->sent + 1) >> (8 * (7 - i)));
    memcpy(flood->message + PLACE_OF_P + 4, flood->message + PLACE_OF_SEQ + 4, 4);
}

// Sends what is due. False when the bus refuses.
static bool send_until(struct flood *flood, int64_t due)
{
    for (; flood->sent < due; flood->sent++) {
        count(flood);
        if (lcm_publish(flood->lcm, flood->channel, flood->message, flood->size) != 0)
            return false;
    }
    return true;
}

// Sends until a signal comes. False when the bus refuses.
static bool run(struct flood *flood)
{
    const double per_ns = flood->rate / (double)LW_NS_PER_S;
    int64_t deadline_ns = lw_clock_mono_ns(), line_ns = 0, start_ns = deadline_ns;
    bool ok = true;
    while (ok && lw_stop_signal() == 0) {
        const int64_t now_ns = lw_clock_mono_ns();
        if (now_ns >= line_ns) {
            ok = printf("%" PRId64 " %" PRId64 "\n", now_ns, flood->sent) > 0 && fflush(stdout) == 0;
            line_ns = now_ns + print_ns;
        }
        const int64_t behind_ns = now_ns - start_ns - (int64_t)((double)flood->sent / per_ns);
        if (behind_ns > backlog_ns)
            start_ns += behind_ns - backlog_ns;
        ok = ok && send_until(flood, (int64_t)((double)(now_ns - start_ns) * per_ns));
        deadline_ns += batch_ns;
        if (deadline_ns < lw_clock_mono_ns())
            deadline_ns = lw_clock_mono_ns();
        lw_clock_sleep_until(deadline_ns);
    }
    return ok;
}

int main(int argc, char **argv)
{
    static struct flood flood;
    flood.rate = argc == 2 || argc == 3 ? strtod(argv[1], NULL) : 0;
    flood.channel = argc == 3 ? argv[2] : "FLOOD";
    if (!(flood.rate >= 1 && flood.rate <= 1e7)) {
        fprintf(stderr, "usage: flood MESSAGES_PER_SECOND [CHANNEL]\n");
        return 2;
    }
    lw_stop_install();
    flood.lcm = lcm_create(NULL);
    if (flood.lcm == NULL) {
        fprintf(stderr, "flood: LCM cannot open the bus\n");
        return EXIT_FAILURE;
    }
    fill(&flood);
    const bool ok = run(&flood);
    lcm_destroy(flood.lcm);
    if (!ok)
        perror("flood");
    return ok ? EXIT_SUCCESS : EXIT_FAILURE;
}
