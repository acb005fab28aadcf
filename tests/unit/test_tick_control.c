// SPDX-License-Identifier: BSD-3-Clause
// Tests of the tick: when it is not in control (warm-up, waiting, another controller, a plant that ended), and how it
// says what became of the law.
//
// Units    metres, radians, seconds; ns where a name says so.
// Frames   base frame.
// Arrays   one entry a joint.
// Memory   static.
// Errors   cmocka's.
#include "base/vec.h" // lw_all_finite
#include "tick_rig.h" // tick, go

static const double step = 8 * 0.002; // rad/s, acceleration limit times period

// No joint is commanded further from a velocity than one tick allows.
static void check_near_velocity(const struct rig *rig, const double velocity[LW_NJ])
{
    for (int j = 0; j < LW_NJ; j++)
        assert_true(fabs(rig->out.qd[j] - velocity[j]) <= step + 1e-12);
}

// --- not in control yet ---

// Everything is computed and explained, and nothing may move for it; then the arm starts from rest.
static void the_warm_up_computes_and_moves_nothing(void **state)
{
    (void)state;
    static const double zero[LW_NJ] = {0};
    struct rig *rig = start();
    rig->joint.mode = LW_PLANT_HOLD;
    rig->warming_up = true;
    for (int k = 0; k < 250; k++) {
        go(rig);
        assert_int_equal(rig->out.mode, LW_COMMAND_IDLE);
        assert_int_equal(rig->out.flags, LW_WARMING_UP);
        assert_int_equal(rig->out.law_outcome, LW_LAW_OK);
        assert_true(fabs(rig->out.qd_law[0]) + fabs(rig->out.qd_law[1]) > 0);
        assert_true(rig->out.deviation > 0 && rig->out.tick == k + 1);
        assert_all_near(rig->out.qd, zero, LW_NJ, 0);
    }
    rig->warming_up = false;
    go(rig);
    assert_int_equal(rig->out.mode, LW_COMMAND_VELOCITY);
    assert_int_equal(rig->out.flags & LW_WARMING_UP, 0);
    check_near_velocity(rig, zero);
    assert_true(speed(rig) > 0);
}

// No joint state, no world, or neither: the same flag, and with the warm-up both.
static void it_waits_for_plant_and_world(void **state)
{
    (void)state;
    for (int missing = 1; missing < 4; missing++)
        for (int warming_up = 0; warming_up < 2; warming_up++) {
            struct rig *rig = start();
            if (missing & 1)
                rig->joint = (struct lw_joint_state){0};
            if (missing & 2)
                rig->world.version = 0;
            rig->warming_up = warming_up;
            tick(rig);
            assert_int_equal(rig->out.mode, LW_COMMAND_IDLE);
            assert_int_equal(rig->out.flags, LW_WAITING | (warming_up ? LW_WARMING_UP : 0));
            assert_true(lw_controller_at_rest(&rig->state));
        }
}

// A reason to brake is no reason to be idle: the plant must hear the ramp.
static void a_braking_command_is_a_command(void **state)
{
    (void)state;
    struct rig *rig = start();
    ask(rig, LW_REQUEST_STOP, OPERATOR, 1, 0);
    rig->age_ns = 30 * ms;
    rig->joint.command_session = OTHER;
    rig->joint.q[2] = NO_NUMBER;
    tick(rig);
    assert_int_equal(rig->out.flags, LW_STOPPED | LW_STALE | LW_FOREIGN | LW_NOT_FINITE);
    assert_int_equal(rig->out.mode, LW_COMMAND_VELOCITY);
}

// --- another controller ---

// The plant moves by another's commands: ours start at the velocity it has, each state anew, and brake.
static void a_foreign_controller_makes_it_brake(void **state)
{
    (void)state;
    struct rig *rig = start();
    struct random random = {75};
    go_for(rig, 100);
    rig->joint.command_session = OTHER;
    for (int k = 0; k < 100; k++) {
        random_fill(&random, -1, 1, rig->joint.qd, LW_NJ);
        rig->joint.stamp.seq++;
        tick(rig);
        assert_int_equal(rig->out.flags & ~(unsigned)LW_LIMIT_ACCELERATION, LW_FOREIGN);
        assert_int_equal(rig->out.mode, LW_COMMAND_VELOCITY);
        check_near_velocity(rig, rig->joint.qd);
        for (int j = 0; j < LW_NJ; j++)
            assert_true(fabs(rig->out.qd[j]) <= fabs(rig->joint.qd[j]));
    }
    // No newer state: it goes on to rest from its own last command, and stays there.
    for (int k = 0; k < 70; k++)
        tick(rig);
    assert_true(lw_controller_at_rest(&rig->state));
    assert_int_equal(rig->out.flags, LW_FOREIGN);
}

