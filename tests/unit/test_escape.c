// SPDX-License-Identifier: BSD-3-Clause
// Tests of the remedies against standstill: the trap of five obstacles before a wall of forces (scene B), and what a
// roll-out may cost, keep and forget.
//
// Units    metres, radians, seconds; ns where a name says so.
// Frames   base frame.
// Arrays   one entry a joint.
// Memory   static: surroundings and snapshots are large.
// Errors   cmocka's.
#include "base/vec.h" // lw_vec_*
#include "controller/apf.h"
#include "controller/clearance.h"
#include "controller/escape.h"
#include "helpers.h"

static const int64_t ms = 1000000;

static struct lw_snapshot world;
static struct lw_surroundings around;
static struct lw_rooms rooms;
static int law_calls, law_work, law_last;

// The law of the product, counted, and what it costs by the near pairs it sees.
static void counted_step(const struct lw_law_params *params, const struct lw_law_input *in, double qd[LW_NJ])
{
    law_calls++;
    law_last = 1 + in->around->near.count / 64;
    law_work += law_last;
    lw_apf_law.step(params, in, qd);
}

// An arm that law, escape and guard move.
struct rig {
    struct lw_law law;
    struct lw_law_params params;
    struct lw_limits limits;
    struct lw_body body;
    struct lw_escape escape;
    double q[LW_NJ], velocity[LW_NJ], goal[3];
    int64_t period_ns, time_ns, ticks;
    // of the last tick
    double deviation, clearance;
    bool stuck;
};

static void put_points(const double (*at)[3], int count)
{
    const struct lw_solid point = {.kind = LW_SPHERE};
    lw_snapshot_begin(&world);
    for (int i = 0; i < count; i++) {
        const struct lw_pose pose = {.r = {1, 0, 0, 0, 1, 0, 0, 0, 1}, .p = {at[i][0], at[i][1], at[i][2]}};
        assert_int_equal(lw_snapshot_add(&world, i + 1, 1, &point, &pose, NULL), LW_OK);
    }
    lw_snapshot_end(&world);
}

static const double scene_b_points[5][3] = {
    {-.22, -.5, .14}, {-.26, -.65, .14}, {-.18, -.36, .14}, {-.22, -.5, .29}, {-.22, -.5, -.01}};

static struct rig scene_b(int remedy, int64_t period_ns)
{
    struct rig rig = {.law = lw_apf_law,
                      .params = {.apf = {.attraction = LW_ATTRACTION_CONE_PAR,
                                         .gamma = 2,
                                         .k_a = 1,
                                         .r0 = 0.05,
                                         .eta = 0.01,
                                         .rho_rep = 0.25,
                                         .distance_min = 0.005,
                                         .rho_self = 0.05},
                                 .remedy = {.kind = remedy, .axis = {0, 0, -1}, .circulation = 1}},
                      .limits = {.clearance = 0.01},
                      .q = {0, -0.9, 1.3, -0.4, 0, 0},
                      .goal = {0.21, -0.62, 0.175},
                      .period_ns = period_ns,
                      .time_ns = ms};
    rig.law.step = counted_step;
    for (int j = 0; j < LW_NJ; j++) {
        rig.limits.position_min[j] = -6.28;
        rig.limits.position_max[j] = 6.28;
        rig.limits.velocity[j] = 1.5;
        rig.limits.acceleration[j] = 8;
    }
    lw_body_make(LW_UR5, LW_BODY_JOINTS, NULL, &rig.body);
    lw_escape_reset(&rig.escape, &rig.params.remedy);
    put_points(scene_b_points, 5);
    return rig;
}

