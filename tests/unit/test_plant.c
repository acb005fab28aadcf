// SPDX-License-Identifier: BSD-3-Clause
// Tests of the plant: whom it obeys, when it gives up, and that it moves exactly as commanded within its limits.
//
// Units    radians, seconds; ns where a name says so.
// Frames   none.
// Arrays   one entry a joint.
// Memory   stack.
// Errors   cmocka's.
#include "helpers.h"
#include "simulator/plant.h"

enum { PLANT = 100, FIRST = 7, SECOND = 8 };

struct rig {
    struct lw_plant plant;
    struct lw_plant_state arm;
};

static struct rig start_with(double velocity, double acceleration)
{
    struct rig rig;
    struct lw_scene scene = lw_scene_defaults(LW_UR5);
    scene.plant.rate_hz = 500;
    for (int j = 0; j < LW_NJ; j++) {
        scene.plant.velocity[j] = velocity;
        scene.plant.acceleration[j] = acceleration;
        scene.q0[j] = 0.1 * j;
    }
    lw_plant_init(&rig.plant, &rig.arm, &scene, PLANT);
    return rig;
}

static struct rig start(void)
{
    return start_with(3, 15);
}

static struct lw_joint_command command(int64_t session, int64_t seq, double qd)
{
    return (struct lw_joint_command){.stamp = {.session = session, .seq = seq},
                                     .plant_session = PLANT,
                                     .mode = LW_COMMAND_VELOCITY,
                                     .qd = {qd, -qd, qd / 2, 0, qd, -qd}};
}

static void accept(struct rig *rig, int64_t session, int64_t seq, double qd, int64_t now_ns)
{
    const struct lw_joint_command c = command(session, seq, qd);
    lw_plant_obey(&rig->arm, &c, now_ns);
}

// --- commands ---

static void an_accepted_command_is_in_force(void **state)
{
    (void)state;
    struct rig rig = start();
    const struct lw_joint_command c = command(FIRST, 41, 0.5);
    lw_plant_obey(&rig.arm, &c, 777);
    assert_int_equal(rig.arm.mode, LW_PLANT_MOVING);
    assert_int_equal(rig.arm.command_session, FIRST);
    assert_int_equal(rig.arm.command_seq, 41);
    assert_int_equal(rig.arm.command_ns, 777);
    assert_all_near(rig.arm.target, c.qd, LW_NJ, 0);
}

// --- timeout ---

// At the timeout the command still holds; one nanosecond later it does not.
static void the_timeout_is_exact_to_the_nanosecond(void **state)
{
    (void)state;
    for (int64_t over = -1; over <= 1; over++) {
        struct rig rig = start();
        accept(&rig, FIRST, 1, 0.5, 1000);
        assert_int_equal(rig.plant.timeout_ns, 20000000);
        lw_plant_step(&rig.plant, &rig.arm, 1000 + rig.plant.timeout_ns + over);
        assert_int_equal(rig.arm.mode, over > 0 ? LW_PLANT_STOPPING : LW_PLANT_MOVING);
        assert_int_equal(lw_plant_at_rest(&rig.arm), over > 0);
    }
}

// After the last command the arm is at rest within timeout + v/a + 1 tick, having braked at full acceleration.
static void it_comes_to_rest_when_commands_cease(void **state)
{
    (void)state;
    struct random random = {61};
    for (int n = 0; n < 200; n++) {
        struct rig rig = start_with(3, random_in(&random, 2, 30));
        const double v = random_in(&random, 0.1, 3), a = rig.plant.acceleration[0];
        int64_t now = 0, ticks = 0;
        for (; fabs(rig.arm.qd[0] - v) > 0; now += rig.plant.period_ns) {
            accept(&rig, FIRST, 1 + now, v, now);
            lw_plant_step(&rig.plant, &rig.arm, now);
        }
        const double allowed_s = 0.02 + v / a + rig.plant.period_s;
        for (; !lw_plant_at_rest(&rig.arm); now += rig.plant.period_ns, ticks++) {
            assert_true(ticks < 10000);
            lw_plant_step(&rig.plant, &rig.arm, now);
        }
        assert_true((double)ticks * rig.plant.period_s <= allowed_s + 1e-9);
        assert_true((double)ticks * rig.plant.period_s >= v / a - 1e-9);
        const struct lw_plant_state rest = rig.arm;
        lw_plant_step(&rig.plant, &rig.arm, now);
        assert_all_near(rig.arm.q, rest.q, LW_NJ, 0);
        assert_int_equal(rig.arm.mode, LW_PLANT_STOPPING);
    }
}

