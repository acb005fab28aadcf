// SPDX-License-Identifier: BSD-3-Clause
// Memory of requests: each is new once, whoever else asked for something in between.
//
// Units    none.
// Frames   none.
// Arrays   none.
// Memory   stack.
// Errors   a failed property fails the test.
#include "helpers.h"

#include "controller/request.h"

static bool ask(struct lw_request_memory *memory, enum lw_request_kind kind, int64_t session, int64_t seq)
{
    const struct lw_request request = {.stamp = {.session = session, .seq = seq}, .kind = kind};
    return lw_request_is_new(memory, &request);
}

static void no_request_is_never_new(void **state)
{
    (void)state;
    struct lw_request_memory memory = {0};
    assert_false(ask(&memory, LW_REQUEST_GOAL, 0, 0));
    assert_false(ask(&memory, LW_REQUEST_STOP, 0, 7));
}

static void a_sender_counts_up(void **state)
{
    (void)state;
    struct lw_request_memory memory = {0};
    assert_true(ask(&memory, LW_REQUEST_GOAL, 5, 3));
    assert_false(ask(&memory, LW_REQUEST_GOAL, 5, 3));
    assert_false(ask(&memory, LW_REQUEST_GOAL, 5, 2));
    assert_true(ask(&memory, LW_REQUEST_GOAL, 5, 4));
}

// Seq is counted per channel: a stop may carry the numbers of a goal.
static void kinds_are_counted_apart(void **state)
{
    (void)state;
    struct lw_request_memory memory = {0};
    assert_true(ask(&memory, LW_REQUEST_GOAL, 5, 1));
    assert_true(ask(&memory, LW_REQUEST_STOP, 5, 1));
    assert_false(ask(&memory, LW_REQUEST_GOAL, 5, 1));
    assert_false(ask(&memory, LW_REQUEST_STOP, 5, 1));
}

// The first operator's goal, repeated late, undoes neither the second one's goal nor a stop.
static void a_repetition_undoes_nobodys_request(void **state)
{
    (void)state;
    struct lw_request_memory memory = {0};
    assert_true(ask(&memory, LW_REQUEST_GOAL, 5, 3));
    assert_true(ask(&memory, LW_REQUEST_GOAL, 6, 1));
    assert_false(ask(&memory, LW_REQUEST_GOAL, 5, 3));
    assert_true(ask(&memory, LW_REQUEST_STOP, 6, 1));
    assert_false(ask(&memory, LW_REQUEST_GOAL, 5, 3));
    assert_false(ask(&memory, LW_REQUEST_GOAL, 6, 1));
}

// The table is full: the sender heard first is forgotten, the others are not.
static void the_oldest_sender_makes_room(void **state)
{
    (void)state;
    struct lw_request_memory memory = {0};
    for (int64_t k = 1; k <= LW_REQUEST_SENDERS + 1; k++)
        assert_true(ask(&memory, LW_REQUEST_GOAL, k, 1));
    for (int64_t k = 2; k <= LW_REQUEST_SENDERS + 1; k++)
        assert_false(ask(&memory, LW_REQUEST_GOAL, k, 1));
    assert_true(ask(&memory, LW_REQUEST_GOAL, 1, 1));
}

// Whatever a sender may say, the program's own end is not taken for something obeyed before.
static void no_sender_keeps_a_program_from_its_end(void **state)
{
    (void)state;
    struct lw_request_memory memory = {0};
    const int64_t extremes[] = {1, 2, INT64_MAX - 1, INT64_MAX}; // the wire refuses sessions below 1
    for (size_t i = 0; i < sizeof extremes / sizeof extremes[0]; i++)
        (void)ask(&memory, LW_REQUEST_STOP, extremes[i], INT64_MAX);
    assert_true(lw_request_is_new(&memory, &lw_request_shutdown));
    assert_false(lw_request_is_new(&memory, &lw_request_shutdown));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_request_is_never_new),      cmocka_unit_test(a_sender_counts_up),
        cmocka_unit_test(kinds_are_counted_apart),      cmocka_unit_test(a_repetition_undoes_nobodys_request),
        cmocka_unit_test(the_oldest_sender_makes_room), cmocka_unit_test(no_sender_keeps_a_program_from_its_end),
    };
    return cmocka_run_group_tests_name("request", tests, NULL, NULL);
}
