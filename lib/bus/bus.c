// SPDX-License-Identifier: BSD-3-Clause
// The only code that talks to LCM.
//
// Units    ms for timeouts.
// Frames   none.
// Arrays   none.
// Memory   see bus.h.
// Errors   see bus.h.
#define _GNU_SOURCE         // strerrordesc_np
#include "bus/connection.h" // struct lw_bus

#include "base/build.h" // LW_BUILD
#include "base/clock.h" // lw_clock_mono_ns, lw_clock_utime

#include <arpa/inet.h>  // inet_pton
#include <errno.h>      // errno
#include <poll.h>       // poll
#include <stddef.h>     // ptrdiff_t
#include <stdlib.h>     // calloc, getenv
#include <string.h>     // strerrordesc_np
#include <sys/socket.h> // socket, connect
#include <unistd.h>     // close

enum { QUEUE_CAPACITY = 64, RECEIVE_BYTES = 2097152 };

static const char default_url[] = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=2097152";

// --- open ---

// Splits udpm://ADDRESS:PORT. Returns whether the URL is of that form.
static bool parse_url(const char *url, struct sockaddr_in *address)
{
    static const char scheme[] = "udpm://";
    char host[INET_ADDRSTRLEN];
    if (strncmp(url, scheme, sizeof scheme - 1) != 0)
        return false;
    const char *start = url + sizeof scheme - 1;
    const char *colon = strchr(start, ':');
    if (colon == NULL || colon - start >= (ptrdiff_t)sizeof host)
        return false;
    snprintf(host, sizeof host, "%.*s", (int)(colon - start), start);
    const unsigned long port = strtoul(colon + 1, NULL, 10);
    *address = (struct sockaddr_in){.sin_family = AF_INET, .sin_port = htons((uint16_t)port)};
    return port > 0 && port <= UINT16_MAX && inet_pton(AF_INET, host, &address->sin_addr) == 1 &&
           IN_MULTICAST(ntohl(address->sin_addr.s_addr));
}

// Asks the kernel for a route before LCM does, which would print a page of its own.
static bool has_route(const struct sockaddr_in *address)
{
    const int fd = socket(AF_INET, SOCK_DGRAM, 0);
    if (fd < 0)
        return false;
    const bool ok = connect(fd, (const struct sockaddr *)(const void *)address, sizeof *address) == 0;
    const int problem = errno;
    close(fd);
    errno = problem;
    return ok;
}

static enum lw_status check_url(const char *url, struct sockaddr_in *address, struct lw_error *error)
{
    if (!parse_url(url, address)) {
        snprintf(error->text, sizeof error->text,
                 "LCM URL: expected udpm://GROUP:PORT?ttl=N with a multicast group, as in %s, found \"%.100s\"",
                 default_url, url);
        return LW_E_BUS;
    }
    if (!has_route(address)) {
        snprintf(error->text, sizeof error->text,
                 "no multicast route for %.60s (%s); for this host alone: "
                 "sudo ip link set lo multicast on && sudo ip route add 224.0.0.0/4 dev lo",
                 url, strerrordesc_np(errno));
        return LW_E_BUS;
    }
    return LW_OK;
}

static void name_channels(struct lw_bus *bus, const char *name)
{
    if (name != NULL && name[0] != '\0')
        snprintf(bus->name, sizeof bus->name, "%.30s_", name);
    for (int c = 0; c < LW_CHANNEL_COUNT; c++)
        snprintf(bus->channel_name[c], LW_CHANNEL_NAME_MAX, "%s%s",
                 lw_wire_is_shared((enum lw_channel)c) ? "" : bus->name, lw_wire_channel_name((enum lw_channel)c));
    snprintf(bus->scene_channel, LW_CHANNEL_NAME_MAX, "%sSCENE", bus->name);
}

enum lw_status lw_bus_open(const struct lw_bus_config *config, struct lw_bus **out, struct lw_error *error)
{
    const char *from_environment = getenv("LCM_DEFAULT_URL"); // NOLINT(concurrency-mt-unsafe): nobody sets it
    const char *url = config->url ? config->url : from_environment ? from_environment : default_url;
    struct sockaddr_in group;
    const enum lw_status status = check_url(url, &group, error);
    if (status != LW_OK)
        return status;
    struct lw_bus *bus = calloc(1, sizeof *bus);
    if (bus != NULL && !config->own_socket)
        bus->lcm = lcm_create(url);
    if (bus == NULL || (bus->lcm == NULL && !config->own_socket)) {
        snprintf(error->text, sizeof error->text, "LCM cannot open %.200s", url);
        free(bus);
        return LW_E_BUS;
    }
    bus->group = group;
    bus->session = config->session;
    bus->refusals = config->refusals;
    name_channels(bus, config->name);
    // LCM computes each fingerprint on first use, without a lock: do it before threads start.
    for (int c = 0; c < LW_CHANNEL_COUNT; c++)
        (void)lw_wire_fingerprint((enum lw_channel)c);
    *out = bus;
    return LW_OK;
}

void lw_bus_close(struct lw_bus *bus)
{
    if (bus == NULL)
        return;
    if (bus->lcm != NULL)
        lcm_destroy(bus->lcm);
    for (int c = 0; c < LW_CHANNEL_COUNT; c++)
        lw_datagram_close(&bus->datagram[c]);
    free(bus);
}

// --- receive ---

static void deliver(const struct lw_subscription *s, const void *data, uint32_t size)
{
    union lw_message message;
    const enum lw_status status = lw_wire_decode(s->channel, data, size, &message);
    if (lw_refusals_note(s->bus->refusals, lw_verdict_of(status)))
        s->handler(s->user, s->channel, &message);
}

