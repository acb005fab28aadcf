// SPDX-License-Identifier: BSD-3-Clause
// Moving and expiring obstacles: as if the world had been built anew at the later time; and the normal is the gradient
// of the distance through a motion of the joints and the obstacles.
//
// Units    metres, ns.
// Frames   base frame.
// Arrays   none.
// Memory   static.
// Errors   cmocka's.
#include "near_rig.h"

// Pose after turning with omega about its origin, and moving with v, by way of a quaternion.
static struct lw_pose moved(const struct told *told, double age)
{
    const struct lw_motion *m = &told->motion;
    const double rate = lw_vec_norm(m->omega), s = rate > 0 ? sin(0.5 * rate * age) / rate : 0;
    const double q[4] = {cos(0.5 * rate * age), s * m->omega[0], s * m->omega[1], s * m->omega[2]};
    struct lw_pose turn, out;
    assert_int_equal(lw_pose_make(told->pose.p, q, &turn), LW_OK);
    for (int i = 0; i < 3; i++) {
        out.p[i] = told->pose.p[i] + age * m->v[i];
        for (int k = 0; k < 3; k++)
            out.r[3 * i + k] = turn.r[3 * i] * told->pose.r[k] + turn.r[3 * i + 1] * told->pose.r[3 + k] +
                               turn.r[3 * i + 2] * told->pose.r[6 + k];
    }
    return out;
}

// Age that counts: told, not before it was seen, not more than half a second.
static double age_at(const struct lw_motion *motion, int64_t time_ns)
{
    return motion->time_ns == 0 ? 0 : fmin(0.5, fmax(0, 1e-9 * (double)(time_ns - motion->time_ns)));
}

// The world as it is at a time, of obstacles at rest; those that have expired are missing.
static void build_later(struct near_rig *rig, int64_t time_ns)
{
    lw_snapshot_begin(&rig->later);
    for (int i = 0; i < rig->count; i++) {
        const struct told *t = &rig->told[i];
        const struct lw_pose pose = moved(t, age_at(&t->motion, time_ns));
        if (t->motion.expires_ns == 0 || time_ns < t->motion.expires_ns)
            assert_int_equal(lw_snapshot_add(&rig->later, t->id, t->generation, &t->solid, &pose, NULL), LW_OK);
    }
    lw_snapshot_end(&rig->later);
}

static const struct lw_near *find_near(const struct lw_near_list *list, int part, uint32_t id)
{
    for (int i = 0; i < list->count; i++)
        if (list->pair[i].part == part && (uint32_t)list->pair[i].obstacle == id)
            return &list->pair[i];
    return NULL;
}

// Points, normal and velocity of a pair, against the shape where it is later.
static void check_result(const struct near_rig *rig, const struct lw_near *near, const struct lw_shape *shape,
                         int64_t time_ns)
{
    const struct lw_distance *d = &near->distance;
    const struct told *told = &rig->told[near->obstacle - 1];
    const struct lw_pose pose = moved(told, age_at(&told->motion, time_ns));
    double arm[3], turning[3];
    lw_vec_sub(d->pb, pose.p, arm);
    lw_vec_cross(told->motion.omega, arm, turning);
    for (int k = 0; k < 3; k++) {
        assert_near(d->pa[k] - d->pb[k], d->d * d->n[k], 1e-12);
        assert_near(near->velocity[k], told->motion.v[k] + turning[k], 1e-12);
    }
    // Both are on their surfaces, and the certificate holds where the shape is later.
    struct lw_distance on;
    const struct lw_shape part = lw_shape_of_capsule(&rig->placed.capsule[near->part]);
    struct lw_capsule point = {.r = 0};
    memcpy(point.a, d->pb, sizeof point.a);
    memcpy(point.b, d->pb, sizeof point.b);
    lw_distance_link(&point, shape, HUGE_VAL, NULL, &on);
    assert_near(on.d, 0, d->d < 0 ? -2 * d->d : 1e-9);
    if (shape->kind == LW_HALFSPACE)
        assert_all_near(d->n, shape->halfspace.m, 3, 1e-12);
    else if (near->part != rig->body.tool_part || rig->body.tool.kind != LW_TOOL_HULL)
        assert_true(lw_distance_shapes_gap(&part, shape, d) < 1e-9);
}

