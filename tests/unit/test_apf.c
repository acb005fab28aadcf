// SPDX-License-Identifier: BSD-3-Clause
// Tests of the potential field: forces are gradients of the stated potentials, joints follow them by J^T, and the
// paper's cases C1..C4 come out as they should.
//
// Units    metres, radians, seconds.
// Frames   base frame.
// Arrays   see controller/law.h.
// Memory   static where results are large.
// Errors   cmocka's.
#include "base/vec.h" // lw_vec_*
#include "controller/apf.h"
#include "helpers.h"
#include "simulator/batch.h"

static struct lw_apf_params params(int gamma, int attraction)
{
    return (struct lw_apf_params){.attraction = attraction,
                                  .gamma = gamma,
                                  .k_a = 1.5,
                                  .r0 = 0.05,
                                  .eta = 0.3,
                                  .rho_rep = 0.5,
                                  .distance_min = 0.005};
}

// Potentials as apf.md states them, equations (1) and (2).
static double attraction_potential(const struct lw_apf_params *p, double deviation)
{
    const bool inside = p->attraction == LW_ATTRACTION_CONE_PAR && deviation < p->r0;
    return p->k_a * (inside ? deviation * deviation / (2 * p->r0) + p->r0 / 2 : deviation);
}

static double repulsion_potential(const struct lw_apf_params *p, double d)
{
    return d <= p->rho_rep ? p->eta / 2 * pow(1 / d - 1 / p->rho_rep, p->gamma) : 0;
}

static double repulsion(const struct lw_apf_params *p, double d)
{
    const struct lw_apf_field field = lw_apf_field_of(p, false);
    return lw_apf_repulsion(&field, d);
}

// --- repulsion ---

// The size of the force is minus the slope of the potential, for both exponents, all the way to rho.
static void repulsion_is_minus_the_slope_of_its_potential(void **state)
{
    (void)state;
    struct random random = {51};
    for (int gamma = 1; gamma <= 2; gamma++)
        for (int n = 0; n < 1000; n++) {
            struct lw_apf_params p = params(gamma, LW_ATTRACTION_CONE);
            p.rho_rep = random_in(&random, 0.3, 3);
            const double d = random_in(&random, 0.01, 0.999 * p.rho_rep), h = 1e-4 * fmin(d, p.rho_rep - d);
            const double slope = (repulsion_potential(&p, d + h) - repulsion_potential(&p, d - h)) / (2 * h);
            const double scale = p.eta / (2 * d * d) * (gamma == 1 ? 1 : 2 * (1 / d - 1 / p.rho_rep));
            assert_near(repulsion(&p, d), -slope, 1e-6 * scale);
        }
}

// Beyond rho there is no force. At rho gamma 2 fades out, gamma 1 falls from eta / (2 rho^2) at once.
static void the_reach_of_the_repulsion(void **state)
{
    (void)state;
    const struct lw_apf_params one = params(1, 0), two = params(2, 0);
    const double rho = one.rho_rep;
    assert_near(repulsion(&one, rho), one.eta / (2 * rho * rho), 1e-15);
    assert_near(repulsion(&one, nextafter(rho, 1)), 0, 0);
    assert_near(repulsion(&two, rho), 0, 0);
    assert_near(repulsion(&two, nextafter(rho, 1)), 0, 0);
    assert_near(repulsion(&two, rho * (1 - 1e-9)), 0, 1e-8);
    assert_true(repulsion(&two, rho * (1 - 1e-9)) > 0);
}

// Nearer than distance_min counts as distance_min, down to and into the obstacle: the force stays bounded.
static void small_distances_are_clamped(void **state)
{
    (void)state;
    const double near[] = {0.00499, 1e-9, 0, -0.1, -5};
    for (int gamma = 1; gamma <= 2; gamma++) {
        const struct lw_apf_params p = params(gamma, 0);
        const double most = repulsion(&p, p.distance_min);
        const double expected =
            gamma == 1 ? p.eta / (2 * 0.005 * 0.005) : p.eta * (1 / 0.005 - 1 / p.rho_rep) / (0.005 * 0.005);
        assert_near(most, expected, 1e-12 * expected);
        assert_true(repulsion(&p, 0.00501) < most);
        for (size_t i = 0; i < sizeof near / sizeof near[0]; i++)
            assert_near(repulsion(&p, near[i]), most, 0);
    }
}

