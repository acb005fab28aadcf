// SPDX-License-Identifier: BSD-3-Clause
// Tests of the health of a loop: percentiles and counts against plain ones, what two threads lose on the way, and the
// file of statistics.
//
// Units    ns.
// Frames   none.
// Arrays   records in the order of their ticks.
// Memory   static; what the module allocates is given back.
// Errors   cmocka's.
#define _GNU_SOURCE // MAP_ANONYMOUS, RUSAGE_THREAD, fmemopen

#include "health_rig.h"          // tick, report
#include "program/allocations.h" // lw_allocations_*

#include <pthread.h>      // pthread_create
#include <sys/mman.h>     // mmap
#include <sys/resource.h> // getrusage

enum { PAGES = 256, PAGE = 4096 };

// --- percentiles ---

static int ascending(const void *a, const void *b)
{
    const int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;
    return (x > y) - (x < y);
}

// sorted[(n-1)p] of the values that count among the last second's records; 0 where there are none.
static void check_percentiles(const struct rig *rig, bool ages, size_t offset, const int64_t found[LW_PERCENTILES])
{
    static const int thousandths[LW_PERCENTILES] = {500, 990, 999, 1000};
    static int64_t values[RATE];
    int n = 0;
    for (int i = rig->made > RATE ? rig->made - RATE : 0; i < rig->made; i++)
        if (rig->all[i].warm && (rig->all[i].expected || !ages))
            memcpy(&values[n++], (const char *)&rig->all[i] + offset, sizeof values[0]);
    qsort(values, (size_t)n, sizeof values[0], ascending);
    for (int p = 0; p < LW_PERCENTILES; p++)
        assert_int_equal(found[p], n > 0 ? values[(n - 1) * thousandths[p] / 1000] : 0);
}

static void check_all_percentiles(struct rig *rig)
{
    const struct lw_report r = report(rig);
    check_percentiles(rig, false, offsetof(struct lw_record, wake_late_ns), r.wake_late_ns);
    check_percentiles(rig, false, offsetof(struct lw_record, exec_ns), r.exec_ns);
    check_percentiles(rig, true, offsetof(struct lw_record, age_ns), r.age_ns);
}

static void fill_times(struct rig *rig, struct random *random)
{
    rig->record.wake_late_ns = (int64_t)(random_bits(random) >> 40);
    rig->record.exec_ns = (int64_t)(random_bits(random) >> 42);
    rig->record.age_ns = (int64_t)(random_bits(random) >> 38);
}

// At any number of ticks, the warm-up left out, and ages only while the other side is expected.
static void percentiles_are_those_of_the_last_second(void **state)
{
    (void)state;
    struct rig *rig = start();
    struct random random = {51};
    check_all_percentiles(rig); // before the first tick
    for (int k = 0; k < 3500; k++) {
        fill_times(rig, &random);
        rig->record.warm = k >= 200;
        rig->record.expected = random_below(&random, 3) != 0;
        tick(rig);
        if (k < 420 || k % 97 == 0)
            check_all_percentiles(rig);
    }
    finish(rig);
}

// At 10 kHz, of the numbers below 10 000 in any order: each percentile is the number itself. Older ones do not count.
static void percentiles_of_a_fast_loop(void **state)
{
    (void)state;
    enum { SECOND = 10000 };
    static struct lw_health health;
    static const struct lw_refusals refusals;
    struct lw_record record = {.warm = true, .sent = true};
    struct lw_report out = {0};
    assert_true(lw_health_init(&health, LW_NS_PER_S / SECOND));
    for (int64_t k = 0; k < SECOND + 500; k++) {
        record.exec_ns = k < 500 ? 1000000 : k * 7919 % SECOND; // a prime: every number comes once
        lw_health_note(&health, &record);
        assert_non_null(lw_health_collect(&health));
    }
    lw_health_end(&health);
    lw_health_report(&health, &refusals, &out);
    const int64_t expected[LW_PERCENTILES] = {4999, 9899, 9989, 9999};
    assert_same_bits(out.exec_ns, expected, sizeof expected);
    lw_health_free(&health);
}

// --- counts ---

