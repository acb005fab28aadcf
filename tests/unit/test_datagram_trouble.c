// SPDX-License-Identifier: BSD-3-Clause
// Tests of the datagram in trouble, in a network of their own: an interface that goes and comes, errors, the end of a
// wait, and what cannot be opened.
//
// Units    ms of timeouts, bytes.
// Frames   none.
// Arrays   none.
// Memory   static.
// Errors   cmocka's; where the system allows no network of one's own, 77: skipped.
#define _GNU_SOURCE // unshare
#include "datagram_network.h"

#include <fcntl.h>    // fcntl
#include <linux/in.h> // IP_RECVERR
#include <pthread.h>  // pthread_create

// Off and on again: the wait goes on, and the group need not be joined anew.
static void an_interface_may_go_and_come(void **state)
{
    (void)state;
    static struct lw_datagram d;
    lcm_t *lcm = open_lcm();
    open_datagram(&d, "GOAL", 0);
    for (int i = 0; i < 3; i++) {
        say(lcm, "GOAL", i);
        assert_true(network_set_lo(false));
        unsigned char data[8] = {0};
        assert_int_equal(publish(lcm, "GOAL", data, sizeof data), -1);
        // What came before is still there; then there is silence, but no end.
        assert_int_equal(hear(&d, SOON), i);
        assert_int_equal(hear(&d, SILENCE), -1);
        assert_true(network_set_lo(true) && network_add_route());
        say(lcm, "GOAL", 100 + i);
        assert_int_equal(hear(&d, SOON), 100 + i);
    }
    lw_datagram_close(&d);
    lcm_destroy(lcm);
}

// A socket that does not share its port.
static int bound_socket(const struct sockaddr_in *address)
{
    const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (fd < 0 || bind(fd, (const struct sockaddr *)(const void *)address, sizeof *address) != 0)
        fail_msg("no socket: %s", strerrordesc_np(errno));
    return fd;
}

// A socket on lo that hears every sender and is told of errors.
static struct lw_datagram lo_datagram(const char *channel, struct sockaddr_in *address)
{
    const int on = 1;
    *address =
        (struct sockaddr_in){.sin_family = AF_INET, .sin_port = htons(PORT), .sin_addr = {htonl(INADDR_LOOPBACK)}};
    struct lw_datagram d = {.fd = bound_socket(address), .timeout_ms = -1};
    snprintf(d.channel, sizeof d.channel, "%s", channel);
    assert_int_equal(setsockopt(d.fd, IPPROTO_IP, IP_RECVERR, &on, sizeof on), 0);
    return d;
}

static void send_to(const struct lw_datagram *d, const struct sockaddr_in *address, const char *text, size_t size)
{
    assert_int_equal(sendto(d->fd, text, size, 0, (const struct sockaddr *)(const void *)address, sizeof *address),
                     size);
}

// A passing error (here: nobody has the port to which the socket sent) is counted and the next message heard. A hundred
// with nothing in between are no passing ones.
static void a_passing_error_is_counted(void **state)
{
    (void)state;
    static const char message[] = "LC02....GOAL\0abc";
    static struct lw_datagram d;
    struct sockaddr_in self, nobody;
    d = lo_datagram("GOAL", &self);
    nobody = self;
    nobody.sin_port = htons(9);
    // In between stands a message, later on a wait that ended by itself.
    for (int i = 1; i <= 3 * LW_DATAGRAM_ERRORS; i++) {
        const bool message_follows = i < 3 * LW_DATAGRAM_ERRORS / 2;
        send_to(&d, &nobody, "?", 1);
        assert_int_equal(hear(&d, SOON), -1);
        assert_int_equal(d.errors, i);
        if (message_follows)
            send_to(&d, &self, message, sizeof message);
        assert_int_equal(hear(&d, 0) >= 0, message_follows);
    }
    const void *payload = NULL;
    uint32_t size = 0;
    int result = 0, errors = 0;
    for (; errors < 2 * LW_DATAGRAM_ERRORS && result == 0; errors++) {
        send_to(&d, &nobody, "?", 1);
        result = lw_datagram_receive(&d, SOON, &payload, &size);
    }
    assert_int_equal(result, -1);
    assert_int_equal(errors, LW_DATAGRAM_ERRORS);
    lw_datagram_close(&d);
}

