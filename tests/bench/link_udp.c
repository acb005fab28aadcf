// SPDX-License-Identifier: BSD-3-Clause
// Bare UDP multicast: what any bus on multicast has to pay. Two ports of LCM's group, one a direction.
//
// Units    none.
// Frames   none.
// Arrays   none.
// Memory   static.
// Errors   see link.h.
#define _GNU_SOURCE // struct ip_mreq
#include "link.h"

#include "bus/wire.h" // LW_WIRE_MAX

#include <arpa/inet.h>  // htons, inet_addr
#include <stdio.h>      // perror
#include <string.h>     // memcpy
#include <sys/socket.h> // socket, bind, connect
#include <sys/time.h>   // struct timeval
#include <unistd.h>     // close

// LCM's default group; the ports next to its own, which the flood fills.
static const char group[] = "239.255.76.67";
enum { PORT_THERE = 7668, PORT_BACK = 7669, DATAGRAM_MAX = LW_WIRE_MAX + 64 };

static struct {
    int in, out;
    size_t bytes;
    unsigned char sent[DATAGRAM_MAX], heard[DATAGRAM_MAX];
} end;

static struct sockaddr_in address_of(uint16_t port)
{
    return (struct sockaddr_in){.sin_family = AF_INET, .sin_port = htons(port), .sin_addr.s_addr = inet_addr(group)};
}

static bool set(int fd, int level, int option, const void *value, size_t size)
{
    return setsockopt(fd, level, option, value, (socklen_t)size) == 0;
}

// Socket that hears a port of the group.
static int open_in(uint16_t port)
{
    const struct sockaddr_in address = address_of(port);
    const struct ip_mreq membership = {.imr_multiaddr = address.sin_addr};
    const struct timeval timeout = {.tv_usec = LW_LINK_TIMEOUT_MS * 1000};
    const int one = 1, fd = socket(AF_INET, SOCK_DGRAM, 0);
    if (fd >= 0 && set(fd, SOL_SOCKET, SO_REUSEADDR, &one, sizeof one) &&
        bind(fd, (const struct sockaddr *)(const void *)&address, sizeof address) == 0 &&
        set(fd, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership) &&
        set(fd, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout))
        return fd;
    perror("pingpong: cannot hear UDP multicast");
    if (fd >= 0)
        close(fd);
    return -1;
}

// Socket that sends to a port of the group, to this host alone.
static int open_out(uint16_t port)
{
    const struct sockaddr_in address = address_of(port);
    const unsigned char ttl = 0;
    const int fd = socket(AF_INET, SOCK_DGRAM, 0);
    if (fd >= 0 && set(fd, IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl) &&
        connect(fd, (const struct sockaddr *)(const void *)&address, sizeof address) == 0)
        return fd;
    perror("pingpong: cannot send UDP multicast");
    if (fd >= 0)
        close(fd);
    return -1;
}

static bool open_udp(bool is_ping)
{
    end.bytes = lw_link_bytes(is_ping);
    end.in = open_in(is_ping ? PORT_BACK : PORT_THERE);
    end.out = open_out(is_ping ? PORT_THERE : PORT_BACK);
    return end.in >= 0 && end.out >= 0;
}

static bool send_udp(int64_t number)
{
    memcpy(end.sent, &number, sizeof number);
    return send(end.out, end.sent, end.bytes, 0) == (ssize_t)end.bytes;
}

static bool receive_udp(int64_t *number)
{
    if (recv(end.in, end.heard, sizeof end.heard, 0) < (ssize_t)sizeof *number)
        return false;
    memcpy(number, end.heard, sizeof *number);
    return true;
}

const struct lw_link lw_link_udp = {"udp", open_udp, send_udp, receive_udp};