static void counts_start_behind_the_warm_up(void **state)
{
    (void)state;
    struct rig *rig = start();
    struct random random = {52};
    int64_t ticks = 0, stale = 0, unsent = 0, skipped = 0;
    for (int k = 0; k < 3000; k++) {
        struct lw_record *r = &rig->record;
        const int skip = random_below(&random, 20) == 0 ? random_below(&random, 4) : 0;
        r->warm = k >= 500;
        r->fresh = random_below(&random, 5) != 0;
        r->expected = random_below(&random, 4) != 0;
        r->sent = random_below(&random, 7) != 0;
        r->skipped += skip;
        tick(rig);
        ticks += r->warm;
        stale += r->warm && r->expected && !r->fresh;
        unsent += r->warm && !r->sent;
        skipped += r->warm ? skip : 0;
    }
    const struct lw_report r = report(rig);
    assert_true(stale > 100 && unsent > 100 && skipped > 50);
    assert_true(r.ticks == ticks && r.stale_ticks == stale && r.unsent == unsent && r.skipped == skipped);
    assert_int_equal(r.period_ns, period);
    finish(rig);
}

// The other side's stream as the newest record knows it; refusals as they were counted.
static void the_report_names_the_other_side_and_the_refusals(void **state)
{
    (void)state;
    struct rig *rig = start();
    struct lw_report r = report(rig);
    assert_true(r.peer_session == 0 && r.taken == 0 && r.ticks == 0);
    rig->record.lease =
        (struct lw_lease){.session = 5, .seq = 6, .last_ns = 7, .taken = 8, .missed = 9, .takeovers = 10};
    tick(rig);
    for (int reason = 0; reason < LW_REFUSED_COUNT; reason++)
        for (int n = 0; n <= reason; n++)
            (void)lw_refusals_note(&rig->refusals, (enum lw_verdict)reason);
    r = report(rig);
    assert_true(r.peer_session == 5 && r.taken == 8 && r.missed == 9 && r.takeovers == 10);
    for (int reason = 0; reason < LW_REFUSED_COUNT; reason++)
        assert_int_equal(r.refused[reason], reason + 1);
    finish(rig);
}

// Faults that the program itself knows of stand in the report beside those found.
static void a_programs_own_faults_are_kept(void **state)
{
    (void)state;
    struct rig *rig = start();
    rig->record.sent = false;
    tick(rig);
    struct lw_report out = {.faults = LW_FAULT_LEASE};
    lw_health_report(&rig->health, &rig->refusals, &out);
    assert_int_equal(out.faults, LW_FAULT_LEASE | LW_FAULT_UNSENT);
    assert_int_equal(out.faults_ever, LW_FAULT_LEASE | LW_FAULT_UNSENT);
    finish(rig);
}

// --- the past ---

static void the_past_is_two_seconds_long(void **state)
{
    (void)state;
    struct rig *rig = start();
    assert_null(lw_health_past(&rig->health, 0));
    assert_null(lw_health_collect(&rig->health));
    for (int k = 0; k < 5 * RATE; k++) {
        rig->record.command.tick = k;
        tick(rig);
        if (k % 331 != 0)
            continue;
        int back = 0;
        for (const struct lw_record *r; (r = lw_health_past(&rig->health, back)) != NULL; back++)
            assert_int_equal(r->command.tick, k - back);
        assert_true(back == k + 1 || (k >= 2 * RATE && back >= 2 * RATE && back <= 2 * RATE + 2));
        assert_null(lw_health_past(&rig->health, -1));
    }
    finish(rig);
}

// --- page faults and allocations ---

