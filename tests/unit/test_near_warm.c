// SPDX-License-Identifier: BSD-3-Clause
// Warm starts change no result, whatever they come from; queries allocate nothing and let what is no number show.
//
// Units    metres, ns.
// Frames   base frame.
// Arrays   none.
// Memory   static.
// Errors   cmocka's.
#include "near_rig.h"
#include "program/allocations.h" // lw_allocations_*

// The linker puts this before every query of one pair.
// NOLINTBEGIN(bugprone-reserved-identifier,misc-use-internal-linkage,readability-*)
void __real_lw_distance_link(const struct lw_capsule *link, const struct lw_shape *shape, double d_max,
                             struct lw_warm *warm, struct lw_distance *out);
void __wrap_lw_distance_link(const struct lw_capsule *link, const struct lw_shape *shape, double d_max,
                             struct lw_warm *warm, struct lw_distance *out);

static int measured;

void __wrap_lw_distance_link(const struct lw_capsule *link, const struct lw_shape *shape, double d_max,
                             struct lw_warm *warm, struct lw_distance *out)
{
    measured++;
    __real_lw_distance_link(link, shape, d_max, warm, out);
}
// NOLINTEND(bugprone-reserved-identifier,misc-use-internal-linkage,readability-*)

// --- warm against cold ---

static void check_same(const struct lw_near *warm, const struct lw_near *cold)
{
    assert_int_equal(warm->part, cold->part);
    assert_int_equal(warm->obstacle, cold->obstacle);
    assert_near(warm->distance.d, cold->distance.d, 1e-12);
    assert_int_equal(warm->distance.flags & ~LW_DISTANCE_STALLED, cold->distance.flags & ~LW_DISTANCE_STALLED);
}

// All queries, with the rig's table and without one.
static void check_warm(struct near_rig *rig, double d_max)
{
    static struct lw_near_list cold_list;
    struct lw_near each[LW_BODY_MAX], cold_each[LW_BODY_MAX], smallest, cold_smallest;
    const struct lw_near_query warm = rig_query(rig, SECOND, d_max);
    struct lw_near_query cold = warm;
    cold.warm = NULL;
    lw_near_range(&warm, &rig->list);
    lw_near_range(&cold, &cold_list);
    assert_int_equal(rig->list.needed, cold_list.needed);
    for (int i = 0; i < cold_list.count; i++)
        check_same(&rig->list.pair[i], &cold_list.pair[i]);
    lw_near_each(&warm, each);
    lw_near_each(&cold, cold_each);
    for (int part = 0; part < rig->body.count; part++)
        check_same(&each[part], &cold_each[part]);
    lw_near_smallest(&warm, &smallest);
    lw_near_smallest(&cold, &cold_smallest);
    check_same(&smallest, &cold_smallest);
}

static struct near_rig *hulls(uint64_t seed, int count)
{
    struct near_rig *rig = near_rig(seed);
    lw_body_make(LW_UR5, LW_BODY_CAPSULES, NULL, &rig->body);
    for (int i = 0; i < count; i++)
        rig_tell(rig, i % 8 ? LW_HULL : rig_kind(&rig->random), 1);
    rig_build(rig, &rig->world);
    return rig;
}

static void motions_and_jumps(void **state)
{
    (void)state;
    struct near_rig *rig = hulls(61, 300);
    double q[LW_NJ] = {0};
    for (int n = 0; n < 300; n++) {
        if (n % 10 == 0)
            random_fill(&rig->random, -3, 3, q, LW_NJ);
        for (int j = 0; j < LW_NJ; j++)
            q[j] += 1e-3;
        rig_pose(rig, LW_UR5, q);
        check_warm(rig, 0.3);
    }
}

// The same ids on other hulls, with and without a new generation, in a world of another size and order.
static void ids_that_are_used_again(void **state)
{
    (void)state;
    for (int generation = 1; generation < 3; generation++) {
        struct near_rig *rig = hulls(62, 200);
        for (int n = 0; n < 100; n++) {
            rig_random_pose(rig, LW_UR5);
            check_warm(rig, 0.3);
            rig->count = 0;
            const int count = 1 + random_below(&rig->random, 200);
            for (int i = 0; i < count; i++) {
                struct told *told = rig_tell(rig, LW_HULL, 1);
                told->id = count - i;
                told->generation = (uint32_t)(generation == 1 ? 1 : n);
            }
            rig_build(rig, &rig->world);
        }
    }
}

