// SPDX-License-Identifier: BSD-3-Clause
// Tests of the mailbox: newest value, whole values, and what the reader holds stays as it is.
//
// Units    none.
// Frames   none.
// Arrays   a value is WORDS copies of one number, so that a torn one shows.
// Memory   static.
// Errors   cmocka's; the threads only count.
#include "base/mailbox.h"
#include "helpers.h"

#include <pthread.h> // pthread_create

enum { WORDS = 64, WRITES = 200000 };

struct value {
    uint64_t word[WORDS];
};

struct rig {
    struct lw_mailbox box;
    _Alignas(LW_CACHE_LINE) struct value slots[LW_MAILBOX_SLOTS];
    atomic_bool done; // all is written
};

static void start(struct rig *rig)
{
    memset(rig->slots, 0xff, sizeof rig->slots);
    lw_mailbox_init(&rig->box, rig->slots, sizeof rig->slots[0]);
}

static void publish(struct rig *rig, uint64_t number)
{
    struct value *slot = lw_mailbox_slot(&rig->box);
    for (int i = 0; i < WORDS; i++)
        slot->word[i] = number;
    lw_mailbox_publish(&rig->box);
}

static uint64_t take(struct rig *rig, bool *fresh)
{
    const struct value *value = lw_mailbox_take(&rig->box, fresh);
    return value->word[0];
}

// Before the first value a take gives zeros and says that they are not fresh, whatever stood in the memory.
static void an_empty_mailbox_gives_zeros(void **state)
{
    (void)state;
    static struct rig rig;
    start(&rig);
    for (int i = 0; i < 3; i++) {
        bool fresh = true;
        const struct value *value = lw_mailbox_take(&rig.box, &fresh);
        assert_false(fresh);
        for (int k = 0; k < WORDS; k++)
            assert_true(value->word[k] == 0);
    }
}

// Any number of values between two takes: the newest one comes, fresh once, and again as long as nothing newer does.
static void the_newest_value_comes_fresh_once(void **state)
{
    (void)state;
    static struct rig rig;
    start(&rig);
    struct random random = {3};
    uint64_t newest = 0;
    for (int round = 0; round < 2000; round++) {
        const int writes = random_below(&random, 5);
        for (int i = 0; i < writes; i++)
            publish(&rig, ++newest);
        bool fresh = false;
        assert_true(take(&rig, &fresh) == newest);
        assert_int_equal(fresh, writes > 0);
        assert_true(take(&rig, &fresh) == newest);
        assert_false(fresh);
    }
}

// What was taken stays valid and unchanged until the next take, however much is written meanwhile.
static void a_taken_value_is_left_alone(void **state)
{
    (void)state;
    static struct rig rig;
    start(&rig);
    bool fresh = false;
    publish(&rig, 7);
    const struct value *held = lw_mailbox_take(&rig.box, &fresh);
    for (uint64_t number = 8; number < 30; number++) {
        assert_ptr_not_equal(lw_mailbox_slot(&rig.box), held);
        publish(&rig, number);
        assert_true(held->word[0] == 7 && held->word[WORDS - 1] == 7);
    }
    assert_true(take(&rig, &fresh) == 29);
}

// A slot that is filled but not published is not seen.
static void an_unpublished_value_is_not_seen(void **state)
{
    (void)state;
    static struct rig rig;
    start(&rig);
    bool fresh = false;
    publish(&rig, 1);
    ((struct value *)lw_mailbox_slot(&rig.box))->word[0] = 2;
    assert_true(take(&rig, &fresh) == 1);
    assert_true(fresh);
    lw_mailbox_publish(&rig.box);
    assert_true(take(&rig, &fresh) == 2);
}

static void *write_all(void *user)
{
    for (uint64_t number = 1; number <= WRITES; number++)
        publish(user, number);
    atomic_store(&((struct rig *)user)->done, true);
    return NULL;
}

// Two threads at full speed: no value is torn, none older than the last, and the last one written arrives.
static void two_threads_never_see_a_torn_or_older_value(void **state)
{
    (void)state;
    static struct rig rig;
    start(&rig);
    pthread_t writer;
    assert_int_equal(pthread_create(&writer, NULL, write_all, &rig), 0);
    int torn = 0, backwards = 0, lies = 0;
    uint64_t newest = 0;
    for (bool last = false; !last;) {
        bool fresh = false;
        last = atomic_load(&rig.done); // then this take has to bring the last value
        const struct value *value = lw_mailbox_take(&rig.box, &fresh);
        const uint64_t number = value->word[0];
        for (int i = 1; i < WORDS; i++)
            torn += value->word[i] != number;
        backwards += number < newest;
        lies += fresh != (number > newest);
        newest = number;
    }
    assert_int_equal(pthread_join(writer, NULL), 0);
    assert_true(newest == WRITES);
    assert_int_equal(torn, 0);
    assert_int_equal(backwards, 0);
    assert_int_equal(lies, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_empty_mailbox_gives_zeros),
        cmocka_unit_test(the_newest_value_comes_fresh_once),
        cmocka_unit_test(a_taken_value_is_left_alone),
        cmocka_unit_test(an_unpublished_value_is_not_seen),
        cmocka_unit_test(two_threads_never_see_a_torn_or_older_value),
    };
    return cmocka_run_group_tests_name("mailbox", tests, NULL, NULL);
}