static void touch_new_pages(void)
{
    char *pages = mmap(NULL, (size_t)PAGES * PAGE, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    assert_true(pages != MAP_FAILED);
    (void)madvise(pages, (size_t)PAGES * PAGE, MADV_NOHUGEPAGE); // one fault a page
    for (int i = 0; i < PAGES; i++)
        ((volatile char *)pages)[(ptrdiff_t)i * PAGE] = 1;
    assert_int_equal(munmap(pages, (size_t)PAGES * PAGE), 0);
}

// The system's own count; in a sanitized build it has the sanitizer's share.
static int64_t count_page_faults(void)
{
    struct rusage usage;
    assert_int_equal(getrusage(RUSAGE_THREAD, &usage), 0);
    return usage.ru_minflt;
}

// Counted from the end of the warm-up on, and brought up to date 20 times a second and at the end.
static void page_faults_count_behind_the_warm_up(void **state)
{
    (void)state;
    struct rig *rig = start();
    rig->record.warm = false;
    tick(rig);
    touch_new_pages();
    tick(rig);
    assert_int_equal(report(rig).minor_faults, 0);
    const int64_t start_of_count = count_page_faults();
    rig->record.warm = true;
    tick_for(rig, 55);
    const int64_t before = report(rig).minor_faults;
    assert_true(before >= 0 && before <= count_page_faults() - start_of_count);
    touch_new_pages();
    tick(rig);
    assert_int_equal(report(rig).minor_faults, before); // not asked for again yet
    tick_for(rig, 50);
    const int64_t found = report(rig).minor_faults;
    assert_true(found >= before + PAGES && found <= count_page_faults() - start_of_count);
    touch_new_pages();
    lw_health_end(&rig->health);
    assert_true(report(rig).minor_faults >= found + PAGES);
    assert_true(report(rig).minor_faults <= count_page_faults() - start_of_count);
    finish(rig);
}

// The real-time thread's own calls from the end of the warm-up until its end; those behind it are not its loop's.
static void allocations_count_behind_the_warm_up(void **state)
{
    (void)state;
    if (!lw_allocations_watch())
        skip();
    lw_allocations_unwatch();
    struct rig *rig = start();
    rig->record.warm = false;
    tick(rig);
    void *volatile block = malloc(1);
    rig->record.warm = true;
    tick(rig);
    assert_int_equal(lw_allocations_count(), 0);
    free(block);
    assert_int_equal(lw_allocations_count(), 1);
    tick_for(rig, 2 * RATE);
    assert_int_equal(lw_allocations_count(), 1); // its own work needs none
    lw_health_end(&rig->health);
    block = malloc(1);
    free(block);
    assert_int_equal(report(rig).allocations, 1);
    finish(rig);
}

// --- two threads ---

enum { TICKS = 20000 };

struct pair {
    struct lw_health health;
    atomic_bool done;
};

static void *run_loop(void *user)
{
    struct pair *pair = user;
    struct lw_record record = {.sent = true, .warm = true};
    for (int64_t k = 1; k <= TICKS; k++) {
        record.time_ns = k * period;
        record.exec_ns = record.wake_late_ns = record.lease.taken = k;
        lw_health_note(&pair->health, &record);
    }
    lw_health_end(&pair->health);
    atomic_store(&pair->done, true);
    return NULL;
}

// At full speed: every record is whole, in order, and counted or lost.
static void two_threads_account_for_every_tick(void **state)
{
    (void)state;
    static struct pair pair;
    static struct lw_refusals refusals;
    assert_true(lw_health_init(&pair.health, period));
    pthread_t loop;
    assert_int_equal(pthread_create(&loop, NULL, run_loop, &pair), 0);
    int64_t newest = 0;
    struct lw_report out = {0};
    for (bool last = false; !last;) {
        last = atomic_load(&pair.done);
        const struct lw_record *record = lw_health_collect(&pair.health);
        lw_health_report(&pair.health, &refusals, &out);
        if (record == NULL)
            continue;
        assert_true(record->time_ns >= newest && record->exec_ns == record->time_ns / period);
        assert_true(out.taken == record->exec_ns && record->wake_late_ns == record->exec_ns);
        newest = record->time_ns;
    }
    assert_int_equal(pthread_join(loop, NULL), 0);
    assert_int_equal(out.ticks + (int64_t)atomic_load(&pair.health.ring.lost), TICKS);
    assert_true(out.ticks > 0);
    lw_health_free(&pair.health);
}

// --- the file ---

static void write_text(const struct lw_health *health, char *text, size_t size)
{
    memset(text, 0, size);
    FILE *to = fmemopen(text, size, "w");
    assert_non_null(to);
    lw_health_write(health, "leeway-test", 5, to);
    assert_int_equal(fclose(to), 0);
}

// A few ticks, word for word: bins of 1 us up to the last one used, what lies over them apart.
static void the_file_is_what_happened(void **state)
{
    (void)state;
    struct rig *rig = start();
    static char text[4096];
    char expected[1024];
    rig->record.warm = false;
    rig->record.skipped = 7;
    tick(rig);
    rig->record.warm = true;
    const int64_t late[] = {0, 999, 1000, 2999, -50, INT64_C(20000000)};
    for (size_t i = 0; i < sizeof late / sizeof late[0]; i++) {
        rig->record.wake_late_ns = late[i];
        rig->record.exec_ns = 1500;
        rig->record.age_ns = INT64_C(19999999);
        rig->record.expected = false;
        rig->record.sent = i != 2;
        rig->record.skipped += i == 3 ? 4 : 0;
        tick(rig);
    }
    lw_health_end(&rig->health);
    atomic_store(&rig->health.minor_faults, 33);
    atomic_store(&rig->health.major_faults, 44);
    const struct lw_report r = report(rig);
    write_text(&rig->health, text, sizeof text);
    snprintf(expected, sizeof expected,
             "{\n  \"program\": \"leeway-test\",\n  \"realtime\": 5,\n  \"period_ns\": 1000000,\n"
             "  \"ticks\": 6,\n  \"skipped\": 4,\n  \"stale_ticks\": 0,\n"
             "  \"unsent\": 1,\n  \"minor_faults\": 33,\n  \"major_faults\": 44,\n  \"allocations\": %lld,\n"
             "  \"wake_late_us\": {\"over\": 1, \"max_ns\": 20000000, \"bins\": [3, 1, 1]},\n"
             "  \"exec_us\": {\"over\": 0, \"max_ns\": 1500, \"bins\": [0, 6]},\n"
             "  \"age_us\": {\"over\": 0, \"max_ns\": 0, \"bins\": []}\n}\n",
             (long long)r.allocations);
    assert_string_equal(text, expected);
    finish(rig);
}

// Numbers of a histogram in the file: of every bin, and their sum.
static int64_t read_bins(const char *text, const char *name, int64_t bins[LW_HISTOGRAM_BINS])
{
    int64_t sum = 0;
    char *at = strstr(text, name);
    assert_non_null(at);
    at = strstr(at, "\"bins\": [") + strlen("\"bins\": [");
    memset(bins, 0, LW_HISTOGRAM_BINS * sizeof bins[0]);
    for (int i = 0; *at != ']'; i++) {
        assert_true(i < LW_HISTOGRAM_BINS);
        sum += bins[i] = strtoll(at, &at, 10);
        at += strspn(at, ", ");
    }
    return sum;
}

// Random ticks: every bin holds what a plain count does, the last one included, and each tick is in one of them.
static void every_tick_is_in_one_bin(void **state)
{
    (void)state;
    struct rig *rig = start();
    struct random random = {53};
    static char text[1 << 18];
    static int64_t found[LW_HISTOGRAM_BINS], ages[LW_HISTOGRAM_BINS];
    int64_t expected_ages = 0, over = 0;
    for (int k = 0; k < 5 * RATE; k++) {
        rig->record.wake_late_ns = 1000 * random_below(&random, LW_HISTOGRAM_BINS + 100);
        rig->record.age_ns = random_below(&random, 1000000);
        rig->record.expected = random_below(&random, 2);
        if (k == 0)
            rig->record.wake_late_ns = 1000 * LW_HISTOGRAM_BINS - 1;
        over += rig->record.wake_late_ns >= 1000 * LW_HISTOGRAM_BINS;
        expected_ages += rig->record.expected;
        tick(rig);
    }
    write_text(&rig->health, text, sizeof text);
    assert_int_equal(read_bins(text, "age_us", ages), expected_ages);
    assert_int_equal(read_bins(text, "wake_late_us", found) + over, 5 * RATE);
    for (int k = 0; k < rig->made; k++)
        if (rig->all[k].wake_late_ns < 1000 * LW_HISTOGRAM_BINS)
            found[rig->all[k].wake_late_ns / 1000]--;
    for (int i = 0; i < LW_HISTOGRAM_BINS; i++)
        assert_int_equal(found[i], 0);
    finish(rig);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(percentiles_are_those_of_the_last_second),
        cmocka_unit_test(percentiles_of_a_fast_loop),
        cmocka_unit_test(counts_start_behind_the_warm_up),
        cmocka_unit_test(the_report_names_the_other_side_and_the_refusals),
        cmocka_unit_test(a_programs_own_faults_are_kept),
        cmocka_unit_test(the_past_is_two_seconds_long),
        cmocka_unit_test(page_faults_count_behind_the_warm_up),
        cmocka_unit_test(allocations_count_behind_the_warm_up),
        cmocka_unit_test(two_threads_account_for_every_tick),
        cmocka_unit_test(the_file_is_what_happened),
        cmocka_unit_test(every_tick_is_in_one_bin),
    };
    return cmocka_run_group_tests_name("health", tests, NULL, NULL);
}