// --- motion ---

// Before the first command time does not count and nothing moves.
static void it_holds_before_the_first_command(void **state)
{
    (void)state;
    struct rig rig = start();
    struct rig before;
    memcpy(&before, &rig, sizeof before); // padding too
    for (int64_t k = 0; k < 100; k++)
        lw_plant_step(&rig.plant, &rig.arm, k * 1000000000);
    assert_same_bits(&rig, &before, sizeof rig);
    for (int j = 0; j < LW_NJ; j++)
        assert_near(rig.arm.q[j], 0.1 * j, 0);
}

// Without limits the velocity is the command and the step is period * velocity, to the last bit.
static void without_limits_it_follows_exactly(void **state)
{
    (void)state;
    struct random random = {62};
    struct rig rig = start_with(HUGE_VAL, HUGE_VAL);
    double q[LW_NJ];
    memcpy(q, rig.arm.q, sizeof q);
    for (int64_t k = 1; k <= 1000; k++) {
        struct lw_joint_command c = command(FIRST, k, 0);
        random_fill(&random, -50, 50, c.qd, LW_NJ);
        lw_plant_obey(&rig.arm, &c, 0);
        lw_plant_step(&rig.plant, &rig.arm, 0);
        for (int j = 0; j < LW_NJ; j++)
            q[j] += 0.002 * c.qd[j];
        assert_same_bits(rig.arm.qd, c.qd, sizeof c.qd);
        assert_same_bits(rig.arm.q, q, sizeof q);
        assert_int_equal(rig.arm.tick, k);
    }
}

// Any commands: no step exceeds a limit, and each joint goes as near to its command as the limits allow.
static void limits_hold_and_are_used(void **state)
{
    (void)state;
    struct random random = {63};
    struct rig rig = start();
    random_fill(&random, 0.5, 3, rig.plant.velocity, LW_NJ);
    random_fill(&random, 1, 20, rig.plant.acceleration, LW_NJ);
    rig.plant.velocity[4] = rig.plant.acceleration[2] = HUGE_VAL;
    for (int64_t k = 1; k <= 5000; k++) {
        const struct lw_plant_state before = rig.arm;
        struct lw_joint_command c = command(FIRST, k, 0);
        random_fill(&random, -6, 6, c.qd, LW_NJ);
        if (k % 7 == 0) // now and then commands cease
            lw_plant_stop(&rig.arm);
        else
            lw_plant_obey(&rig.arm, &c, 0);
        lw_plant_step(&rig.plant, &rig.arm, 0);
        for (int j = 0; j < LW_NJ; j++) {
            const double target = k % 7 ? c.qd[j] : 0, top = rig.plant.velocity[j];
            const double wanted = target > top ? top : target < -top ? -top : target;
            const double reach = rig.plant.acceleration[j] * rig.plant.period_s, way = wanted - before.qd[j];
            const double expected = fabs(way) <= reach ? wanted : before.qd[j] + (way > 0 ? reach : -reach);
            assert_near(rig.arm.qd[j], expected, 1e-15);
            assert_near(rig.arm.q[j], before.q[j] + rig.plant.period_s * rig.arm.qd[j], 0);
        }
    }
}

// Stop ramps down from the next step on; it does not end the hold, nor the right to command again.
static void stop_ramps_to_rest_until_commanded_again(void **state)
{
    (void)state;
    struct rig rig = start();
    lw_plant_stop(&rig.arm);
    assert_int_equal(rig.arm.mode, LW_PLANT_HOLD);
    accept(&rig, FIRST, 1, 0.06, 0);
    lw_plant_step(&rig.plant, &rig.arm, 0);
    lw_plant_step(&rig.plant, &rig.arm, 0);
    assert_near(rig.arm.qd[0], 0.06, 1e-15);
    lw_plant_stop(&rig.arm);
    assert_int_equal(rig.arm.mode, LW_PLANT_STOPPING);
    lw_plant_step(&rig.plant, &rig.arm, 0);
    assert_near(rig.arm.qd[0], 0.03, 1e-15);
    accept(&rig, FIRST, 2, 0.06, 0);
    lw_plant_step(&rig.plant, &rig.arm, 0);
    assert_near(rig.arm.qd[0], 0.06, 1e-15);
    assert_int_equal(rig.arm.mode, LW_PLANT_MOVING);
}

