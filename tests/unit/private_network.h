// SPDX-License-Identifier: BSD-3-Clause
// A network of the test's own: nobody else's messages come in, and its interface may be broken and mended.
//
// Units    none.
// Frames   none.
// Arrays   none.
// Memory   stack.
// Errors   false with errno when the system forbids it.
#ifndef LW_TESTS_PRIVATE_NETWORK_H
#define LW_TESTS_PRIVATE_NETWORK_H

#include <arpa/inet.h>  // htonl
#include <net/if.h>     // struct ifreq
#include <net/route.h>  // struct rtentry
#include <sched.h>      // unshare
#include <stdbool.h>    // bool
#include <string.h>     // memcpy
#include <sys/ioctl.h>  // ioctl
#include <sys/socket.h> // socket
#include <unistd.h>     // close

static inline bool network_ioctl(unsigned long request, void *argument)
{
    const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    const bool ok = fd >= 0 && ioctl(fd, request, argument) == 0;
    if (fd >= 0)
        close(fd);
    return ok;
}

// Switches lo on, with multicast, or off; then its routes are gone too.
static inline bool network_set_lo(bool on)
{
    struct ifreq lo = {.ifr_name = "lo", .ifr_flags = (short)(IFF_LOOPBACK | IFF_MULTICAST | (on ? IFF_UP : 0))};
    return network_ioctl(SIOCSIFFLAGS, &lo);
}

// Sends multicast to lo.
static inline bool network_add_route(void)
{
    char device[] = "lo";
    const struct sockaddr_in group = {.sin_family = AF_INET, .sin_addr = {htonl(0xe0000000U)}};
    const struct sockaddr_in mask = {.sin_family = AF_INET, .sin_addr = {htonl(0xf0000000U)}};
    struct rtentry route = {.rt_flags = RTF_UP, .rt_dev = device};
    memcpy(&route.rt_dst, &group, sizeof group);
    memcpy(&route.rt_genmask, &mask, sizeof mask);
    return network_ioctl(SIOCADDRT, &route);
}

// Moves the process into a network of its own with multicast on lo. Call it before there are threads.
static inline bool network_enter(void)
{
    const bool entered = unshare(CLONE_NEWNET) == 0 || unshare(CLONE_NEWUSER | CLONE_NEWNET) == 0;
    return entered && network_set_lo(true) && network_add_route();
}

#endif