// Every pair of the later world, but for those on the verge of the range, is found with the same distance; no other is.
static int check_later(struct near_rig *rig, int64_t time_ns, double d_max)
{
    static struct lw_near each[LW_BODY_MAX];
    const struct lw_near_query query = rig_query(rig, time_ns, d_max);
    int found = 0;
    build_later(rig, time_ns);
    assert_int_equal(lw_snapshot_present(&rig->world, time_ns), rig->later.count);
    lw_near_range(&query, &rig->list);
    lw_near_each(&query, each);
    for (int part = 0; part < rig->body.count; part++) {
        double least = d_max;
        for (int i = 0; i < rig->later.count; i++) {
            const struct lw_distance expected = rig_distance(rig, &rig->later, part, i);
            const struct lw_shape shape = lw_snapshot_shape(&rig->later, i);
            const struct lw_near *near = find_near(&rig->list, part, shape.id);
            found += near != NULL;
            least = fmin(least, expected.d);
            if (fabs(expected.d - d_max) < 1e-9)
                continue;
            assert_int_equal(near != NULL, expected.d < d_max);
            if (near == NULL)
                continue;
            assert_near(near->distance.d, expected.d, 1e-12);
            if (!(expected.flags & LW_DISTANCE_CORE))
                check_result(rig, near, &shape, time_ns);
        }
        assert_near(each[part].distance.d, least, 1e-12);
    }
    assert_int_equal(found, rig->list.needed);
    return found;
}

static void later_is_as_built_anew(void **state)
{
    (void)state;
    static const enum lw_shape_kind kinds[5] = {LW_SPHERE, LW_CAPSULE, LW_BOX, LW_HULL, LW_HALFSPACE};
    struct near_rig *rig = near_rig(41);
    int found[5] = {0};
    for (int n = 0; n < 200; n++) {
        const struct lw_tool tool = rig_tool(&rig->random, (enum lw_tool_kind)(n % 3));
        lw_body_make(LW_UR10, LW_BODY_CAPSULES, &tool, &rig->body);
        rig->count = 0;
        for (int i = 0; i < 60; i++)
            rig_motion(&rig->random, SECOND + i * SECOND / 100, &rig_tell(rig, kinds[n % 5], 1.2)->motion);
        rig_build(rig, &rig->world);
        rig_random_pose(rig, LW_UR10);
        // Before it was seen, soon after, and when all stand still again.
        for (int64_t time_ns = SECOND / 2; time_ns <= 3 * SECOND; time_ns += SECOND / 4)
            found[n % 5] += check_later(rig, time_ns, 0.3);
    }
    for (int k = 0; k < 5; k++)
        assert_true(found[k] > 1000);
}

// Some move, some do not, some were not told when, some expire; many enough for several groups.
static void a_mixed_world_changes_with_time(void **state)
{
    (void)state;
    struct near_rig *rig = near_rig(42);
    lw_body_make(LW_UR5, LW_BODY_CAPSULES_FINE, NULL, &rig->body);
    for (int i = 0; i < 700; i++) {
        struct told *told = rig_tell(rig, i % 20 ? rig_kind(&rig->random) : LW_HALFSPACE, 1.2);
        if (i % 3 == 0)
            rig_motion(&rig->random, i % 4 ? SECOND : 0, &told->motion);
        // Far from what it turns about.
        for (int k = 0; k < 3 * told->solid.count && i % 2; k++)
            told->vertex[k] += 0.4;
        if (i % 5 == 0)
            told->motion.expires_ns = SECOND + random_below(&rig->random, 20) * (SECOND / 20);
    }
    rig_build(rig, &rig->world);
    int found = 0;
    for (int64_t time_ns = SECOND; time_ns <= 2 * SECOND; time_ns += SECOND / 20) {
        rig_random_pose(rig, LW_UR5);
        found += check_later(rig, time_ns, 0.1);
    }
    assert_true(found > 2000 && rig->list.needed <= LW_NEAR_MAX);
    assert_true(lw_snapshot_present(&rig->world, SECOND - 1) == 700);
    assert_int_equal(lw_snapshot_present(&rig->world, 3 * SECOND), 560);
}

// An obstacle that was not told when it was seen stays, but its velocity counts.
static void velocity_without_a_time(void **state)
{
    (void)state;
    struct near_rig *rig = near_rig(43);
    struct told *told = rig_tell(rig, LW_SPHERE, 0);
    told->motion = (struct lw_motion){.v = {1, 2, 3}};
    told->pose.p[0] = 0.5;
    lw_body_make(LW_UR5, LW_BODY_CAPSULES, NULL, &rig->body);
    rig_build(rig, &rig->world);
    rig_random_pose(rig, LW_UR5);
    struct lw_near now, later;
    struct lw_near_query query = rig_query(rig, SECOND, HUGE_VAL);
    lw_near_smallest(&query, &now);
    query.time_ns = 2 * SECOND;
    lw_near_smallest(&query, &later);
    assert_same_bits(&now.distance, &later.distance, sizeof now.distance);
    assert_all_near(now.velocity, told->motion.v, 3, 0);
}

// --- gradient ---

struct sample {
    double d, rate; // m; m/s by normal, points and velocities
    bool smooth;
};

