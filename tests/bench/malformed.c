// SPDX-License-Identifier: BSD-3-Clause
// malformed KIND COUNT SEED PLANT_SESSION CONTROLLER_SESSION: sends that many malformed packets to LCM's default bus,
// as fast as those who listen there can take them, and prints {"sent": ..., "seconds": ...}. Without arguments it lists
// the kinds.
//
// Units    ns, bytes.
// Frames   none.
// Arrays   none.
// Memory   static.
// Errors   exit status 0 ok, 1 failed, 2 usage.
#include "malformed.h"

#include "base/clock.h" // lw_clock_*

#include <arpa/inet.h>  // inet_addr
#include <inttypes.h>   // strtoimax
#include <stdbool.h>    // bool
#include <stdio.h>      // printf
#include <stdlib.h>     // EXIT_FAILURE
#include <string.h>     // strcmp
#include <sys/socket.h> // sendto

enum { PORT = 7667, SOCKETS = 24, ARGUMENTS = 5, LOOK_EVERY = 8, QUEUE_BYTES = 100000, PACKETS_PER_SOCKET = 6 };
static const int64_t patience_ns = 30 * LW_NS_PER_S, rest_ns = 100000;

const struct malformed_kind malformed_kinds[] = {
    {"noise", make_noise, "random bytes"},
    {"noise-behind-magic", make_noise_behind_magic, "random bytes that look like a message of LCM at first"},
    {"no-nul", make_no_nul, "a channel's name that does not end"},
    {"long-name", make_long_name, "names of 62 to 200 bytes"},
    {"new-name", make_new_name, "a channel that nobody has heard of, another one each time"},
    {"truncated", make_truncated, "messages cut short"},
    {"overlong", make_overlong, "bytes behind a message"},
    {"other-type", make_other_type, "a wrong fingerprint, or a message of another channel"},
    {"not-finite", make_not_finite, "NaN and infinity"},
    {"huge", make_huge, "finite values beyond every range"},
    {"count", make_count, "obstacle counts that lie, ids that are none or stand twice"},
    {"out-of-range", make_out_of_range, "sessions, numbers, modes and times outside their range"},
    {"foreign", make_foreign, "well-formed states and commands of senders without a say"},
    {"damaged", make_damaged, "the same with some bytes changed"},
    {"short-fragment", make_short_fragment, "a fragment cut in its header"},
    {"wrapping-fragment", make_wrapping_fragment, "offset and size beyond 2^32"},
    {"zero-fragment", make_zero_fragment, "no fragments, or no bytes"},
    {"headless-fragment", make_headless_fragment, "messages whose first fragment never comes"},
    {"huge-fragment", make_huge_fragment, "the first fragment of 1 MB to 4 GB"},
    {"misplaced-fragment", make_misplaced_fragment, "a fragment outside its message"},
    {"bodiless-fragment", make_bodiless_fragment, "a first fragment that ends before its channel does"},
    {"duplicated-fragment", make_duplicated_fragment, "a fragment twice: delivered with a hole"},
    {"mix", make_mix, "any of the kinds above"},
    {0}};

void make_mix(struct malformer *m, struct packet *out)
{
    const int all = (int)(sizeof malformed_kinds / sizeof malformed_kinds[0]) - 2; // neither mix nor the end
    // One kind for as long as one sender sends: some consist of several packets.
    if (m->made % PACKETS_PER_SOCKET == 0)
        m->chosen = random_below(&m->random, all);
    malformed_kinds[m->chosen].make(m, out);
}

// --- the pace ---

// The hexadecimal number behind one of a line's colons, counted from 0; 0 when there is none.
static unsigned long behind_colon(const char *line, int colon)
{
    for (; line != NULL && colon >= 0; colon--) {
        line = strchr(line, ':');
        line = line != NULL ? line + 1 : NULL;
    }
    return line != NULL ? strtoul(line, NULL, 16) : 0;
}