// Ids that share a place of the table.
static void ids_that_clash(void **state)
{
    (void)state;
    struct near_rig *rig = hulls(63, 100);
    for (int i = 0; i < rig->count; i++)
        rig->told[i].id = 1 + LW_WARM_SLOTS * i;
    rig_build(rig, &rig->world);
    for (int n = 0; n < 50; n++) {
        rig_random_pose(rig, LW_UR5);
        check_warm(rig, 0.3);
        check_warm(rig, 0.3);
    }
}

// A table full of anything at all.
static void rubbish_in_the_table(void **state)
{
    (void)state;
    struct near_rig *rig = hulls(64, 100);
    for (int n = 0; n < 100; n++) {
        unsigned char *byte = (unsigned char *)&rig->warm;
        for (size_t i = 0; i < sizeof rig->warm; i++)
            byte[i] = (unsigned char)(random_bits(&rig->random) >> 40);
        // Keys that fit make the rest of an entry count.
        for (int part = 0; part < LW_BODY_MAX; part++) {
            for (int id = 1; id <= 100; id++) {
                struct lw_warm *entry = &rig->warm.entry[part][id];
                entry->id = (uint32_t)id;
                entry->generation = 1;
                entry->count = (uint8_t)(n % 5);
            }
            rig->warm.each[part].id = random_below(&rig->random, 102) - 1;
            rig->warm.each[part].part = random_below(&rig->random, 14) - 1;
            rig->warm.each[part].index = random_below(&rig->random, 102) - 1;
        }
        rig_random_pose(rig, LW_UR5);
        check_warm(rig, 0.3);
    }
}

// In steady motion the table saves supports, and a search starts from what was nearest.
static void the_table_is_of_use(void **state)
{
    (void)state;
    struct near_rig *rig = hulls(65, 300);
    double q[LW_NJ] = {0.5, -1.5, 1, 0.3, 0.8, 0};
    int warm_supports = 0, cold_supports = 0, in_range = 0, for_range = 0, for_nearest = 0;
    for (int n = 0; n < 200; n++) {
        struct lw_near_query query = rig_query(rig, SECOND, 0.3);
        struct lw_near each[LW_BODY_MAX];
        for (int j = 0; j < LW_NJ; j++)
            q[j] += 1e-3;
        rig_pose(rig, LW_UR5, q);
        measured = 0;
        lw_near_range(&query, &rig->list);
        in_range += rig->list.needed;
        for_range += measured;
        for (int i = 0; i < rig->list.count && n > 0; i++)
            warm_supports += rig->list.pair[i].distance.iterations;
        query.warm = NULL;
        lw_near_range(&query, &rig->list);
        for (int i = 0; i < rig->list.count && n > 0; i++)
            cold_supports += rig->list.pair[i].distance.iterations;
        query.warm = &rig->warm;
        measured = 0;
        lw_near_each(&query, each);
        for_nearest += n > 0 ? measured : 0;
        for (int part = 0; part < rig->body.count; part++) {
            const struct lw_warm_pair *kept = &rig->warm.each[part];
            assert_int_equal(kept->id, each[part].obstacle);
            assert_true(kept->id == 0 || rig->world.item[kept->index].shape.id == (uint32_t)kept->id);
        }
    }
    assert_true(cold_supports > 10000 && warm_supports < 0.6 * cold_supports);
    // Few pairs are measured that are not wanted.
    assert_true(for_range < 1.25 * in_range);
    assert_true(for_nearest < 1.5 * 199 * rig->body.count);
}

// --- what must not happen ---

static void queries_allocate_nothing(void **state)
{
    (void)state;
    if (!LW_ALLOCATIONS_COUNTED)
        skip();
    struct near_rig *rig = hulls(66, 500);
    for (int i = 0; i < rig->count; i += 2)
        rig_motion(&rig->random, SECOND / 2, &rig->told[i].motion);
    const struct lw_tool tool = rig_tool(&rig->random, LW_TOOL_HULL);
    lw_body_make(LW_UR5, LW_BODY_CAPSULES_FINE, &tool, &rig->body);
    int found = 0;
    assert_true(lw_allocations_watch());
    for (int n = 0; n < 100; n++) {
        struct lw_near each[LW_BODY_MAX];
        const struct lw_near_query query = rig_query(rig, SECOND, 0.3);
        rig_build(rig, &rig->later);
        lw_snapshot_copy(&rig->later, &rig->world);
        rig_random_pose(rig, LW_UR5);
        lw_near_range(&query, &rig->list);
        lw_near_self(&rig->body, &rig->placed, 1, &rig->list);
        lw_near_each(&query, each);
        lw_near_smallest(&query, each);
        found += rig->list.count;
    }
    assert_int_equal(lw_allocations_count(), 0);
    lw_allocations_unwatch();
    assert_true(found > 1000);
}

