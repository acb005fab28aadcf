// SPDX-License-Identifier: BSD-3-Clause
// Tests of the ring: every value once, whole and in order; a full one refuses and counts.
//
// Units    none.
// Frames   none.
// Arrays   a value is WORDS copies of one number, so that a torn one shows.
// Memory   static.
// Errors   cmocka's; the threads only count.
#include "base/ring.h"
#include "helpers.h"

#include <pthread.h> // pthread_create
#include <sched.h>   // sched_yield

enum { WORDS = 509, CAPACITY = 8, VALUES = 4000 };

struct value {
    uint64_t word[WORDS];
};

struct rig {
    struct lw_ring ring;
    struct value before; // what stands beside the slots must stay as it is
    struct value slots[CAPACITY];
    struct value behind;
    bool insists;     // the writer tries again until the value is taken
    uint64_t refused; // by the writer's own count
    atomic_bool done; // all is written
};

static void start(struct rig *rig, size_t capacity)
{
    memset(&rig->before, 0x5a, sizeof rig->before);
    memset(rig->slots, 0xff, sizeof rig->slots);
    memset(&rig->behind, 0x5a, sizeof rig->behind);
    lw_ring_init(&rig->ring, rig->slots, sizeof rig->slots[0], capacity);
    atomic_store(&rig->done, false);
}

static void check_borders(const struct rig *rig)
{
    struct value pattern;
    memset(&pattern, 0x5a, sizeof pattern);
    assert_same_bits(&rig->before, &pattern, sizeof pattern);
    assert_same_bits(&rig->behind, &pattern, sizeof pattern);
}

// A number in every byte of which something changes.
static uint64_t spread(uint64_t number)
{
    return number * UINT64_C(0x9e3779b97f4a7c15);
}

static uint64_t gather(uint64_t word)
{
    return word * UINT64_C(0xf1de83e19937733d); // inverse of spread, modulo 2^64
}

static bool push(struct rig *rig, uint64_t number)
{
    struct value value;
    for (int i = 0; i < WORDS; i++)
        value.word[i] = spread(number);
    return lw_ring_push(&rig->ring, &value);
}

// Takes the oldest value. Returns its number, 0 when there is none; counts words that do not fit it.
static uint64_t pop(struct rig *rig, int *torn)
{
    struct value value;
    memset(&value, 0x5a, sizeof value);
    if (!lw_ring_pop(&rig->ring, &value)) {
        for (int i = 0; i < WORDS; i++) // an empty ring gives nothing at all
            *torn += value.word[i] != UINT64_C(0x5a5a5a5a5a5a5a5a);
        return 0;
    }
    for (int i = 1; i < WORDS; i++)
        *torn += value.word[i] != value.word[0];
    return gather(value.word[0]);
}

static void check_pop(struct rig *rig, uint64_t expected)
{
    int torn = 0;
    assert_true(pop(rig, &torn) == expected);
    assert_int_equal(torn, 0);
}

// Starting touches every slot, so that no page of it has to be faulted in later.
static void a_new_ring_is_empty_and_touched(void **state)
{
    (void)state;
    static struct rig rig;
    const struct value zero = {{0}};
    start(&rig, CAPACITY);
    for (int i = 0; i < CAPACITY; i++)
        assert_same_bits(&rig.slots[i], &zero, sizeof zero);
    check_borders(&rig);
    check_pop(&rig, 0);
    assert_int_equal(atomic_load(&rig.ring.lost), 0);
}

// Every capacity down to one holds exactly that many values; the next ones are refused, counted, and change nothing.
static void a_full_ring_refuses_and_counts(void **state)
{
    (void)state;
    static struct rig rig;
    for (size_t capacity = 1; capacity <= CAPACITY; capacity *= 2) {
        start(&rig, capacity);
        for (uint64_t n = 1; n <= capacity; n++)
            assert_true(push(&rig, n));
        for (uint64_t n = 1; n <= 5; n++) {
            assert_false(push(&rig, 1000 + n));
            assert_int_equal(atomic_load(&rig.ring.lost), n);
        }
        check_pop(&rig, 1);
        assert_true(push(&rig, capacity + 1)); // one place is free again
        assert_false(push(&rig, 2000));
        for (uint64_t n = 2; n <= capacity + 1; n++)
            check_pop(&rig, n);
        check_pop(&rig, 0);
        assert_int_equal(atomic_load(&rig.ring.lost), 6);
    }
    check_borders(&rig);
}

