// SPDX-License-Identifier: BSD-3-Clause
// Statistics of a real-time loop.
//
// Units    see health.h.
// Frames   none.
// Arrays   see health.h.
// Memory   see health.h.
// Errors   see health.h.
#define _GNU_SOURCE // RUSAGE_THREAD
#include "program/health.h"

#include "base/clock.h"          // LW_NS_PER_S
#include "program/allocations.h" // lw_allocations_*

#include <inttypes.h>     // PRId64
#include <stdlib.h>       // calloc, qsort
#include <sys/resource.h> // getrusage

enum { RING_S = 1, FAULTS_PER_S = 20 };
static const double percentile[LW_PERCENTILES] = {0.50, 0.99, 0.999, 1.0};

// --- set-up ---

bool lw_health_init(struct lw_health *health, int64_t period_ns)
{
    const int64_t rate = LW_NS_PER_S / period_ns + 1;
    size_t capacity = 1;
    while (capacity < (size_t)(RING_S * rate))
        capacity *= 2;
    *health = (struct lw_health){.period_ns = period_ns, .capacity = (int)(LW_HEALTH_PAST_S * rate)};
    void *slots = calloc(capacity, sizeof(struct lw_record));
    health->ring.slots = slots;
    health->past = calloc((size_t)health->capacity, sizeof *health->past);
    health->sorted = calloc((size_t)health->capacity, sizeof *health->sorted);
    if (slots == NULL || health->past == NULL || health->sorted == NULL)
        return false;
    lw_ring_init(&health->ring, slots, sizeof(struct lw_record), capacity);
    return true;
}

void lw_health_free(struct lw_health *health)
{
    free(health->ring.slots);
    free(health->past);
    free(health->sorted);
}

// --- real-time thread ---

// Page faults of this thread since the end of the warm-up.
static void note_faults(struct lw_health *health, bool first)
{
    struct rusage usage;
    if (getrusage(RUSAGE_THREAD, &usage) != 0)
        return;
    if (first) {
        health->first_minor = usage.ru_minflt;
        health->first_major = usage.ru_majflt;
    }
    atomic_store_explicit(&health->minor_faults, usage.ru_minflt - health->first_minor, memory_order_relaxed);
    atomic_store_explicit(&health->major_faults, usage.ru_majflt - health->first_major, memory_order_relaxed);
}

void lw_health_note(struct lw_health *health, const struct lw_record *record)
{
    (void)lw_ring_push(&health->ring, record); // a full ring counts what it lost
    const int64_t between = LW_NS_PER_S / FAULTS_PER_S;
    if (record->warm && !health->warm) {
        health->warm = true;
        (void)lw_allocations_watch(); // where it cannot, the count itself says so
        note_faults(health, true);
    } else if (health->warm && record->time_ns / between != (record->time_ns - health->period_ns) / between) {
        note_faults(health, false);
    }
}

void lw_health_end(struct lw_health *health)
{
    if (health->warm)
        note_faults(health, false);
    lw_allocations_unwatch();
}

// --- normal thread ---

static void count_in(struct lw_histogram *histogram, int64_t value_ns)
{
    const int64_t us = value_ns < 0 ? 0 : value_ns / 1000;
    *(us < LW_HISTOGRAM_BINS ? &histogram->bin[us] : &histogram->over) += 1;
    histogram->max_ns = value_ns > histogram->max_ns ? value_ns : histogram->max_ns;
}

// Adds one tick to the totals. Those of the warm-up only set the mark.
static void add(struct lw_health *health, const struct lw_record *record)
{
    if (!record->warm) {
        health->first_skipped = record->skipped;
        return;
    }
    health->ticks++;
    health->stale_ticks += record->expected && !record->fresh;
    health->unsent += !record->sent;
    count_in(&health->wake, record->wake_late_ns);
    count_in(&health->exec, record->exec_ns);
    if (record->expected)
        count_in(&health->age, record->age_ns);
}

const struct lw_record *lw_health_collect(struct lw_health *health)
{
    while (lw_ring_pop(&health->ring, &health->past[health->next])) {
        add(health, &health->past[health->next]);
        health->next = (health->next + 1) % health->capacity;
        if (health->count < health->capacity)
            health->count++;
    }
    return lw_health_past(health, 0);
}

const struct lw_record *lw_health_past(const struct lw_health *health, int back)
{
    if (back < 0 || back >= health->count)
        return NULL;
    return &health->past[(health->next - 1 - back + health->capacity) % health->capacity];
}

static int ascending(const void *a, const void *b)
{
    const int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;
    return (x > y) - (x < y);
}

// Percentiles of one field of the last n records, without the warm-up; `offset` says which. An age is one only while
// the other side is expected.
static void percentiles(const struct lw_health *health, int n, size_t offset, int64_t out[LW_PERCENTILES])
{
    int used = 0;
    for (int i = 0; i < n; i++) {
        const struct lw_record *record = lw_health_past(health, i);
        if (record->warm && (record->expected || offset != offsetof(struct lw_record, age_ns)))
            health->sorted[used++] = *(const int64_t *)((const unsigned char *)record + offset);
    }
    qsort(health->sorted, (size_t)used, sizeof health->sorted[0], ascending);
    for (int p = 0; p < LW_PERCENTILES; p++)
        out[p] = used > 0 ? health->sorted[(int)((used - 1) * percentile[p])] : 0;
}