// Even where distance_min exceeds rho, an obstacle never pulls.
static void repulsion_never_pulls(void **state)
{
    (void)state;
    for (int gamma = 1; gamma <= 2; gamma++) {
        struct lw_apf_params p = params(gamma, 0);
        p.distance_min = 1;
        for (int cm = -100; cm < 200; cm++)
            assert_true(repulsion(&p, 0.01 * cm) >= 0);
    }
}

// --- attraction ---

// The force is minus the gradient of the potential, for the cone and for the cone with a parabolic tip.
static void attraction_is_minus_the_gradient_of_its_potential(void **state)
{
    (void)state;
    struct random random = {52};
    for (int n = 0; n < 2000; n++) {
        const struct lw_apf_params p = params(2, n % 2);
        const double goal[3] = {0.5, -0.6, 0.5}, size = n % 4 < 2 ? 0.04 : 1;
        double tip[3], force[3], gap[3];
        random_fill(&random, -size, size, tip, 3);
        lw_vec_add_scaled(1, goal, tip);
        lw_vec_sub(goal, tip, gap);
        if (lw_vec_norm(gap) < 0.005 || fabs(lw_vec_norm(gap) - p.r0) < 1e-4)
            continue; // no derivative there
        lw_apf_attraction(&p, tip, goal, force);
        for (int i = 0; i < 3; i++) {
            double ahead[3], behind[3];
            memcpy(ahead, gap, sizeof gap);
            memcpy(behind, gap, sizeof gap);
            ahead[i] -= 1e-6; // the tip goes ahead
            behind[i] += 1e-6;
            const double slope =
                (attraction_potential(&p, lw_vec_norm(ahead)) - attraction_potential(&p, lw_vec_norm(behind))) / 2e-6;
            assert_near(force[i], -slope, 1e-6 * p.k_a);
        }
    }
}

// The cone pulls with k_a everywhere; cone_par is the same outside r0, meets it at r0 and falls to nothing at the goal.
static void cone_and_cone_par_meet_at_r0(void **state)
{
    (void)state;
    const double goal[3] = {0}, share[] = {1e-6, 0.1, 0.5, 1 - 1e-12, 1, 1 + 1e-12, 2, 30};
    for (size_t i = 0; i < sizeof share / sizeof share[0]; i++) {
        const struct lw_apf_params cone = params(2, LW_ATTRACTION_CONE), par = params(2, LW_ATTRACTION_CONE_PAR);
        const double tip[3] = {0, -share[i] * par.r0, 0};
        double a[3], b[3];
        lw_apf_attraction(&cone, tip, goal, a);
        lw_apf_attraction(&par, tip, goal, b);
        assert_near(a[1], cone.k_a, 1e-15);
        assert_near(b[1], cone.k_a * fmin(1, share[i]), 1e-11);
        assert_true(a[0] == 0 && a[2] == 0 && b[0] == 0 && b[2] == 0);
    }
}

// On the goal, and within a picometre of it, there is no direction and no force.
static void no_force_at_the_goal(void **state)
{
    (void)state;
    const double goal[3] = {0.25, 0.5, 1}, beside[3] = {0.25, 0.5, 1 + 0.9e-12}, off[3] = {0.25, 0.5, 1 + 2e-12},
                 zero[3] = {0};
    for (int attraction = 0; attraction < 2; attraction++) {
        const struct lw_apf_params p = params(2, attraction);
        double force[3];
        lw_apf_attraction(&p, goal, goal, force);
        assert_all_near(force, zero, 3, 0);
        lw_apf_attraction(&p, beside, goal, force);
        assert_all_near(force, zero, 3, 0);
        lw_apf_attraction(&p, off, goal, force);
        assert_true(force[2] < 0);
    }
}

// --- joints ---

enum { BALLS_MAX = 5 };

struct scene_of_balls {
    enum lw_robot robot;
    struct lw_law_params law;
    double q[LW_NJ], goal[3];
    int count;
    double centre[BALLS_MAX][3], radius[BALLS_MAX]; // ids from 10
};

static struct lw_snapshot world;
static struct lw_surroundings around;