// Own raw handler: LCM's generated one prints a line for every malformed message and counts nothing.
static void handle_raw(const lcm_recv_buf_t *buf, const char *channel, void *user)
{
    (void)channel;
    deliver(user, buf->data, buf->data_size);
}

enum lw_status lw_bus_subscribe(struct lw_bus *bus, enum lw_channel channel, lw_bus_handler handler, void *user,
                                struct lw_error *error)
{
    struct lw_subscription *s = &bus->subscription[channel];
    *s = (struct lw_subscription){.bus = bus, .channel = channel, .handler = handler, .user = user};
    if (bus->lcm == NULL)
        return lw_datagram_open(&bus->datagram[channel], &bus->group, bus->channel_name[channel], RECEIVE_BYTES, error);
    lcm_subscription_t *made = lcm_subscribe(bus->lcm, bus->channel_name[channel], handle_raw, s);
    if (made == NULL) {
        snprintf(error->text, sizeof error->text,
                 "the bus does not hear its own messages: multicast is blocked on this host (firewall, or lo without "
                 "multicast: sudo ip link set lo multicast on)");
        return LW_E_BUS;
    }
    // When a queue is full LCM drops the newest message: keep it long and drain it.
    lcm_subscription_set_queue_capacity(made, QUEUE_CAPACITY);
    return LW_OK;
}

// One message at most: the socket itself is the queue.
static bool take(struct lw_bus *bus, enum lw_channel channel, int timeout_ms)
{
    const void *data = NULL;
    uint32_t size = 0;
    const int got = lw_datagram_receive(&bus->datagram[channel], timeout_ms, &data, &size);
    if (got > 0)
        deliver(&bus->subscription[channel], data, size);
    return got >= 0;
}

// Obstacles and hulls of a sender belong together: what came first goes first.
static void keep_order(const struct lw_bus *bus, bool ready[LW_CHANNEL_COUNT])
{
    enum { A = LW_CHANNEL_OBSTACLES, B = LW_CHANNEL_HULL };
    if (ready[A] && ready[B])
        ready[lw_datagram_arrival_ns(&bus->datagram[A]) < lw_datagram_arrival_ns(&bus->datagram[B]) ? B : A] = false;
}

// One message of each channel at most, so that a flood on one does not keep the others waiting.
static bool handle_datagrams(struct lw_bus *bus, int timeout_ms)
{
    struct pollfd wait[LW_CHANNEL_COUNT];
    enum lw_channel channel[LW_CHANNEL_COUNT];
    nfds_t n = 0;
    for (int c = 0; c < LW_CHANNEL_COUNT; c++)
        if (bus->subscription[c].handler != NULL) {
            wait[n] = (struct pollfd){.fd = bus->datagram[c].fd, .events = POLLIN};
            channel[n++] = (enum lw_channel)c;
        }
    // A single socket waits by itself: one system call a message.
    if (n == 1)
        return take(bus, channel[0], timeout_ms);
    const int ready = poll(wait, n, timeout_ms);
    bool ok = ready >= 0 || errno == EINTR; // a signal only ends the wait
    bool waits[LW_CHANNEL_COUNT] = {false};
    for (nfds_t i = 0; ready > 0 && i < n; i++)
        waits[channel[i]] = wait[i].revents != 0;
    keep_order(bus, waits);
    for (nfds_t i = 0; i < n; i++)
        if (waits[channel[i]])
            ok &= take(bus, channel[i], 0);
    return ok;
}

bool lw_bus_handle(struct lw_bus *bus, int timeout_ms)
{
    if (bus->lcm == NULL)
        return handle_datagrams(bus, timeout_ms);
    int handled = lcm_handle_timeout(bus->lcm, timeout_ms);
    while (handled > 0)
        handled = lcm_handle_timeout(bus->lcm, 0);
    return handled == 0 || errno == EINTR; // a signal only ends the wait
}

// --- publish ---

static struct lw_stamp make_stamp(const struct lw_bus *bus, int64_t seq)
{
    return (struct lw_stamp){
        .utime = lw_clock_utime(), .mono_ns = lw_clock_mono_ns(), .session = bus->session, .seq = seq};
}

enum lw_status lw_bus_publish(struct lw_bus *bus, enum lw_channel channel, union lw_message *message)
{
    if (bus->lcm == NULL)
        return LW_E_BUS;
    message->stamp = make_stamp(bus, ++bus->seq[channel]);
    const uint32_t size = lw_wire_encode(channel, message, bus->buffer);
    return lcm_publish(bus->lcm, bus->channel_name[channel], bus->buffer, size) == 0 ? LW_OK : LW_E_BUS;
}

// LCM's strings are not const though encoding only reads them.
static char *unconst(const char *text)
{
    char *out;
    memcpy((void *)&out, (const void *)&text, sizeof out);
    return out;
}

leeway_scene_t lw_bus_scene_wire(struct lw_bus *bus, const struct lw_bus_scene *scene)
{
    const struct lw_stamp stamp = make_stamp(bus, ++bus->scene_seq);
    leeway_scene_t w = {.h = {stamp.utime, stamp.mono_ns, stamp.session, stamp.seq}};
    w.program = unconst(scene->program);
    w.build = unconst(LW_BUILD);
    w.mode = unconst(scene->mode);
    w.file = unconst(scene->file);
    w.yaml = unconst(scene->yaml);
    return w;
}

enum lw_status lw_bus_publish_scene(struct lw_bus *bus, const struct lw_bus_scene *scene)
{
    const leeway_scene_t w = lw_bus_scene_wire(bus, scene);
    return leeway_scene_t_publish(bus->lcm, bus->scene_channel, &w) == 0 ? LW_OK : LW_E_BUS;
}