// Bytes that the slowest listener has not read yet.
static unsigned long longest_queue(void)
{
    FILE *file = fopen("/proc/net/udp", "r");
    unsigned long longest = 0;
    char line[256];
    while (file != NULL && fgets(line, sizeof line, file) != NULL) {
        // number: local address:port, remote address:port, state, send queue:receive queue
        const unsigned long port = behind_colon(line, 1), queue = behind_colon(line, 3);
        if (port == PORT && queue > longest)
            longest = queue;
    }
    if (file != NULL)
        (void)fclose(file); // it was only read
    return longest;
}

// Waits until every listener has room. False when one has stopped reading.
static bool wait_for_room(void)
{
    const int64_t end_ns = lw_clock_mono_ns() + patience_ns;
    while (longest_queue() > QUEUE_BYTES) {
        if (lw_clock_mono_ns() > end_ns)
            return false;
        lw_clock_sleep_until(lw_clock_mono_ns() + rest_ns);
    }
    return true;
}

// --- sending ---

struct attack {
    int socket[SOCKETS]; // senders of their own, between which LCM tells fragments apart
    struct sockaddr_in group;
    struct malformer malformer;
    const struct malformed_kind *kind;
};

static bool send_one(struct attack *a)
{
    static struct packet packet;
    struct malformer *m = &a->malformer;
    a->kind->make(m, &packet);
    const int from = a->socket[m->made / PACKETS_PER_SOCKET % SOCKETS];
    m->made++;
    const struct sockaddr *to = (const struct sockaddr *)(const void *)&a->group;
    return sendto(from, packet.bytes, packet.size, 0, to, sizeof a->group) == (ssize_t)packet.size;
}

static bool run(struct attack *a, int64_t count)
{
    for (int64_t sent = 0; sent < count; sent++) {
        if (sent % LOOK_EVERY == 0 && !wait_for_room()) {
            fprintf(stderr, "malformed: a listener has stopped reading\n");
            return false;
        }
        if (!send_one(a)) {
            perror("malformed");
            return false;
        }
    }
    return wait_for_room();
}

static bool open_sockets(struct attack *a)
{
    a->group = (struct sockaddr_in){.sin_family = AF_INET, .sin_port = htons(PORT)};
    a->group.sin_addr.s_addr = inet_addr("239.255.76.67");
    for (int i = 0; i < SOCKETS; i++) {
        a->socket[i] = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
        if (a->socket[i] < 0)
            return false;
    }
    return true;
}

static const struct malformed_kind *find_kind(const char *name)
{
    const struct malformed_kind *kind = malformed_kinds;
    while (kind->name != NULL && strcmp(kind->name, name) != 0)
        kind++;
    return kind->name != NULL ? kind : NULL;
}

static int usage(void)
{
    fprintf(stderr, "usage: malformed KIND COUNT SEED PLANT_SESSION CONTROLLER_SESSION\nkinds:\n");
    for (const struct malformed_kind *kind = malformed_kinds; kind->name != NULL; kind++)
        fprintf(stderr, "  %-20s %s\n", kind->name, kind->what);
    return 2;
}

int main(int argc, char **argv)
{
    static struct attack attack;
    if (argc != 1 + ARGUMENTS)
        return usage();
    const int64_t count = strtoimax(argv[2], NULL, 10);
    attack.kind = find_kind(argv[1]);
    attack.malformer.random.state = (uint64_t)strtoimax(argv[3], NULL, 10) + 1;
    attack.malformer.plant_session = strtoimax(argv[4], NULL, 10);
    attack.malformer.controller_session = strtoimax(argv[5], NULL, 10);
    if (attack.kind == NULL || count < 1)
        return usage();
    const int64_t start_ns = lw_clock_mono_ns();
    if (!open_sockets(&attack) || !run(&attack, count))
        return EXIT_FAILURE;
    printf("{\"sent\": %" PRId64 ", \"seconds\": %.3f}\n", count,
           (double)(lw_clock_mono_ns() - start_ns) / (double)LW_NS_PER_S);
    return EXIT_SUCCESS;
}