static void random_scene(struct random *random, struct scene_of_balls *s)
{
    *s = (struct scene_of_balls){.robot = (enum lw_robot)random_below(random, 2),
                                 .law = {.apf = params(1 + random_below(random, 2), random_below(random, 2))},
                                 .count = random_below(random, BALLS_MAX + 1)};
    s->law.apf.rho_rep = random_in(random, 0.2, 2);
    random_fill(random, -3, 3, s->q, LW_NJ);
    random_fill(random, -1, 1, s->goal, 3);
    for (int k = 0; k < s->count; k++) {
        s->radius[k] = random_in(random, 0, 0.2);
        random_fill(random, -1, 1, s->centre[k], 3);
    }
}

// The law at the scene's configuration; the nearest pair of all is in *nearest.
static void step(const struct scene_of_balls *s, double qd[LW_NJ], struct lw_near *nearest)
{
    static const double no_circulation[3] = {0};
    struct lw_body body;
    lw_body_make(s->robot, LW_BODY_JOINTS, NULL, &body);
    lw_snapshot_begin(&world);
    for (int k = 0; k < s->count; k++) {
        const struct lw_solid ball = {.kind = LW_SPHERE, .radius = s->radius[k]};
        struct lw_pose pose = {.r = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
        memcpy(pose.p, s->centre[k], sizeof pose.p);
        assert_int_equal(lw_snapshot_add(&world, 10 + k, 1, &ball, &pose, NULL), LW_OK);
    }
    lw_snapshot_end(&world);
    const struct lw_eyes eyes = {.body = &body, .world = &world, .reach = s->law.apf.rho_rep};
    assert_int_equal(lw_surroundings_place(lw_arm_get(s->robot), &body, s->q, &around), LW_OK);
    lw_surroundings_look(&eyes, &around);
    const struct lw_law_input in = {.around = &around, .body = &body, .goal = s->goal, .circulation = no_circulation};
    lw_law_get(LW_LAW_APF)->step(&s->law, &in, qd);
    const struct lw_near_query all = {.body = &body, .placed = &around.placed, .world = &world, .d_max = HUGE_VAL};
    lw_near_smallest(&all, nearest);
}

static void add_joint_effect(int link, const double force[3], double qd[LW_NJ])
{
    double jacobian[18];
    lw_arm_point_jacobian(around.frame, link, around.frame[link - 1].p, jacobian);
    for (int j = 0; j < LW_NJ; j++)
        for (int i = 0; i < 3; i++)
            qd[j] += jacobian[LW_NJ * i + j] * force[i];
}

// Equation (6) with explicit Jacobians of all six points; the nearest pair is that of points 2 to 6, as point 1 never
// moves.
static void joints_follow_the_sum_of_transposed_jacobians(void **state)
{
    (void)state;
    struct random random = {53};
    for (int n = 0; n < 500; n++) {
        static struct scene_of_balls s;
        double expected[LW_NJ] = {0}, force[3], scale = 1, qd[LW_NJ], smallest = HUGE_VAL;
        struct lw_near nearest;
        random_scene(&random, &s);
        step(&s, qd, &nearest);
        lw_apf_attraction(&s.law.apf, around.frame[5].p, s.goal, force);
        add_joint_effect(LW_NJ, force, expected);
        for (int k = 0; k < s.count; k++)
            for (int point = 1; point <= LW_NJ; point++) {
                double away[3], push[3] = {0};
                lw_vec_sub(around.frame[point - 1].p, s.centre[k], away);
                const double n_away = lw_vec_norm(away), d = n_away - s.radius[k];
                lw_vec_add_scaled(repulsion(&s.law.apf, d) / n_away, away, push);
                scale += lw_vec_norm(push);
                add_joint_effect(point, push, expected);
                smallest = point > 1 ? fmin(smallest, d) : smallest;
            }
        assert_all_near(qd, expected, LW_NJ, 1e-12 * scale);
        assert_near(nearest.distance.d, smallest, 0);
    }
}

// An obstacle on a control point, or around the whole arm, gives finite speeds.
static void an_obstacle_on_a_control_point_stays_finite(void **state)
{
    (void)state;
    struct random random = {54};
    for (int n = 0; n < 200; n++) {
        static struct scene_of_balls s;
        struct lw_pose frame[LW_NJ];
        struct lw_near nearest;
        double qd[LW_NJ];
        random_scene(&random, &s);
        s.count = 1;
        assert_int_equal(lw_arm_fk(lw_arm_get(s.robot), s.q, frame), LW_OK);
        memcpy(s.centre[0], frame[1 + n % 5].p, sizeof s.centre[0]);
        s.radius[0] = n % 3;
        step(&s, qd, &nearest);
        assert_true(lw_all_finite(qd, LW_NJ));
        assert_near(nearest.distance.d, -(n % 3), 0);
        assert_int_equal(nearest.part, n % 5);
    }
}

// --- the paper's cases ---

enum { ROWS = 1001 };

struct run {
    double t[ROWS], q[ROWS][LW_NJ], qd[ROWS][LW_NJ], tip[ROWS][3], deviation[ROWS], clearance[ROWS],
        self_clearance[ROWS];
    int flags[ROWS], outcome[ROWS];
};

static void run_case(int number, const char *const *set, int set_count, struct run *run)
{
    char path[512];
    struct lw_scene scene;
    struct lw_error error = {""};
    snprintf(path, sizeof path, "%s/c%d.yaml", LEEWAY_SCENARIOS, number);
    if (lw_scene_load(path, set, set_count, &scene, &error) != LW_OK)
        fail_msg("%s", error.text);
    assert_int_equal(lw_scene_steps(&scene) + 1, ROWS);
    const struct lw_batch_result result = {run->t,         &run->q[0][0],  &run->qd[0][0],      &run->tip[0][0],
                                           run->deviation, run->clearance, run->self_clearance, run->flags,
                                           run->outcome};
    assert_int_equal(lw_batch_run(&scene, &result), LW_OK);
}

// The field of C1 and C2 never acts: both are one run to the last bit, and it reaches the goal.
static void c1_and_c2_are_one_run(void **state)
{
    (void)state;
    static struct run one, two;
    run_case(1, NULL, 0, &one);
    run_case(2, NULL, 0, &two);
    assert_same_bits(&one, &two, sizeof one);
    assert_true(one.deviation[ROWS - 1] < 0.01);
}

// The farther the repulsion reaches, the farther from the goal the arm ends, for both exponents; no case comes nearer
// to the obstacle than 1.58 m nor is faster than 3.15 rad/s.
static void deviation_does_not_fall_with_rho(void **state)
{
    (void)state;
    static const char *const squared[] = {"law.gamma=2", "law.eta=20"};
    static const double expected[2][4] = {{0.00405, 0.00405, 0.242363, 0.469705},
                                          {0.00405, 0.00405, 0.099070, 0.589985}};
    for (int gamma = 1; gamma <= 2; gamma++) {
        double last = 0;
        for (int number = 1; number <= 4; number++) {
            static struct run run;
            run_case(number, squared, gamma == 2 ? 2 : 0, &run);
            assert_true(run.deviation[ROWS - 1] >= last);
            last = run.deviation[ROWS - 1];
            // C1 and C2 chatter about the goal; the others are smooth.
            assert_near(last, expected[gamma - 1][number - 1], number <= 2 ? 0.01 : 1e-6);
            for (int k = 0; k < ROWS; k++) {
                assert_true(run.clearance[k] >= 1.58);
                assert_int_equal(run.flags[k], 0);
                for (int j = 0; j < LW_NJ; j++)
                    assert_true(fabs(run.qd[k][j]) < 3.15);
            }
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(repulsion_is_minus_the_slope_of_its_potential),
        cmocka_unit_test(the_reach_of_the_repulsion),
        cmocka_unit_test(small_distances_are_clamped),
        cmocka_unit_test(repulsion_never_pulls),
        cmocka_unit_test(attraction_is_minus_the_gradient_of_its_potential),
        cmocka_unit_test(cone_and_cone_par_meet_at_r0),
        cmocka_unit_test(no_force_at_the_goal),
        cmocka_unit_test(joints_follow_the_sum_of_transposed_jacobians),
        cmocka_unit_test(an_obstacle_on_a_control_point_stays_finite),
        cmocka_unit_test(c1_and_c2_are_one_run),
        cmocka_unit_test(deviation_does_not_fall_with_rho),
    };
    return cmocka_run_group_tests_name("apf", tests, NULL, NULL);
}