// Distance of part 5 at q and a time, and how fast it changes when the joints move with qd.
static struct sample sample_at(struct near_rig *rig, const double q[LW_NJ], const double qd[LW_NJ], int64_t time_ns)
{
    struct lw_pose frame[LW_NJ];
    struct lw_near near[LW_BODY_MAX];
    double jacobian[18], speed[3];
    const int part = 4;
    assert_int_equal(lw_arm_fk(lw_arm_get(LW_UR10), q, frame), LW_OK);
    lw_body_place(&rig->body, frame, &rig->placed);
    struct lw_near_query query = rig_query(rig, time_ns, HUGE_VAL);
    query.warm = NULL;
    lw_near_each(&query, near);
    const struct lw_distance *d = &near[part].distance;
    lw_arm_point_jacobian(frame, rig->body.part[part].link, d->pa, jacobian);
    for (int k = 0; k < 3; k++) {
        speed[k] = -near[part].velocity[k];
        for (int j = 0; j < LW_NJ; j++)
            speed[k] += jacobian[LW_NJ * k + j] * qd[j];
    }
    // In a half-space the normal is good at any depth.
    const bool smooth = !(d->flags & LW_DISTANCE_CORE) || rig->told[0].solid.kind == LW_HALFSPACE;
    return (struct sample){d->d, lw_vec_dot(d->n, speed), smooth};
}

static void the_normal_is_the_gradient(void **state)
{
    (void)state;
    static const enum lw_shape_kind kinds[5] = {LW_SPHERE, LW_CAPSULE, LW_BOX, LW_HULL, LW_HALFSPACE};
    struct near_rig *rig = near_rig(44);
    int checked[5] = {0}, ridges = 0;
    const int64_t step_ns = 1000;
    lw_body_make(LW_UR10, LW_BODY_CAPSULES, NULL, &rig->body);
    for (int n = 0; n < 5000; n++) {
        double q[LW_NJ], qd[LW_NJ], at[3][LW_NJ];
        struct sample s[3];
        random_fill(&rig->random, -3, 3, q, LW_NJ);
        random_fill(&rig->random, -1, 1, qd, LW_NJ);
        rig->count = 0;
        struct told *told = rig_tell(rig, kinds[n % 5], 1.5);
        rig_motion(&rig->random, SECOND, &told->motion);
        rig_build(rig, &rig->world);
        for (int i = 0; i < 3; i++) {
            for (int j = 0; j < LW_NJ; j++)
                at[i][j] = q[j] + (i - 1) * 1e-9 * (double)step_ns * qd[j];
            s[i] = sample_at(rig, at[i], qd, SECOND + SECOND / 4 + (i - 1) * step_ns);
        }
        const double h = 1e-9 * (double)step_ns, slope = (s[2].d - s[0].d) / (2 * h);
        // Not on a ridge, where the slope before is another than the slope after.
        if (!s[1].smooth || fabs(s[2].d - 2 * s[1].d + s[0].d) > 1e-3 * h) {
            ridges++;
            continue;
        }
        assert_near(s[1].rate, slope, 1e-6 * fmax(1, fabs(slope)));
        checked[n % 5]++;
    }
    assert_true(ridges < 250);
    for (int k = 0; k < 5; k++)
        assert_true(checked[k] > 900);
}

// An obstacle that is no more hides no other, wherever the two stand in the snapshot.
static void an_expired_obstacle_hides_no_other(void **state)
{
    (void)state;
    struct near_rig *rig = near_rig(86);
    int nearer = 0;
    lw_body_make(LW_UR10, LW_BODY_CAPSULES, NULL, &rig->body);
    for (int n = 0; n < 200; n++) {
        struct lw_near smallest, each[LW_BODY_MAX];
        rig->count = 0;
        rig_random_pose(rig, LW_UR10);
        const struct told *living = rig_tell(rig, LW_SPHERE, 2);
        struct told *expired = rig_tell(rig, LW_SPHERE, 2);
        rig_build(rig, &rig->world);
        const struct lw_near_query query = {
            .body = &rig->body, .placed = &rig->placed, .world = &rig->world, .time_ns = SECOND, .d_max = HUGE_VAL};
        lw_near_smallest(&query, &smallest);
        nearer += smallest.obstacle == expired->id;
        expired->motion.expires_ns = SECOND;
        rig_build(rig, &rig->world);
        lw_near_smallest(&query, &smallest);
        lw_near_each(&query, each);
        assert_int_equal(smallest.obstacle, living->id);
        for (int part = 0; part < rig->body.count; part++)
            assert_int_equal(each[part].obstacle, living->id);
    }
    assert_true(nearer > 50);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_expired_obstacle_hides_no_other), cmocka_unit_test(later_is_as_built_anew),
        cmocka_unit_test(a_mixed_world_changes_with_time),    cmocka_unit_test(velocity_without_a_time),
        cmocka_unit_test(the_normal_is_the_gradient),
    };
    return cmocka_run_group_tests_name("near_motion", tests, NULL, NULL);
}
