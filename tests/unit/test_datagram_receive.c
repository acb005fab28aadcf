// SPDX-License-Identifier: BSD-3-Clause
// Tests of reception on a pair of Unix sockets: messages, waits, signals, dead sockets. No network, no filter.
//
// Units    ns of the clock, ms of timeouts.
// Frames   none.
// Arrays   none.
// Memory   static.
// Errors   cmocka's.
#define _GNU_SOURCE // setitimer
#include "base/clock.h"
#include "bus/datagram.h"
#include "datagram_packets.h"

#include <fcntl.h>      // fcntl, open
#include <signal.h>     // sigaction
#include <sys/socket.h> // socketpair
#include <sys/time.h>   // setitimer
#include <unistd.h>     // close, pipe

struct line {
    struct lw_datagram d;
    int in;
};

static void start_line(struct line *line, const char *channel)
{
    int pair[2];
    assert_int_equal(socketpair(AF_UNIX, SOCK_DGRAM, 0, pair), 0);
    line->in = pair[0];
    line->d = (struct lw_datagram){.fd = pair[1], .timeout_ms = -1};
    memcpy(line->d.channel, channel, strlen(channel) + 1);
}

static void stop_line(struct line *line)
{
    close(line->in);
    lw_datagram_close(&line->d);
}

static void say(const struct line *line, const struct packet *p)
{
    assert_int_equal(send(line->in, p->bytes, p->size, 0), p->size);
}

static int hear(struct line *line, int timeout_ms)
{
    const void *payload = NULL;
    uint32_t size = 0;
    return lw_datagram_receive(&line->d, timeout_ms, &payload, &size);
}

// Payloads come whole and in order; what is not of the channel is counted and does not stand in the way.
static void messages_come_whole_and_in_order(void **state)
{
    (void)state;
    struct random random = {7};
    static struct line line;
    start_line(&line, "JOINT_STATE");
    for (int i = 0; i < 1000; i++) {
        const struct packet foreign = make_packet(&random, "JOINT_STATES", 20);
        const struct packet first = make_packet(&random, "JOINT_STATE", (size_t)random_below(&random, 300));
        const struct packet second = make_packet(&random, "JOINT_STATE", LW_WIRE_MAX);
        const struct packet *const sent[] = {&first, &second};
        say(&line, &first);
        say(&line, &foreign);
        say(&line, &second);
        for (int k = 0; k < 2; k++) {
            const void *payload = NULL;
            uint32_t size = 0;
            int heard = 0;
            for (int tries = 0; tries < 2 && heard == 0; tries++)
                heard = lw_datagram_receive(&line.d, k == 0 ? 1000 : 0, &payload, &size);
            assert_int_equal(heard, 1);
            assert_int_equal(size, sent[k]->size - HEAD - sizeof "JOINT_STATE");
            assert_memory_equal(payload, sent[k]->bytes + HEAD + sizeof "JOINT_STATE", size);
        }
        assert_int_equal(line.d.refused, i + 1);
    }
    assert_int_equal(line.d.errors, 0);
    stop_line(&line);
}

// A message that was cut does not look like a shorter one: decoding sees a size that no message has.
static void a_cut_message_is_too_long_for_any_type(void **state)
{
    (void)state;
    struct random random = {8};
    const char *const names[] = {"A", "JOINT_STATE", NAME_63};
    for (size_t n = 0; n < sizeof names / sizeof names[0]; n++) {
        static struct line line;
        start_line(&line, names[n]);
        for (size_t payload = LW_WIRE_MAX + 1; payload < PACKET_MAX - 100; payload += 50) {
            const struct packet p = make_packet(&random, names[n], payload);
            const void *at = NULL;
            uint32_t size = 0;
            say(&line, &p);
            assert_int_equal(lw_datagram_receive(&line.d, 0, &at, &size), 1);
            assert_true(size > LW_WIRE_MAX && size <= payload);
            const unsigned char *end = (const unsigned char *)at + size;
            assert_true(end <= line.d.buffer + sizeof line.d.buffer);
        }
        stop_line(&line);
    }
}

// With nothing to hear a wait takes its time, not less, and each call's own time, whatever the call before it had.
static void a_wait_takes_its_time(void **state)
{
    (void)state;
    struct random random = {9};
    static struct line line;
    start_line(&line, "GOAL");
    const struct packet p = make_packet(&random, "GOAL", 20);
    static const int waits[] = {20, 20, 7, 40, 1};
    for (size_t i = 0; i < sizeof waits / sizeof waits[0]; i++) {
        const int64_t start = lw_clock_mono_ns();
        assert_int_equal(hear(&line, waits[i]), 0);
        assert_true(lw_clock_mono_ns() - start >= waits[i] * INT64_C(1000000));
    }
    // A long wait, or one without end, that finds a message at once, and then short ones.
    for (int before = -1; before <= 50000; before += 50001) {
        say(&line, &p);
        assert_int_equal(hear(&line, before), 1);
        const int64_t start = lw_clock_mono_ns();
        assert_int_equal(hear(&line, 0), 0);
        assert_int_equal(hear(&line, 10), 0);
        assert_true(lw_clock_mono_ns() - start < before * INT64_C(1000000) || before < 0);
    }
    assert_int_equal(line.d.errors + line.d.refused, 0);
    stop_line(&line);
}