// Obeyed again, it starts from what it commanded last, not from what the other did.
static void after_the_foreign_controller_nothing_steps(void **state)
{
    (void)state;
    struct rig *rig = start();
    rig->joint.command_session = OTHER;
    for (int j = 0; j < LW_NJ; j++)
        rig->joint.qd[j] = 0.4;
    go_for(rig, 3);
    double last[LW_NJ];
    memcpy(last, rig->out.qd, sizeof last);
    rig->joint.command_session = CONTROLLER;
    go(rig);
    assert_int_equal(rig->out.flags & LW_FOREIGN, 0);
    check_near_velocity(rig, last);
}

// Whose command a plant obeyed last means nothing once it has stopped, nor does a controller without a number mind.
static void only_a_moving_plant_is_foreign(void **state)
{
    (void)state;
    const int64_t sessions[] = {0, OTHER, CONTROLLER, INT64_MAX};
    for (int mode = LW_PLANT_HOLD; mode <= LW_PLANT_ENDED; mode++)
        for (size_t i = 0; i < sizeof sessions / sizeof sessions[0]; i++) {
            struct rig *rig = start();
            rig->joint.mode = (enum lw_plant_mode)mode;
            rig->joint.command_session = sessions[i];
            tick(rig);
            const bool foreign = mode == LW_PLANT_MOVING && sessions[i] != CONTROLLER;
            assert_int_equal((rig->out.flags & LW_FOREIGN) != 0, foreign);
        }
}

// --- a plant that ended ---

// Its last state says at what velocity it went; nothing follows, and the command comes to rest from there.
static void a_plant_that_ended_is_let_go(void **state)
{
    (void)state;
    struct rig *rig = start();
    go_for(rig, 100);
    rig->joint.mode = LW_PLANT_ENDED;
    for (int j = 0; j < LW_NJ; j++)
        rig->joint.qd[j] = 0.1 * j - 0.2;
    tick(rig);
    check_near_velocity(rig, rig->joint.qd);
    assert_int_equal(rig->out.flags & LW_FOREIGN, 0);
    rig->age_ns = 21 * ms;
    double before = speed(rig);
    for (int k = 0; k < 30; k++, before = speed(rig)) {
        tick(rig); // the same state, older and older
        assert_int_equal(rig->out.flags & ~(unsigned)LW_LIMIT_ACCELERATION, LW_STALE);
        assert_true(speed(rig) <= before);
    }
    assert_true(lw_controller_at_rest(&rig->state));
    // The next plant is taken over at its own velocity.
    rig->age_ns = 0;
    rig->joint = (struct lw_joint_state){.stamp = {1, 2, PLANT + 1, 1}, .mode = LW_PLANT_HOLD, .period_ns = 2 * ms};
    tick(rig);
    assert_int_equal(rig->out.plant_session, PLANT + 1);
    check_near_velocity(rig, rig->joint.qd);
}

// --- what became of the law ---

static void the_outcome_of_the_law_is_named(void **state)
{
    (void)state;
    struct rig *rig = start();
    tick(rig);
    assert_int_equal(rig->out.law_outcome, LW_LAW_OK);
    assert_true(lw_all_finite(rig->out.qd_law, LW_NJ));

    // A configuration that is no number: there is nothing to ask about.
    rig->joint.q[1] = -HUGE_VAL;
    tick(rig);
    assert_int_equal(rig->out.law_outcome, LW_LAW_NOT_ASKED);
    assert_true(rig->out.flags & LW_NOT_FINITE);
    for (int j = 0; j < LW_NJ; j++)
        assert_true(isnan(rig->out.qd_law[j]));

    // A goal that is no number: the law was asked and has no answer.
    rig = start();
    go_for(rig, 100);
    ask(rig, LW_REQUEST_GOAL, OPERATOR, 1, NO_NUMBER);
    check_brakes_to_rest(rig, LW_NOT_FINITE);
    assert_int_equal(rig->out.law_outcome, LW_LAW_NO_NUMBER);
    assert_false(lw_all_finite(rig->out.qd_law, LW_NJ));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_warm_up_computes_and_moves_nothing),
        cmocka_unit_test(it_waits_for_plant_and_world),
        cmocka_unit_test(a_braking_command_is_a_command),
        cmocka_unit_test(a_foreign_controller_makes_it_brake),
        cmocka_unit_test(after_the_foreign_controller_nothing_steps),
        cmocka_unit_test(only_a_moving_plant_is_foreign),
        cmocka_unit_test(a_plant_that_ended_is_let_go),
        cmocka_unit_test(the_outcome_of_the_law_is_named),
    };
    return cmocka_run_group_tests_name("tick_control", tests, NULL, NULL);
}
