// SPDX-License-Identifier: BSD-3-Clause
// One LCM channel on a socket of its own.
//
// Units    see datagram.h.
// Frames   none.
// Arrays   none.
// Memory   see datagram.h.
// Errors   see datagram.h.
#define _GNU_SOURCE // strerrordesc_np, struct ip_mreq
#include "bus/datagram.h"

#include <arpa/inet.h>  // inet_ntop
#include <errno.h>      // errno
#include <stdio.h>      // snprintf
#include <string.h>     // memcmp, strnlen, strerrordesc_np
#include <sys/socket.h> // socket, bind, recv
#include <sys/time.h>   // struct timeval
#include <time.h>       // struct timespec
#include <unistd.h>     // close

// A short message: magic, sequence number of its sender, channel with NUL, payload.
enum { MAGIC_BYTES = 4, HEADER_BYTES = 8, UDP_HEADER_BYTES = 8, WORD_BYTES = 4, MS_PER_S = 1000 };
static const unsigned char magic[MAGIC_BYTES] = {'L', 'C', '0', '2'};

// Bytes of a channel's name with its NUL; 0 when it is not 1..63 long.
static size_t name_bytes(const char *channel)
{
    const size_t length = strnlen(channel, LW_DATAGRAM_NAME);
    return length > 0 && length < LW_DATAGRAM_NAME ? length + 1 : 0;
}

// --- what a packet is ---

bool lw_datagram_parse(const void *packet, size_t size, const char *channel, const void **payload,
                       uint32_t *payload_size)
{
    const unsigned char *bytes = packet;
    const size_t name = name_bytes(channel), head = HEADER_BYTES + name;
    // Size before bytes; the NUL belongs to the name, so that a longer name differs.
    if (name == 0 || size < head || size > UINT16_MAX || memcmp(bytes, magic, sizeof magic) != 0 ||
        memcmp(bytes + HEADER_BYTES, channel, name) != 0)
        return false;
    *payload = bytes + head;
    *payload_size = (uint32_t)(size - head);
    return true;
}

// Loads `width` bytes (a word or one) and compares; a difference jumps to the last of the `left` instructions.
static int add_compare(struct sock_filter *out, size_t at, const unsigned char *expected, size_t width, int left)
{
    uint32_t value = 0;
    for (size_t i = 0; i < width; i++)
        value = value << 8 | expected[i];
    const uint16_t load = BPF_LD | BPF_ABS | (width == WORD_BYTES ? BPF_W : BPF_B);
    out[0] = (struct sock_filter){.code = load, .k = (uint32_t)at};
    out[1] = (struct sock_filter){.code = BPF_JMP | BPF_JEQ | BPF_K, .jf = (uint8_t)(left - 3), .k = value};
    return 2;
}

int lw_datagram_filter(const char *channel, struct sock_filter *out, int max)
{
    enum { KEEP_ALL = 0x40000 };
    const unsigned char *name = (const unsigned char *)channel;
    const size_t bytes = name_bytes(channel);
    const int compares = 1 + (int)(bytes / WORD_BYTES + bytes % WORD_BYTES), count = 2 * compares + 2;
    if (bytes == 0 || count > max)
        return 0;
    // A load beyond the packet's end drops it, so that the size needs no look.
    int n = add_compare(out, UDP_HEADER_BYTES, magic, sizeof magic, count);
    for (size_t at = 0, width; at < bytes; at += width) {
        width = bytes - at >= WORD_BYTES ? WORD_BYTES : 1;
        n += add_compare(out + n, UDP_HEADER_BYTES + HEADER_BYTES + at, name + at, width, count - n);
    }
    out[n] = (struct sock_filter){.code = BPF_RET | BPF_K, .k = KEEP_ALL};
    out[n + 1] = (struct sock_filter){.code = BPF_RET | BPF_K, .k = 0};
    return count;
}

// --- open ---

static bool set(int fd, int level, int option, const void *value, socklen_t size)
{
    return setsockopt(fd, level, option, value, size) == 0;
}

// Prepares the socket. Returns NULL, or what failed and what to do about it, with errno.
static const char *set_up(int fd, const struct sockaddr_in *group, const char *channel, int receive_bytes)
{
    const int on = 1;
    struct sock_filter code[LW_DATAGRAM_FILTER];
    const int count = lw_datagram_filter(channel, code, LW_DATAGRAM_FILTER);
    const struct sock_fprog program = {.len = (unsigned short)count, .filter = code};
    const struct ip_mreq membership = {.imr_multiaddr = group->sin_addr}; // interface: where the group is routed to
    // The filter comes before bind, so that nothing foreign is ever queued.
    if (!set(fd, SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof program))
        return "the kernel takes no socket filter; raise net.core.optmem_max";
    if (!set(fd, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on))
        return "the kernel does not tell when packets come";
    if (!set(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on))
        return "the port cannot be shared";
    if (receive_bytes > 0 && !set(fd, SOL_SOCKET, SO_RCVBUF, &receive_bytes, sizeof receive_bytes))
        return "the receive buffer cannot be sized";
    if (bind(fd, (const struct sockaddr *)(const void *)group, sizeof *group) != 0)
        return errno == EADDRINUSE ? "another program has the port for itself; end it or choose another port in the URL"
                                   : "the port cannot be used; choose another one in the URL";
    if (!set(fd, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership))
        return "no multicast route; for this host alone: "
               "sudo ip link set lo multicast on && sudo ip route add 224.0.0.0/4 dev lo";
    return NULL;
}