// Faults that the last n records show.
static unsigned find_faults(const struct lw_health *health, int n)
{
    unsigned faults = 0;
    for (int i = 0; i < n; i++) {
        const struct lw_record *record = lw_health_past(health, i), *before = lw_health_past(health, i + 1);
        if (!record->warm)
            continue;
        faults |= record->faults;
        if (!record->sent)
            faults |= LW_FAULT_UNSENT;
        if (before != NULL && before->warm && record->skipped > before->skipped)
            faults |= LW_FAULT_OVERRUN;
    }
    return faults;
}

// A fault shows for a second after its counter grew.
static unsigned watch(struct lw_counter *counter, int64_t value, int64_t now_ns, unsigned fault)
{
    if (value > counter->before)
        counter->until_ns = now_ns + LW_NS_PER_S;
    counter->before = value;
    return now_ns < counter->until_ns ? fault : 0;
}

// Faults that show in counters.
static unsigned find_counted(struct lw_health *health, const struct lw_refusals *refusals, int64_t now_ns)
{
    int64_t bad = 0;
    for (int reason = LW_REFUSED_SIZE; reason <= LW_REFUSED_RANGE; reason++)
        bad += lw_refusals_of(refusals, (enum lw_verdict)reason);
    const int64_t lost = (int64_t)atomic_load_explicit(&health->ring.lost, memory_order_relaxed);
    return watch(&health->bad, bad, now_ns, LW_FAULT_BAD_INPUT) |
           watch(&health->foreign, lw_refusals_of(refusals, LW_REFUSED_FOREIGN), now_ns, LW_FAULT_LEASE) |
           watch(&health->lost, lost, now_ns, LW_FAULT_LOST_RECORDS);
}

void lw_health_report(struct lw_health *health, const struct lw_refusals *refusals, struct lw_report *report)
{
    const int second = (int)(LW_NS_PER_S / health->period_ns);
    const int n = health->count < second ? health->count : second;
    const struct lw_record *newest = lw_health_past(health, 0);
    report->period_ns = health->period_ns;
    report->ticks = health->ticks;
    report->stale_ticks = health->stale_ticks;
    report->unsent = health->unsent;
    if (newest != NULL) {
        report->skipped = newest->skipped - health->first_skipped;
        report->peer_session = newest->lease.session;
        report->taken = newest->lease.taken;
        report->missed = newest->lease.missed;
        report->takeovers = newest->lease.takeovers;
    }
    for (int reason = 0; reason < LW_REFUSED_COUNT; reason++)
        report->refused[reason] = lw_refusals_of(refusals, (enum lw_verdict)reason);
    percentiles(health, n, offsetof(struct lw_record, wake_late_ns), report->wake_late_ns);
    percentiles(health, n, offsetof(struct lw_record, exec_ns), report->exec_ns);
    percentiles(health, n, offsetof(struct lw_record, age_ns), report->age_ns);
    report->minor_faults = atomic_load_explicit(&health->minor_faults, memory_order_relaxed);
    report->major_faults = atomic_load_explicit(&health->major_faults, memory_order_relaxed);
    report->allocations = lw_allocations_count();
    report->faults |= find_faults(health, n);
    report->faults |= find_counted(health, refusals, newest != NULL ? newest->time_ns : 0);
    health->faults_ever |= report->faults;
    report->faults_ever = health->faults_ever;
}

// --- JSON ---

static void write_histogram(const char *name, const struct lw_histogram *histogram, FILE *to)
{
    int used = LW_HISTOGRAM_BINS;
    while (used > 0 && histogram->bin[used - 1] == 0)
        used--;
    fprintf(to, "  \"%s\": {\"over\": %" PRId64 ", \"max_ns\": %" PRId64 ", \"bins\": [", name, histogram->over,
            histogram->max_ns);
    for (int i = 0; i < used; i++)
        fprintf(to, "%s%" PRId64, i ? ", " : "", histogram->bin[i]);
    fprintf(to, "]}");
}

void lw_health_write(const struct lw_health *health, const char *program, unsigned realtime, FILE *to)
{
    const struct lw_record *newest = lw_health_past(health, 0);
    const int64_t skipped = newest != NULL ? newest->skipped - health->first_skipped : 0;
    fprintf(to, "{\n  \"program\": \"%s\",\n  \"realtime\": %u,\n  \"period_ns\": %" PRId64 ",\n", program, realtime,
            health->period_ns);
    fprintf(to, "  \"ticks\": %" PRId64 ",\n  \"skipped\": %" PRId64 ",\n  \"stale_ticks\": %" PRId64 ",\n",
            health->ticks, skipped, health->stale_ticks);
    fprintf(to, "  \"unsent\": %" PRId64 ",\n  \"minor_faults\": %" PRId64 ",\n  \"major_faults\": %" PRId64 ",\n",
            health->unsent, (int64_t)health->minor_faults, (int64_t)health->major_faults);
    fprintf(to, "  \"allocations\": %" PRId64 ",\n", lw_allocations_count());
    write_histogram("wake_late_us", &health->wake, to);
    fprintf(to, ",\n");
    write_histogram("exec_us", &health->exec, to);
    fprintf(to, ",\n");
    write_histogram("age_us", &health->age, to);
    fprintf(to, "\n}\n");
}
