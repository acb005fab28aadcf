// SPDX-License-Identifier: BSD-3-Clause
// Snapshots: order, bounds, limits, copies, expiry.
//
// Units    metres, ns.
// Frames   base frame.
// Arrays   none.
// Memory   static.
// Errors   cmocka's.
#include "near_rig.h"

static enum lw_status add(struct lw_snapshot *world, const struct told *t)
{
    return lw_snapshot_add(world, t->id, t->generation, &t->solid, &t->pose, &t->motion);
}

// What was told i-th; i is within bounds.
static const struct told *told_at(const struct near_rig *rig, int i)
{
    return &rig->told[(unsigned)i % TOLD_MAX];
}

static struct near_rig *mixed(uint64_t seed, int count)
{
    struct near_rig *rig = near_rig(seed);
    for (int i = 0; i < count; i++) {
        struct told *told = rig_tell(rig, i % 9 ? rig_kind(&rig->random) : LW_HALFSPACE, 2);
        if (i % 4 == 0)
            rig_motion(&rig->random, SECOND + i, &told->motion);
        if (i % 6 == 0)
            told->motion.expires_ns = SECOND + random_below(&rig->random, 1000000);
    }
    return rig;
}

// Everything that queries see is equal, but for where vertices are kept.
static void check_equal(const struct lw_snapshot *a, const struct lw_snapshot *b)
{
    assert_int_equal(a->count, b->count);
    assert_int_equal(a->bounded, b->bounded);
    assert_int_equal(a->blocks, b->blocks);
    assert_int_equal(a->groups, b->groups);
    assert_int_equal(a->extrapolated, b->extrapolated);
    assert_int_equal(a->expiring, b->expiring);
    assert_near(a->speed_max, b->speed_max, 0);
    for (int i = 0; i < a->count; i++) {
        struct lw_snapshot_item x = a->item[i], y = b->item[i];
        const struct lw_shape sx = lw_snapshot_shape(a, i), sy = lw_snapshot_shape(b, i);
        if (sx.kind == LW_HULL)
            assert_same_bits(sx.hull.vertex, sy.hull.vertex, 3 * (size_t)sx.hull.padded * sizeof(double));
        x.vertex_at = y.vertex_at = 0;
        assert_same_bits(&x, &y, sizeof x);
    }
    const size_t spheres = (size_t)a->blocks * LW_WORLD_BLOCK * sizeof(float);
    assert_same_bits(a->sphere.x, b->sphere.x, spheres);
    assert_same_bits(a->sphere.r, b->sphere.r, spheres);
    assert_same_bits(a->expiry, b->expiry, (size_t)a->expiring * sizeof a->expiry[0]);
    for (int i = 0; i < LW_WORLD_BLOCKS + LW_WORLD_GROUPS; i++) {
        if (i >= a->groups * LW_WORLD_BLOCK && i < LW_WORLD_BLOCKS)
            continue;
        assert_same_bits(&a->box.x[i], &b->box.x[i], sizeof(float));
        assert_same_bits(&a->box.half[2][i], &b->box.half[2][i], sizeof(float));
        assert_near(a->box.speed[i], b->box.speed[i], 0);
        assert_true(a->box.time_ns[i] == b->box.time_ns[i]);
    }
}

static void the_order_of_adding_does_not_matter(void **state)
{
    (void)state;
    static const int counts[] = {1, 2, 16, 17, 300, 3000};
    for (size_t c = 0; c < sizeof counts / sizeof counts[0]; c++) {
        struct near_rig *rig = mixed(81 + c, counts[c]);
        rig_build(rig, &rig->world);
        lw_snapshot_begin(&rig->later);
        for (int i = rig->count - 1; i >= 0; i -= 2)
            assert_int_equal(add(&rig->later, told_at(rig, i)), LW_OK);
        for (int i = rig->count - 2; i >= 0; i -= 2)
            assert_int_equal(add(&rig->later, told_at(rig, i)), LW_OK);
        lw_snapshot_end(&rig->later);
        check_equal(&rig->world, &rig->later);
    }
}

// Every obstacle is there once; half-spaces stand last, each by id where keys are equal.
static void everything_is_kept(void **state)
{
    (void)state;
    static bool seen[TOLD_MAX + 1];
    struct near_rig *rig = mixed(82, 2000);
    rig_build(rig, &rig->world);
    memset(seen, 0, sizeof seen);
    uint32_t last = 0;
    for (int i = 0; i < rig->world.count; i++) {
        const struct lw_snapshot_item *item = &rig->world.item[i];
        assert_in_range(item->shape.id, 1, 2000);
        const struct told *told = told_at(rig, (int)item->shape.id - 1);
        assert_false(seen[item->shape.id]);
        seen[item->shape.id] = true;
        assert_int_equal(item->shape.kind, told->solid.kind);
        assert_int_equal(item->shape.generation, told->generation);
        assert_all_near(item->p, told->pose.p, 3, 0);
        assert_same_bits(&item->motion, &told->motion, sizeof told->motion);
        assert_int_equal(item->shape.kind == LW_HALFSPACE, i >= rig->world.bounded);
        if (i >= rig->world.bounded) {
            assert_true(item->shape.id > last);
            last = item->shape.id;
        }
    }
}