static enum lw_status check(const struct sockaddr_in *group, const char *channel, int receive_bytes,
                            struct lw_error *error)
{
    const char *wrong = NULL;
    if (group->sin_family != AF_INET || !IN_MULTICAST(ntohl(group->sin_addr.s_addr)) || group->sin_port == 0)
        wrong = "the address must be an IPv4 multicast group with a port";
    else if (name_bytes(channel) == 0)
        wrong = "a channel's name has 1 to 63 bytes";
    else if (receive_bytes < 0)
        wrong = "the receive buffer must be 0 bytes (the system's default) or more";
    if (wrong == NULL)
        return LW_OK;
    snprintf(error->text, sizeof error->text, "LCM channel \"%.63s\": %s", channel, wrong);
    return LW_E_ARGUMENT;
}

enum lw_status lw_datagram_open(struct lw_datagram *d, const struct sockaddr_in *group, const char *channel,
                                int receive_bytes, struct lw_error *error)
{
    const enum lw_status status = check(group, channel, receive_bytes, error);
    if (status != LW_OK)
        return status;
    const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    const char *wrong = fd < 0 ? "no socket to be had" : set_up(fd, group, channel, receive_bytes);
    if (wrong != NULL) {
        char host[INET_ADDRSTRLEN] = "?";
        snprintf(error->text, sizeof error->text, "LCM channel %s on %s:%d: %s (%s)", channel,
                 inet_ntop(AF_INET, &group->sin_addr, host, sizeof host), ntohs(group->sin_port), wrong,
                 strerrordesc_np(errno));
        if (fd >= 0)
            close(fd);
        return LW_E_BUS;
    }
    *d = (struct lw_datagram){.fd = fd, .timeout_ms = -1};
    memcpy(d->channel, channel, name_bytes(channel));
    return LW_OK;
}

void lw_datagram_close(struct lw_datagram *d)
{
    if (d->channel[0] != '\0')
        close(d->fd);
    d->channel[0] = '\0';
}

// --- receive ---

// The socket keeps its timeout: a caller that always waits as long pays for it once.
static bool keep_timeout(struct lw_datagram *d, int timeout_ms)
{
    if (timeout_ms == 0 || timeout_ms == d->timeout_ms || (timeout_ms < 0 && d->timeout_ms < 0))
        return true;
    struct timeval wait = {0}; // without end
    if (timeout_ms > 0)
        wait = (struct timeval){.tv_sec = timeout_ms / MS_PER_S, .tv_usec = timeout_ms % MS_PER_S * 1000L};
    if (!set(d->fd, SOL_SOCKET, SO_RCVTIMEO, &wait, sizeof wait))
        return false;
    d->timeout_ms = timeout_ms;
    return true;
}

// After a failed reception: 0 when the next one may succeed, -1 when it cannot.
static int after_error(struct lw_datagram *d)
{
    switch (errno) {
    case EAGAIN: // time is over
        d->errors_in_row = 0;
        return 0;
    case EINTR: return 0;
    case EBADF:
    case ENOTSOCK:
    case EINVAL:
    case EFAULT:
    case ENOTCONN: return -1;
    default: // an interface that went down, memory short for the moment: the kernel reports such a thing once
        d->errors++;
        return ++d->errors_in_row < LW_DATAGRAM_ERRORS ? 0 : -1;
    }
}

int64_t lw_datagram_arrival_ns(const struct lw_datagram *d)
{
    union {
        struct cmsghdr align;
        unsigned char bytes[CMSG_SPACE(sizeof(struct timespec))];
    } control;
    unsigned char first;
    struct iovec part = {.iov_base = &first, .iov_len = sizeof first};
    struct msghdr head = {.msg_iov = &part, .msg_iovlen = 1, .msg_control = &control, .msg_controllen = sizeof control};
    if (recvmsg(d->fd, &head, MSG_PEEK | MSG_DONTWAIT) <= 0)
        return 0;
    const struct cmsghdr *found = CMSG_FIRSTHDR(&head);
    struct timespec when = {0};
    if (found != NULL && found->cmsg_level == SOL_SOCKET && found->cmsg_type == SO_TIMESTAMPNS)
        memcpy(&when, CMSG_DATA(found), sizeof when);
    return when.tv_sec * INT64_C(1000000000) + when.tv_nsec;
}

int lw_datagram_receive(struct lw_datagram *d, int timeout_ms, const void **payload, uint32_t *size)
{
    if (!keep_timeout(d, timeout_ms))
        return -1;
    const ssize_t n = recv(d->fd, d->buffer, sizeof d->buffer, timeout_ms == 0 ? MSG_DONTWAIT : 0);
    if (n < 0)
        return after_error(d);
    // The filter lets no empty packet through: the socket was shut down.
    if (n == 0)
        return -1;
    d->errors_in_row = 0;
    if (lw_datagram_parse(d->buffer, (size_t)n, d->channel, payload, size))
        return 1;
    d->refused++;
    return 0;
}