// A part that is nowhere is near to everything, and its distances are no numbers.
static void what_is_no_number_shows(void **state)
{
    (void)state;
    struct near_rig *rig = hulls(67, 50);
    rig_random_pose(rig, LW_UR5);
    for (int k = 0; k < 7; k++) {
        struct lw_near each[LW_BODY_MAX], smallest;
        const struct lw_near_query query = rig_query(rig, SECOND, 0.1);
        const struct lw_placed good = rig->placed;
        struct lw_capsule *bad = &rig->placed.capsule[3];
        *(k == 6 ? &bad->r : k < 3 ? &bad->a[k] : &bad->b[k - 3]) = NO_NUMBER;
        lw_body_mark(&rig->placed, 3, rig->body.length[3]);
        lw_near_range(&query, &rig->list);
        lw_near_each(&query, each);
        lw_near_smallest(&query, &smallest);
        lw_near_self(&rig->body, &rig->placed, 0.1, &rig->list);
        int shown = 0;
        for (int i = 0; i < rig->list.count; i++) {
            const struct lw_near *near = &rig->list.pair[i];
            shown += isnan(near->distance.d);
            assert_true(!isnan(near->distance.d) || near->part == 3 || near->other == 3);
        }
        assert_int_equal(shown, 50 + 2); // every obstacle, and the self pairs of wrist 1
        assert_true(isnan(each[3].distance.d) && isnan(smallest.distance.d));
        assert_true(!isnan(each[2].distance.d));
        rig->placed = good;
    }
}

// --- self pairs ---

static void self_pairs_are_capsule_pairs(void **state)
{
    (void)state;
    struct near_rig *rig = near_rig(68);
    for (int n = 0; n < 300; n++) {
        const struct lw_tool tool = rig_tool(&rig->random, (enum lw_tool_kind)(n % 3));
        const double d_max = n % 4 ? 0.2 : 10;
        lw_body_make(LW_UR10, n % 2 ? LW_BODY_CAPSULES : LW_BODY_CAPSULES_FINE, &tool, &rig->body);
        rig_random_pose(rig, LW_UR10);
        rig->list.count = rig->list.needed = 2;
        lw_near_self(&rig->body, &rig->placed, d_max, &rig->list);
        int at = 2;
        for (int i = 0; i < rig->body.pair_count; i++) {
            const int part = rig->body.pair[i].part, other = rig->body.pair[i].other;
            const struct lw_shape link = lw_shape_of_capsule(&rig->placed.capsule[part]);
            struct lw_shape shape = lw_shape_of_capsule(&rig->placed.capsule[other]);
            if (tool.kind == LW_TOOL_HULL && other == rig->body.tool_part)
                shape = lw_body_tool_shape(&rig->body, &rig->placed);
            struct lw_distance expected;
            assert_int_equal(lw_distance_shapes(&link, &shape, &expected), LW_OK);
            if (expected.d > d_max)
                continue;
            const struct lw_near *near = &rig->list.pair[at++];
            assert_int_equal(near->part, part);
            assert_int_equal(near->other, other);
            assert_int_equal(near->obstacle, 0);
            assert_near(near->distance.d, expected.d, 1e-12);
            assert_near(lw_vec_norm(near->velocity), 0, 0);
            if (!(expected.flags & LW_DISTANCE_CORE))
                assert_true(lw_distance_shapes_gap(&link, &shape, &near->distance) < 1e-9);
        }
        assert_int_equal(rig->list.count, at);
        assert_int_equal(rig->list.needed, at);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(motions_and_jumps),       cmocka_unit_test(ids_that_are_used_again),
        cmocka_unit_test(ids_that_clash),          cmocka_unit_test(rubbish_in_the_table),
        cmocka_unit_test(the_table_is_of_use),     cmocka_unit_test(queries_allocate_nothing),
        cmocka_unit_test(what_is_no_number_shows), cmocka_unit_test(self_pairs_are_capsule_pairs),
    };
    return cmocka_run_group_tests_name("near_warm", tests, NULL, NULL);
}