// Spheres hold their shapes, boxes their members, and neighbours stand together: blocks are small.
static void bounds_hold_what_they_bound(void **state)
{
    (void)state;
    struct near_rig *rig = mixed(83, 2500);
    rig_build(rig, &rig->world);
    const struct lw_snapshot *w = &rig->world;
    double size = 0;
    for (int i = 0; i < w->bounded; i++) {
        const double centre[3] = {(double)w->sphere.x[i], (double)w->sphere.y[i], (double)w->sphere.z[i]};
        double apart[3];
        lw_vec_sub(w->item[i].shape.c, centre, apart);
        assert_true(lw_vec_norm(apart) + w->item[i].shape.bound < (double)w->sphere.r[i]);
        const int boxes[2] = {i / LW_WORLD_BLOCK, LW_WORLD_BLOCKS + i / LW_WORLD_BLOCK / LW_WORLD_BLOCK};
        for (int b = 0; b < 2; b++) {
            const int at = boxes[b];
            const double middle[3] = {(double)w->box.x[at], (double)w->box.y[at], (double)w->box.z[at]};
            for (int k = 0; k < 3; k++)
                assert_true(fabs(w->item[i].shape.c[k] - middle[k]) + w->item[i].shape.bound <
                            (double)w->box.half[k][at]);
            if (!(w->item[i].traits & LW_TRAIT_EXTRAPOLATED))
                continue;
            assert_true(w->box.speed[at] >= w->item[i].speed);
            assert_true(w->box.time_ns[at] <= w->item[i].motion.time_ns);
        }
    }
    for (int i = 0; i < w->blocks; i++)
        size += (double)w->box.half[0][i] / w->blocks;
    assert_true(size < 0.8); // of 2
}

static void no_point_is_faster_than_speed_max(void **state)
{
    (void)state;
    for (int n = 0; n < 300; n++) {
        struct near_rig *rig = near_rig(84 + (uint64_t)n);
        struct told *told = rig_tell(rig, n % 9 ? rig_kind(&rig->random) : LW_HALFSPACE, 1);
        rig_motion(&rig->random, n % 2 ? SECOND : 0, &told->motion);
        rig_build(rig, &rig->world);
        const struct lw_shape shape = lw_snapshot_shape(&rig->world, 0);
        double fastest = 0;
        // Points on the surface: the nearest ones to points around it.
        for (int i = 0; i < 200; i++) {
            struct lw_capsule probe = {.r = 0};
            struct lw_distance found;
            double arm[3], speed[3];
            random_fill(&rig->random, -1.5, 1.5, probe.a, 3);
            memcpy(probe.b, probe.a, sizeof probe.b);
            lw_distance_link(&probe, &shape, HUGE_VAL, NULL, &found);
            if (found.flags & LW_DISTANCE_CORE || lw_vec_norm(found.pb) > 3)
                continue;
            lw_vec_sub(found.pb, told->pose.p, arm);
            lw_vec_cross(told->motion.omega, arm, speed);
            lw_vec_add_scaled(1, told->motion.v, speed);
            fastest = fmax(fastest, lw_vec_norm(speed));
        }
        assert_true(fastest <= rig->world.speed_max);
        if (shape.kind == LW_SPHERE) // no more than its rim
            assert_true(rig->world.speed_max <
                        1e-12 + lw_vec_norm(told->motion.v) + lw_vec_norm(told->motion.omega) * shape.r);
    }
}

static void copies_are_snapshots_of_their_own(void **state)
{
    (void)state;
    static struct lw_snapshot bytes;
    struct near_rig *rig = mixed(85, 700);
    rig_build(rig, &rig->world);
    rig->world.version = 5;
    rig->world.digest = 77;
    rig->world.last.seq = 9;
    memset(&rig->later, 0xa5, sizeof rig->later);
    lw_snapshot_copy(&rig->world, &rig->later);
    memcpy(&bytes, &rig->world, sizeof bytes);
    // The original is no more.
    memset(&rig->world, 0x5a, sizeof rig->world);
    lw_snapshot_begin(&rig->world);
    rig_build(rig, &rig->world);
    check_equal(&rig->later, &rig->world);
    check_equal(&bytes, &rig->world);
    assert_true(rig->later.version == 5 && rig->later.digest == 77 && rig->later.last.seq == 9);
    assert_true(rig->world.version == 0 && rig->world.digest == 0 && rig->world.last.seq == 0);
    for (int i = 0; i < rig->later.count; i++) {
        const struct lw_shape shape = lw_snapshot_shape(&rig->later, i);
        if (shape.kind == LW_HULL)
            assert_true(shape.hull.vertex >= rig->later.arena &&
                        shape.hull.vertex < rig->later.arena + 3 * LW_WORLD_VERTICES);
    }
}