static void go(struct rig *rig)
{
    const double period_s = (double)rig->period_ns * 1e-9;
    const struct lw_guard_input motion = {.limits = &rig->limits, .period_s = period_s, .velocity = rig->velocity};
    double wish[LW_NJ], command[LW_NJ], to_goal[3];
    assert_int_equal(lw_surroundings_place(lw_arm_get(LW_UR5), &rig->body, rig->q, &around), LW_OK);
    const struct lw_law_reach reach = lw_clearance_reach(&motion, &rig->body, &around, 0);
    const struct lw_eyes eyes = {.body = &rig->body,
                                 .world = &world,
                                 .time_ns = rig->time_ns,
                                 .reach = fmax(rig->params.apf.rho_rep, reach.obstacles),
                                 .self_reach = reach.self};
    lw_surroundings_look(&eyes, &around);
    const double *tip = around.frame[LW_NJ - 1].p;
    const struct lw_law_input in = {
        .around = &around, .body = &rig->body, .goal = rig->goal, .circulation = rig->escape.circulation};
    lw_apf_law.step(&rig->params, &in, wish);
    lw_vec_sub(rig->goal, tip, to_goal);
    rig->deviation = lw_vec_norm(to_goal);
    const struct lw_near *nearest = lw_surroundings_nearest(&around, false);
    rig->clearance = nearest != NULL ? nearest->distance.d : HUGE_VAL;

    const struct lw_escape_model model = {.law = &rig->law,
                                          .params = &rig->params,
                                          .limits = &rig->limits,
                                          .arm = lw_arm_get(LW_UR5),
                                          .body = &rig->body};
    const struct lw_escape_now now = {
        .world = &world,
        .q = rig->q,
        .velocity = rig->velocity,
        .tip = tip,
        .goal = rig->goal,
        .deviation = rig->deviation,
        .tick = {.number = ++rig->ticks, .period_ns = rig->period_ns, .time_ns = rig->time_ns}};
    rig->stuck = lw_escape_step(&rig->escape, &model, &now);
    const struct lw_guard_input guard = {
        .limits = &rig->limits, .period_s = period_s, .q = rig->q, .velocity = rig->velocity, .wish = wish};
    lw_clearance_rooms(&rig->limits, reach, &rig->body, &around, &rooms);
    (void)lw_clearance_command(&guard, &rooms, command);
    for (int j = 0; j < LW_NJ; j++)
        rig->q[j] += period_s * command[j];
    memcpy(rig->velocity, command, sizeof command);
    rig->time_ns += rig->period_ns;
}

// Runs until the tip is within 1 cm of the goal; returns the seconds it took, infinite when it did not within 20.
static double time_to_goal(struct rig *rig)
{
    const int64_t start_ns = rig->time_ns;
    double nearest = HUGE_VAL;
    for (int64_t k = 0; k * rig->period_ns < 20000 * ms; k++) {
        go(rig);
        nearest = fmin(nearest, rig->clearance);
        assert_true(nearest > 0.1);
        if (rig->deviation < 0.01)
            return (double)(rig->time_ns - start_ns) * 1e-9;
    }
    return HUGE_VAL;
}

// Without a remedy the arm stands and says so; with roll-outs it is at its goal within 8 s, at any rate.
static void roll_outs_lead_out_of_scene_b(void **state)
{
    (void)state;
    struct rig plain = scene_b(LW_REMEDY_NONE, 8 * ms);
    assert_true(isinf(time_to_goal(&plain)));
    assert_true(plain.stuck);
    assert_near(plain.deviation, 0.6107, 1e-3);
    const int64_t periods_ns[] = {8 * ms, 2 * ms, ms};
    for (int i = 0; i < 3; i++) {
        struct rig rig = scene_b(LW_REMEDY_ROLLOUT, periods_ns[i]);
        assert_true(time_to_goal(&rig) < 8);
        assert_true(rig.escape.attempts == 1);
    }
}

// The vortex circulates from the first tick on about the axis that it was given, and never looks ahead.
static void the_vortex_is_always_on(void **state)
{
    (void)state;
    struct rig rig = scene_b(LW_REMEDY_VORTEX, 8 * ms);
    law_calls = 0;
    assert_true(time_to_goal(&rig) < 5);
    const double axis[3] = {0, 0, -1};
    assert_same_bits(rig.escape.circulation, axis, sizeof axis);
    assert_int_equal(law_calls, 0);
}

// A tick looks ahead by one step for every 50 us of its period, and only while it is stuck.
static void a_tick_looks_ahead_a_bounded_number_of_steps(void **state)
{
    (void)state;
    const int64_t periods_ns[] = {8 * ms, ms, ms / 5};
    const int most[] = {160, 20, 4};
    for (int i = 0; i < 3; i++) {
        struct rig rig = scene_b(LW_REMEDY_ROLLOUT, periods_ns[i]);
        int seen = 0;
        for (int64_t k = 0; k * periods_ns[i] < 3000 * ms && rig.escape.attempts == 0; k++) {
            law_calls = 0;
            go(&rig);
            assert_true(rig.stuck || law_calls == 0);
            assert_true(law_calls <= most[i]);
            seen += law_calls;
        }
        assert_int_equal(rig.escape.attempts, 1);
        assert_int_equal(seen, 17 * 625);
    }
}

// In a crowd, each point of scene B forty times as weak and forty times there, a step counts for more.
static void in_a_crowd_it_looks_ahead_by_fewer_steps(void **state)
{
    (void)state;
    static double crowd[200][3];
    struct rig rig = scene_b(LW_REMEDY_ROLLOUT, 8 * ms);
    for (int i = 0; i < 200; i++)
        memcpy(crowd[i], scene_b_points[i % 5], sizeof crowd[i]);
    put_points((const double (*)[3])crowd, 200);
    rig.params.apf.eta /= 40;
    int most = 0;
    for (int k = 0; k < 60 * 125 && rig.escape.attempts == 0; k++) {
        law_calls = law_work = law_last = 0;
        go(&rig);
        assert_true(law_work - law_last < 160);
        most = law_last > most ? law_last : most;
    }
    assert_int_equal(rig.escape.attempts, 1);
    assert_true(most > 3);
}