static void on_alarm(int number)
{
    (void)number;
}

// A signal ends a wait and is no failure; nothing else ends one without end.
static void a_signal_ends_a_wait(void **state)
{
    (void)state;
    static struct line line;
    start_line(&line, "GOAL");
    const struct sigaction action = {.sa_handler = on_alarm};
    const struct itimerval often = {{0, 10000}, {0, 10000}}, seldom = {{0, 100000}, {0, 100000}},
                           never = {{0, 0}, {0, 0}};
    assert_int_equal(sigaction(SIGALRM, &action, NULL), 0);
    assert_int_equal(setitimer(ITIMER_REAL, &often, NULL), 0);
    const int64_t start = lw_clock_mono_ns();
    for (int i = 0; i < 3; i++) {
        assert_int_equal(hear(&line, 50000), 0);
        assert_int_equal(hear(&line, -1), 0);
    }
    assert_true(lw_clock_mono_ns() - start < INT64_C(50000000000));
    for (int i = 0; i < 3; i++) {
        assert_int_equal(setitimer(ITIMER_REAL, &never, NULL), 0);
        assert_int_equal(hear(&line, 1), 0);
        const int64_t armed = lw_clock_mono_ns();
        assert_int_equal(setitimer(ITIMER_REAL, &seldom, NULL), 0);
        assert_int_equal(hear(&line, -1), 0);
        assert_true(lw_clock_mono_ns() - armed >= INT64_C(100000000));
    }
    assert_int_equal(setitimer(ITIMER_REAL, &never, NULL), 0);
    assert_int_equal(line.d.errors + line.d.refused, 0);
    stop_line(&line);
}

// A socket that is closed, none, or shut down is told apart from silence, in every kind of wait.
static void a_dead_socket_is_told(void **state)
{
    (void)state;
    static const int waits[] = {0, 10, -1};
    for (size_t i = 0; i < sizeof waits / sizeof waits[0]; i++) {
        static struct line line;
        start_line(&line, "GOAL");
        assert_int_equal(hear(&line, 0), 0);
        assert_int_equal(shutdown(line.d.fd, SHUT_RD), 0);
        assert_int_equal(hear(&line, waits[i]), waits[i] == 0 ? 0 : -1); // who does not wait is not woken
        const int fd = line.d.fd;
        int pipes[2];
        assert_int_equal(pipe(pipes), 0);
        line.d.fd = pipes[0];
        assert_int_equal(hear(&line, waits[i]), -1);
        close(pipes[0]);
        close(pipes[1]);
        line.d.fd = fd;
        close(fd);
        assert_int_equal(hear(&line, waits[i]), -1);
        close(line.in);
    }
}

// Closing twice, or what was never opened, closes nothing: zeros are no description of file 0.
static void only_an_open_one_is_closed(void **state)
{
    (void)state;
    while (fcntl(0, F_GETFD) < 0)
        assert_true(open("/dev/null", O_RDONLY | O_CLOEXEC) >= 0);
    static struct lw_datagram zeros;
    lw_datagram_close(&zeros);
    assert_true(fcntl(0, F_GETFD) >= 0);
    static struct line line;
    start_line(&line, "GOAL");
    const int fd = line.d.fd;
    stop_line(&line);
    assert_true(fcntl(fd, F_GETFD) < 0);
    const int other = open("/dev/null", O_RDONLY | O_CLOEXEC);
    assert_true(other >= 0 && dup2(other, fd) == fd);
    lw_datagram_close(&line.d);
    assert_true(fcntl(fd, F_GETFD) >= 0);
    close(fd);
    if (other != fd)
        close(other);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(messages_come_whole_and_in_order),
        cmocka_unit_test(a_cut_message_is_too_long_for_any_type),
        cmocka_unit_test(a_wait_takes_its_time),
        cmocka_unit_test(a_signal_ends_a_wait),
        cmocka_unit_test(a_dead_socket_is_told),
        cmocka_unit_test(only_an_open_one_is_closed),
    };
    return cmocka_run_group_tests_name("datagram_receive", tests, NULL, NULL);
}