enum { WAYS = 11 };

// An obstacle made bad in one of the ways.
static void spoil(struct told *bad, int way)
{
    const int k = way % 3;
    bad->solid.vertex = bad->vertex;
    switch (way) {
    case 0: bad->id = 0; break;
    case 1: bad->id = -3; break;
    case 2: bad->motion.v[k] = HUGE_VAL; break;
    case 3: bad->motion.omega[k] = NO_NUMBER; break;
    case 4: bad->motion.time_ns = -1; break;
    case 5: bad->motion.expires_ns = -1; break;
    case 6: bad->pose.p[k] = NO_NUMBER; break;
    case 7: bad->pose.r[4] += 0.5; break;
    case 8: bad->solid.kind = LW_SHAPE_KINDS; break;
    default:
        bad->solid.kind = LW_HULL;
        bad->solid.count = way == 9 ? 0 : LW_HULL_MAX + 1;
        break;
    }
}

// What is refused leaves the snapshot as it was.
static void hostile_obstacles_are_refused(void **state)
{
    (void)state;
    struct near_rig *rig = mixed(86, 20);
    for (int way = 0; way < WAYS; way++) {
        lw_snapshot_begin(&rig->later);
        for (int i = 0; i < 20; i++) {
            struct told bad = rig->told[i];
            spoil(&bad, way);
            assert_int_equal(add(&rig->later, told_at(rig, i)), LW_OK);
            assert_int_not_equal(add(&rig->later, &bad), LW_OK);
        }
        lw_snapshot_end(&rig->later);
        rig_build(rig, &rig->world);
        check_equal(&rig->world, &rig->later);
    }
}

static void it_is_full_at_its_limits(void **state)
{
    (void)state;
    struct near_rig *rig = near_rig(87);
    struct told *told = rig_tell(rig, LW_SPHERE, 1);
    lw_snapshot_begin(&rig->world);
    for (int i = 0; i < LW_WORLD_MAX; i++) {
        random_fill(&rig->random, -2, 2, told->pose.p, 3);
        told->id = LW_WORLD_MAX - i;
        assert_int_equal(add(&rig->world, told), LW_OK);
    }
    told->id++;
    assert_int_equal(add(&rig->world, told), LW_E_FULL);
    lw_snapshot_end(&rig->world);
    assert_int_equal(rig->world.count, LW_WORLD_MAX);
    assert_int_equal(rig->world.blocks, 625);
    assert_int_equal(rig->world.groups, 40);
    // Vertices run out before obstacles do.
    struct told *hull = rig_tell(rig, LW_HULL, 1);
    hull->solid.count = LW_HULL_MAX;
    random_fill(&rig->random, -0.1, 0.1, hull->vertex, 3 * LW_HULL_MAX);
    lw_snapshot_begin(&rig->world);
    for (int i = 0; i < LW_WORLD_VERTICES / LW_HULL_MAX; i++) {
        hull->id = 1 + i;
        assert_int_equal(add(&rig->world, hull), LW_OK);
    }
    assert_int_equal(add(&rig->world, hull), LW_E_FULL);
    assert_int_equal(rig->world.vertices, LW_WORLD_VERTICES);
}

static void obstacles_expire(void **state)
{
    (void)state;
    struct near_rig *rig = mixed(88, 1000);
    rig_build(rig, &rig->world);
    for (int n = 0; n < 100; n++) {
        const int64_t time_ns = SECOND + random_below(&rig->random, 1100000) - 50000;
        int present = 0;
        for (int i = 0; i < rig->count; i++)
            present += rig->told[i].motion.expires_ns == 0 || time_ns < rig->told[i].motion.expires_ns;
        assert_int_equal(lw_snapshot_present(&rig->world, time_ns), present);
    }
    lw_snapshot_begin(&rig->world);
    lw_snapshot_end(&rig->world);
    assert_int_equal(lw_snapshot_present(&rig->world, SECOND), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_order_of_adding_does_not_matter),
        cmocka_unit_test(everything_is_kept),
        cmocka_unit_test(bounds_hold_what_they_bound),
        cmocka_unit_test(no_point_is_faster_than_speed_max),
        cmocka_unit_test(copies_are_snapshots_of_their_own),
        cmocka_unit_test(hostile_obstacles_are_refused),
        cmocka_unit_test(it_is_full_at_its_limits),
        cmocka_unit_test(obstacles_expire),
    };
    return cmocka_run_group_tests_name("snapshot", tests, NULL, NULL);
}