// Where no way helps there is no circulation in the end, and it tries again ever later.
static void nothing_is_done_where_nothing_helps(void **state)
{
    (void)state;
    struct rig rig = scene_b(LW_REMEDY_ROLLOUT, 8 * ms);
    rig.goal[0] = 3; // out of reach, nothing in the way
    put_points(NULL, 0);
    int64_t before_ns = 0, waits_ns[6] = {0};
    for (int k = 0; rig.escape.attempts < 6; k++) {
        const int attempts = rig.escape.attempts;
        go(&rig);
        if (rig.escape.attempts == attempts)
            continue;
        waits_ns[attempts] = rig.time_ns - before_ns;
        before_ns = rig.time_ns;
        assert_true(k < 10000);
    }
    for (int i = 2; i < 6; i++) {
        // A look ahead and the wait before it; longer where the arm first had to stand still again.
        const double least = 0.53 + 0.25 * fmin(1 << (i - 1), 8);
        assert_true((double)waits_ns[i] * 1e-9 > least - 0.05 && (double)waits_ns[i] * 1e-9 < least + 2);
    }
    for (int i = 0; i < 3; i++)
        assert_near(rig.escape.circulation[i], 0, 0);
}

// A brake ends the look ahead and keeps the direction found; a new goal forgets both.
static void brakes_keep_and_goals_forget(void **state)
{
    (void)state;
    struct rig rig = scene_b(LW_REMEDY_ROLLOUT, 8 * ms);
    while (rig.escape.rollout.candidate < 0)
        go(&rig);
    lw_escape_pause(&rig.escape);
    assert_int_equal(rig.escape.rollout.candidate, -1);
    assert_int_equal(rig.escape.stuck.since_ns, 0);
    while (rig.escape.attempts == 0)
        go(&rig);
    double found[3];
    memcpy(found, rig.escape.circulation, sizeof found);
    assert_true(lw_vec_norm(found) > 0);
    lw_escape_pause(&rig.escape);
    assert_same_bits(rig.escape.circulation, found, sizeof found);
    lw_escape_reset(&rig.escape, &rig.params.remedy);
    assert_near(lw_vec_norm(rig.escape.circulation), 0, 0);
    assert_int_equal(rig.escape.attempts, 0);
}

// At the goal nothing circulates any more.
static void it_ends_at_the_goal(void **state)
{
    (void)state;
    struct rig rig = scene_b(LW_REMEDY_ROLLOUT, 8 * ms);
    assert_true(time_to_goal(&rig) < 8);
    assert_near(lw_vec_norm(rig.escape.circulation), 0, 0);
    for (int k = 0; k < 1000; k++)
        go(&rig);
    assert_true(rig.deviation < 1e-4);
    assert_int_equal(rig.escape.attempts, 1);
}

// At its nearest to a goal out of reach the arm is stuck, and stays so while it stands: a way that leads nowhere is not
// taken, and begins nothing anew.
static void out_of_reach_it_is_stuck_for_good(void **state)
{
    (void)state;
    struct rig rig = scene_b(LW_REMEDY_ROLLOUT, 8 * ms);
    int standing = 0;
    put_points(NULL, 0);
    memcpy(rig.goal, (double[3]){1, 0, 0.4}, sizeof rig.goal);
    for (int k = 0; k < 40 * 125; k++) {
        const double before = rig.deviation;
        go(&rig);
        standing = k > 0 && fabs(rig.deviation - before) < 1e-5 ? standing + 1 : 0;
        if (standing > 125)
            assert_true(rig.stuck);
    }
    assert_true(standing > 1000);
    assert_true(rig.escape.attempts > 5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(out_of_reach_it_is_stuck_for_good),
                                       cmocka_unit_test(roll_outs_lead_out_of_scene_b),
                                       cmocka_unit_test(the_vortex_is_always_on),
                                       cmocka_unit_test(a_tick_looks_ahead_a_bounded_number_of_steps),
                                       cmocka_unit_test(in_a_crowd_it_looks_ahead_by_fewer_steps),
                                       cmocka_unit_test(nothing_is_done_where_nothing_helps),
                                       cmocka_unit_test(brakes_keep_and_goals_forget),
                                       cmocka_unit_test(it_ends_at_the_goal)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
