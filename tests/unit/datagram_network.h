// SPDX-License-Identifier: BSD-3-Clause
// What the tests of the datagram beside LCM share: a private network, numbered messages said by LCM and heard by us.
// Define _GNU_SOURCE before all includes.
//
// Units    ms of timeouts.
// Frames   none.
// Arrays   none.
// Memory   stack.
// Errors   cmocka's.
#ifndef LW_TESTS_DATAGRAM_NETWORK_H
#define LW_TESTS_DATAGRAM_NETWORK_H

#include "bus/datagram.h"
#include "helpers.h"
#include "private_network.h"

#include <errno.h>   // errno
#include <lcm/lcm.h> // lcm_*
#include <string.h>  // strerrordesc_np

enum { PORT = 7667, SOON = 5000, SILENCE = 20 };

#define URL "udpm://239.255.76.67:7667?ttl=0"

// Runs in a network of the program's own, or says why that cannot be. Call it first in main.
static inline bool enter_network(const char *name)
{
    if (network_enter())
        return true;
    fprintf(stderr, "%s: SKIPPED, no network of its own: %s\n", name, strerrordesc_np(errno));
    return false;
}

static inline struct sockaddr_in group(void)
{
    return (struct sockaddr_in){
        .sin_family = AF_INET, .sin_port = htons(PORT), .sin_addr = {htonl(0xefff4c43U)}}; // 239.255.76.67
}

static inline void open_datagram(struct lw_datagram *d, const char *channel, int receive_bytes)
{
    const struct sockaddr_in address = group();
    struct lw_error error = {""};
    if (lw_datagram_open(d, &address, channel, receive_bytes, &error) != LW_OK)
        fail_msg("%s", error.text);
}

static inline lcm_t *open_lcm(void)
{
    lcm_t *lcm = lcm_create(URL);
    assert_non_null(lcm);
    return lcm;
}

static inline int publish(lcm_t *lcm, const char *channel, const void *data, unsigned size)
{
    return lcm_publish(lcm, channel, data, size);
}

// The next message's number, its first four bytes; -1 when none comes within the time.
static inline int hear(struct lw_datagram *d, int timeout_ms)
{
    const void *payload = NULL;
    uint32_t size = 0;
    int number = -1, heard = 0;
    do {
        const int64_t refused = d->refused;
        heard = lw_datagram_receive(d, timeout_ms, &payload, &size);
        if (heard == 0 && d->refused == refused)
            return -1;
    } while (heard == 0);
    assert_int_equal(heard, 1);
    assert_true(size >= sizeof number);
    memcpy(&number, payload, sizeof number);
    return number;
}

static inline void say(lcm_t *lcm, const char *channel, int number)
{
    unsigned char data[217] = {0};
    memcpy(data, &number, sizeof number);
    assert_int_equal(publish(lcm, channel, data, sizeof data), 0);
}

#endif
