// SPDX-License-Identifier: BSD-3-Clause
// A loop whose normal thread follows tick by tick, and the list of all it noted.
//
// Units    ns.
// Frames   none.
// Arrays   records in the order of their ticks.
// Memory   static; what the module allocates is given back.
// Errors   cmocka's.
#ifndef LW_TESTS_HEALTH_RIG_H
#define LW_TESTS_HEALTH_RIG_H

#include "base/clock.h" // LW_NS_PER_S
#include "helpers.h"
#include "program/health.h"

enum { RATE = 1000 };
static const int64_t period = LW_NS_PER_S / RATE;

// A loop and all the records it ever made.
struct rig {
    struct lw_health health;
    struct lw_refusals refusals;
    struct lw_record record; // the next one
    int made;
    struct lw_record all[8 * RATE];
};

static inline struct rig *start(void)
{
    static struct rig rig;
    memset(&rig, 0, sizeof rig);
    assert_true(lw_health_init(&rig.health, period));
    rig.record =
        (struct lw_record){.time_ns = 777 * LW_NS_PER_S, .sent = true, .fresh = true, .expected = true, .warm = true};
    return &rig;
}

static inline void finish(struct rig *rig)
{
    lw_health_end(&rig->health);
    lw_health_free(&rig->health);
}

// One tick; the normal thread follows at once.
static inline void tick(struct rig *rig)
{
    lw_health_note(&rig->health, &rig->record);
    rig->all[rig->made++] = rig->record;
    rig->record.time_ns += period;
    assert_true(lw_health_collect(&rig->health) != NULL);
}

static inline void tick_for(struct rig *rig, int ticks)
{
    for (int k = 0; k < ticks; k++)
        tick(rig);
}

static inline struct lw_report report(struct rig *rig)
{
    struct lw_report out = {.state = LW_RUNNING, .clearance = 0.25};
    lw_health_report(&rig->health, &rig->refusals, &out);
    assert_true(out.state == LW_RUNNING && out.clearance == 0.25); // these are the program's own
    return out;
}

#endif