static void any_moving_joint_is_not_rest(void **state)
{
    (void)state;
    struct rig rig = start();
    assert_true(lw_plant_at_rest(&rig.arm));
    for (int j = 0; j < LW_NJ; j++) {
        rig.arm.qd[j] = -1e-300;
        assert_false(lw_plant_at_rest(&rig.arm));
        rig.arm.qd[j] = -0.0;
    }
    assert_true(lw_plant_at_rest(&rig.arm));
}

// --- end ---

// A plant that ended says so, at the velocity it last had; a stop is no way back to life.
static void a_plant_that_ended_says_so(void **state)
{
    (void)state;
    struct rig rig = start();
    struct lw_joint_state report;
    accept(&rig, FIRST, 1, 0.06, 0);
    lw_plant_step(&rig.plant, &rig.arm, 0);
    rig.arm.mode = LW_PLANT_ENDED;
    lw_plant_report(&rig.plant, &rig.arm, &report);
    assert_int_equal(report.mode, LW_PLANT_ENDED);
    assert_near(report.qd[0], 0.03, 1e-15);
    lw_plant_stop(&rig.arm);
    assert_int_equal(rig.arm.mode, LW_PLANT_ENDED);
    // Stepped all the same, it ramps to rest and stays ended.
    for (int k = 0; k < 5; k++)
        lw_plant_step(&rig.plant, &rig.arm, 0);
    assert_true(lw_plant_at_rest(&rig.arm));
    assert_int_equal(rig.arm.mode, LW_PLANT_ENDED);
}

// --- set-up and report ---

// Period and timeout come from the plant's own rate, whatever the controller's.
static void the_plant_has_its_own_rate(void **state)
{
    (void)state;
    struct lw_scene scene = lw_scene_defaults(LW_UR10);
    struct rig rig;
    scene.rate_hz = 125;
    scene.plant.rate_hz = 500;
    scene.plant.timeout_s = 0.0333;
    scene.plant.velocity[3] = 0.7;
    scene.plant.acceleration[4] = 0.9;
    lw_plant_init(&rig.plant, &rig.arm, &scene, PLANT);
    assert_int_equal(rig.plant.period_ns, 2000000);
    assert_near(rig.plant.period_s, 0.002, 0);
    assert_int_equal(rig.plant.timeout_ns, 33300000);
    assert_near(rig.plant.velocity[3], 0.7, 0);
    assert_near(rig.plant.acceleration[4], 0.9, 0);
    assert_int_equal(lw_scene_plant_ratio(&scene), 4);
}

static void the_report_is_the_state(void **state)
{
    (void)state;
    struct rig rig = start();
    struct lw_joint_state report;
    accept(&rig, FIRST, 3, 0.5, 0);
    for (int k = 0; k < 5; k++)
        lw_plant_step(&rig.plant, &rig.arm, 0);
    memset(&report, 0x5a, sizeof report);
    lw_plant_report(&rig.plant, &rig.arm, &report);
    assert_int_equal(report.stamp.session, PLANT);
    assert_int_equal(report.mode, LW_PLANT_MOVING);
    assert_int_equal(report.command_session, FIRST);
    assert_int_equal(report.command_seq, 3);
    assert_int_equal(report.tick, 5);
    assert_int_equal(report.period_ns, 2000000);
    assert_same_bits(report.q, rig.arm.q, sizeof report.q);
    assert_same_bits(report.qd, rig.arm.qd, sizeof report.qd);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_accepted_command_is_in_force),
        cmocka_unit_test(the_timeout_is_exact_to_the_nanosecond),
        cmocka_unit_test(it_comes_to_rest_when_commands_cease),
        cmocka_unit_test(it_holds_before_the_first_command),
        cmocka_unit_test(without_limits_it_follows_exactly),
        cmocka_unit_test(limits_hold_and_are_used),
        cmocka_unit_test(stop_ramps_to_rest_until_commanded_again),
        cmocka_unit_test(any_moving_joint_is_not_rest),
        cmocka_unit_test(a_plant_that_ended_says_so),
        cmocka_unit_test(the_plant_has_its_own_rate),
        cmocka_unit_test(the_report_is_the_state),
    };
    return cmocka_run_group_tests_name("plant", tests, NULL, NULL);
}