static void *wait_without_end(void *user)
{
    const void *payload = NULL;
    uint32_t size = 0;
    const int result = lw_datagram_receive(user, -1, &payload, &size);
    return result == -1 ? user : NULL;
}

// Shutting the socket down ends a wait without end in another thread.
static void a_wait_can_be_ended(void **state)
{
    (void)state;
    static struct lw_datagram d;
    pthread_t thread;
    void *ended = NULL;
    open_datagram(&d, "GOAL", 0);
    assert_int_equal(pthread_create(&thread, NULL, wait_without_end, &d), 0);
    // The call says that there is no peer, and wakes the reader all the same.
    assert_int_equal(shutdown(d.fd, SHUT_RD), -1);
    assert_int_equal(pthread_join(thread, &ended), 0);
    assert_ptr_equal(ended, &d);
    lw_datagram_close(&d);
}

// --- open ---

// Opening fails with a text that says `word`, leaves the struct alone and loses no file.
static void refuses(const struct sockaddr_in *address, const char *channel, int receive_bytes, enum lw_status expected,
                    const char *word)
{
    static struct lw_datagram d, before;
    struct lw_error error = {""};
    memset(&d, 0x5a, sizeof d);
    memset(&before, 0x5a, sizeof before);
    const int free_file = dup(0);
    close(free_file);
    assert_int_equal(lw_datagram_open(&d, address, channel, receive_bytes, &error), expected);
    const int still_free = dup(0);
    close(still_free);
    assert_int_equal(still_free, free_file);
    assert_same_bits(&d, &before, sizeof d);
    if (strstr(error.text, word) == NULL)
        fail_msg("\"%s\" lacks \"%s\"", error.text, word);
}

static void open_says_what_to_do(void **state)
{
    (void)state;
    const struct sockaddr_in good = group();
    struct sockaddr_in bad = good;
    refuses(&good, "", 0, LW_E_ARGUMENT, "1 to 63");
    refuses(&good, "0123456789012345678901234567890123456789012345678901234567890123", 0, LW_E_ARGUMENT, "1 to 63");
    refuses(&good, "GOAL", -1, LW_E_ARGUMENT, "receive buffer");
    bad.sin_port = 0;
    refuses(&bad, "GOAL", 0, LW_E_ARGUMENT, "multicast group");
    bad = good;
    bad.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    refuses(&bad, "GOAL", 0, LW_E_ARGUMENT, "multicast group");
    bad = good;
    bad.sin_family = AF_INET6;
    refuses(&bad, "GOAL", 0, LW_E_ARGUMENT, "multicast group");
    // A program that does not share the port.
    const int selfish = bound_socket(&good);
    refuses(&good, "GOAL", 0, LW_E_BUS, "another program has the port");
    close(selfish);
    // No route.
    assert_true(network_set_lo(false));
    refuses(&good, "GOAL", 0, LW_E_BUS, "ip route add 224.0.0.0/4 dev lo");
    refuses(&good, "GOAL", 0, LW_E_BUS, "GOAL on 239.255.76.67:7667");
    assert_true(network_set_lo(true) && network_add_route());
}

// The socket is not inherited by programs that are started, and has the buffer asked for.
static void the_socket_is_as_asked(void **state)
{
    (void)state;
    static struct lw_datagram d;
    int bytes[2] = {0};
    static const int asked[] = {16384, 65536};
    for (int i = 0; i < 2; i++) {
        socklen_t size = sizeof bytes[i];
        open_datagram(&d, "GOAL", asked[i]);
        assert_true(fcntl(d.fd, F_GETFD) & FD_CLOEXEC);
        assert_int_equal(getsockopt(d.fd, SOL_SOCKET, SO_RCVBUF, &bytes[i], &size), 0);
        assert_true(bytes[i] >= asked[i]);
        lw_datagram_close(&d);
    }
    assert_true(bytes[0] < bytes[1]);
}

int main(void)
{
    if (!enter_network("datagram_trouble"))
        return 77;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_interface_may_go_and_come), cmocka_unit_test(a_passing_error_is_counted),
        cmocka_unit_test(a_wait_can_be_ended),          cmocka_unit_test(open_says_what_to_do),
        cmocka_unit_test(the_socket_is_as_asked),
    };
    return cmocka_run_group_tests_name("datagram_trouble", tests, NULL, NULL);
}