// Any pattern of pushes and pops: what comes out is what a plain queue would hold.
static void values_come_once_and_in_order(void **state)
{
    (void)state;
    static struct rig rig;
    struct random random = {31};
    start(&rig, CAPACITY);
    uint64_t queue[CAPACITY], number = 0, lost = 0;
    size_t queued = 0;
    for (int round = 0; round < 100000; round++) {
        if (random_below(&random, 2)) {
            const bool taken = push(&rig, ++number);
            assert_int_equal(taken, queued < CAPACITY);
            lost += !taken;
            if (taken)
                queue[queued++] = number;
        } else {
            check_pop(&rig, queued ? queue[0] : 0);
            if (queued)
                memmove(queue, queue + 1, --queued * sizeof queue[0]);
        }
        assert_int_equal(atomic_load(&rig.ring.lost), lost);
    }
    assert_true(lost > 100);
    check_borders(&rig);
}

// The counters may run over the end of their type.
static void counters_may_wrap(void **state)
{
    (void)state;
    static struct rig rig;
    start(&rig, CAPACITY);
    atomic_store(&rig.ring.written, SIZE_MAX - 2);
    atomic_store(&rig.ring.read, SIZE_MAX - 2);
    for (uint64_t n = 1; n <= CAPACITY; n++)
        assert_true(push(&rig, n));
    assert_false(push(&rig, 99));
    for (uint64_t n = 1; n <= CAPACITY; n++)
        check_pop(&rig, n);
    check_pop(&rig, 0);
}

static void *write_all(void *user)
{
    struct rig *rig = user;
    for (uint64_t number = 1; number <= VALUES; number++)
        while (!push(rig, number)) {
            rig->refused++;
            if (!rig->insists)
                break;
            sched_yield();
        }
    atomic_store(&rig->done, true);
    return NULL;
}

// Two threads at full speed: no value is torn, none comes twice or backwards, and what did not come is what was
// counted as lost. Returns how many came.
static uint64_t run_two_threads(struct rig *rig, size_t capacity, bool insists)
{
    start(rig, capacity);
    rig->insists = insists;
    rig->refused = 0;
    pthread_t writer;
    assert_int_equal(pthread_create(&writer, NULL, write_all, rig), 0);
    int torn = 0, backwards = 0;
    uint64_t newest = 0, taken = 0;
    for (bool last = false; !last;) {
        last = atomic_load(&rig->done); // then this round has to bring all the rest
        for (uint64_t number; (number = pop(rig, &torn)) != 0; newest = number, taken++)
            backwards += number <= newest;
    }
    assert_int_equal(pthread_join(writer, NULL), 0);
    assert_int_equal(torn, 0);
    assert_int_equal(backwards, 0);
    assert_int_equal(atomic_load(&rig->ring.lost), rig->refused);
    check_borders(rig);
    return taken;
}

static void two_threads_lose_only_what_is_counted(void **state)
{
    (void)state;
    static struct rig rig;
    for (size_t capacity = 1; capacity <= CAPACITY; capacity *= 2) {
        const uint64_t taken = run_two_threads(&rig, capacity, false);
        assert_int_equal(taken + rig.refused, VALUES);
    }
}

// A writer that tries again until it is heard loses nothing.
static void an_insisting_writer_loses_nothing(void **state)
{
    (void)state;
    static struct rig rig;
    for (size_t capacity = 1; capacity <= CAPACITY; capacity *= 2)
        assert_int_equal(run_two_threads(&rig, capacity, true), VALUES);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_new_ring_is_empty_and_touched),       cmocka_unit_test(a_full_ring_refuses_and_counts),
        cmocka_unit_test(values_come_once_and_in_order),         cmocka_unit_test(counters_may_wrap),
        cmocka_unit_test(two_threads_lose_only_what_is_counted), cmocka_unit_test(an_insisting_writer_loses_nothing),
    };
    return cmocka_run_group_tests_name("ring", tests, NULL, NULL);
}
