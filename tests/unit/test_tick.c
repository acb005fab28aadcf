// SPDX-License-Identifier: BSD-3-Clause
// Tests of the tick: what it waits for, whom it obeys, when it brakes, and that its explanation is true.
//
// Units    metres, radians, seconds; ns where a name says so.
// Frames   base frame.
// Arrays   one entry a joint.
// Memory   static.
// Errors   cmocka's.
#include "base/vec.h" // lw_vec_*
#include "bus/wire.h" // lw_wire_encode
#include "tick_rig.h" // tick, go

static const double zero[LW_NJ] = {0};

// --- init ---

static void init_refuses_unknown_robots_and_laws(void **state)
{
    (void)state;
    struct lw_controller config, config_before;
    struct lw_controller_state s, s_before;
    memset(&config, 0x5a, sizeof config);
    memset(&s, 0x5a, sizeof s);
    memcpy(&config_before, &config, sizeof config);
    memcpy(&s_before, &s, sizeof s);
    const int bad[][2] = {{-1, 0}, {LW_ROBOT_COUNT, 0}, {0, -1}, {0, 1}};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct lw_scene scene = lw_scene_defaults(LW_UR5);
        scene.robot = bad[i][0];
        scene.law.name = bad[i][1];
        assert_int_equal(lw_controller_init(&config, &s, &scene, CONTROLLER), LW_E_ARGUMENT);
        assert_same_bits(&config, &config_before, sizeof config);
        assert_same_bits(&s, &s_before, sizeof s);
    }
}

// --- waiting ---

// Before the first obstacle message nothing moves and the command says so; an empty world that was heard of is enough.
static void it_waits_for_the_world(void **state)
{
    (void)state;
    struct rig *rig = start();
    rig->world.version = 0;
    for (int k = 0; k < 5; k++) {
        go(rig);
        assert_int_equal(rig->out.mode, LW_COMMAND_IDLE);
        assert_int_equal(rig->out.flags, LW_WAITING);
        assert_all_near(rig->out.qd, zero, LW_NJ, 0);
    }
    rig->world.version = 1;
    go(rig);
    assert_int_equal(rig->out.mode, LW_COMMAND_VELOCITY);
    assert_int_equal(rig->out.flags & LW_WAITING, 0);
    assert_true(speed(rig) > 0);
}

// --- requests ---

// The scene's goal until a GOAL comes, then that one, echoed by session and seq.
static void the_newest_goal_is_in_force(void **state)
{
    (void)state;
    struct rig *rig = start();
    go(rig);
    assert_all_near(rig->out.goal, rig->scene.goal, 3, 0);
    assert_int_equal(rig->out.request.session, 0);
    for (int64_t seq = 1; seq <= 3; seq++) {
        ask(rig, LW_REQUEST_GOAL, OPERATOR, seq, 0.1 * (double)seq);
        go(rig);
        assert_all_near(rig->out.goal, rig->request.goal, 3, 0);
        assert_true(rig->out.request.session == OPERATOR && rig->out.request.seq == seq);
    }
    ask(rig, LW_REQUEST_GOAL, OTHER, 3, -0.2); // another operator, or the same one restarted, who counts alike
    go(rig);
    assert_all_near(rig->out.goal, rig->request.goal, 3, 0);
    assert_int_equal(rig->out.request.session, OTHER);
}

// A request that comes again is not obeyed again, even if its content was changed on the way.
static void a_repeated_request_changes_nothing(void **state)
{
    (void)state;
    struct rig *rig = start();
    ask(rig, LW_REQUEST_GOAL, OPERATOR, 1, 0.1);
    go(rig);
    ask(rig, LW_REQUEST_GOAL, OPERATOR, 1, 0.9);
    go(rig);
    assert_near(rig->out.goal[0], 0.1, 0);
    rig->request = (struct lw_request){0}; // none in the mailbox: the one in force stays, and is named
    go(rig);
    assert_near(rig->out.goal[0], 0.1, 0);
    assert_true(rig->out.request.session == OPERATOR && rig->out.request.seq == 1);
}

// A request that was overtaken by a newer one of its sender comes too late.
static void an_overtaken_request_comes_too_late(void **state)
{
    (void)state;
    struct rig *rig = start();
    ask(rig, LW_REQUEST_GOAL, OPERATOR, 5, 0.1);
    go(rig);
    ask(rig, LW_REQUEST_GOAL, OPERATOR, 4, 0.9);
    go(rig);
    assert_near(rig->out.goal[0], 0.1, 0);
    assert_int_equal(rig->out.request.seq, 5);
}

// Stop brakes to rest and holds; the next goal moves on.
static void stop_holds_until_the_next_goal(void **state)
{
    (void)state;
    struct rig *rig = start();
    go_for(rig, 100);
    const double goal = rig->out.goal[0];
    ask(rig, LW_REQUEST_STOP, OPERATOR, 1, 0);
    check_brakes_to_rest(rig, LW_STOPPED);
    for (int k = 0; k < 50; k++) {
        go(rig);
        assert_int_equal(rig->out.flags, LW_STOPPED);
        assert_near(rig->out.goal[0], goal, 0); // a stop has no goal of its own
        assert_all_near(rig->out.qd, zero, LW_NJ, 0);
    }
    ask(rig, LW_REQUEST_GOAL, OPERATOR, 2, 0.2);
    go(rig);
    assert_int_equal(rig->out.flags & LW_STOPPED, 0);
    assert_true(speed(rig) > 0);
}

// GOAL and STOP are counted apart (header_t: seq is per channel), so the first stop of a tool may carry the very
// session and seq of its first goal. It must stop the arm.
static void a_stop_with_the_numbers_of_a_goal_stops(void **state)
{
    (void)state;
    struct rig *rig = start();
    ask(rig, LW_REQUEST_GOAL, OPERATOR, 1, 0.2);
    go_for(rig, 100);
    ask(rig, LW_REQUEST_STOP, OPERATOR, 1, 0);
    check_brakes_to_rest(rig, LW_STOPPED);
}

// A goal that was obeyed before a stop and comes again after it, as its sender repeats it, does not end the stop.
static void a_goal_obeyed_before_does_not_end_a_stop(void **state)
{
    (void)state;
    struct rig *rig = start();
    ask(rig, LW_REQUEST_GOAL, OPERATOR, 3, 0.2);
    go_for(rig, 100);
    ask(rig, LW_REQUEST_STOP, OTHER, 1, 0);
    check_brakes_to_rest(rig, LW_STOPPED);
    ask(rig, LW_REQUEST_GOAL, OPERATOR, 3, 0.2);
    go(rig);
    assert_int_equal(rig->out.flags, LW_STOPPED);
    assert_all_near(rig->out.qd, zero, LW_NJ, 0);
}

// --- estimate ---

// A state may be as old as 20 ms or three periods, whichever is more; one nanosecond older brakes to rest.
static void a_stale_state_brakes(void **state)
{
    (void)state;
    const struct {
        double rate_hz;
        int64_t limit_ns;
    } cases[] = {{500, 20 * ms}, {1000, 20 * ms}, {125, 24 * ms}, {50, 60 * ms}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct rig *rig = start();
        rig->scene.rate_hz = cases[i].rate_hz;
        assert_int_equal(lw_controller_init(&rig->config, &rig->state, &rig->scene, CONTROLLER), LW_OK);
        rig->age_ns = cases[i].limit_ns;
        tick(rig);
        assert_int_equal(rig->out.flags & LW_STALE, 0);
        rig->age_ns = cases[i].limit_ns + 1;
        tick(rig);
        assert_true(rig->out.flags & LW_STALE);
        assert_int_equal(rig->out.mode, LW_COMMAND_VELOCITY);
    }
    struct rig *rig = start();
    go_for(rig, 100);
    rig->age_ns = 21 * ms;
    check_brakes_to_rest(rig, LW_STALE);
    rig->age_ns = 0;
    go(rig);
    assert_true(speed(rig) > 0);
}

// A position that is no number brakes the arm; what goes out is finite.
static void a_position_that_is_no_number_brakes(void **state)
{
    (void)state;
    for (int j = 0; j < LW_NJ; j++) {
        struct rig *rig = start();
        go_for(rig, 100);
        rig->joint.q[j] = j % 2 ? NO_NUMBER : HUGE_VAL;
        check_brakes_to_rest(rig, LW_NOT_FINITE);
        assert_int_equal(rig->out.nearest.link, 0);
    }
}

// A velocity that is no number counts as rest.
static void a_velocity_that_is_no_number_counts_as_rest(void **state)
{
    (void)state;
    struct rig *rig = start();
    rig->joint.mode = LW_PLANT_STOPPING;
    rig->joint.qd[1] = NO_NUMBER;
    rig->joint.qd[2] = 0.5;
    tick(rig);
    assert_true(lw_all_finite(rig->out.qd, LW_NJ));
    assert_true(fabs(rig->out.qd[1]) <= 0.016 + 1e-12);
    assert_true(fabs(rig->out.qd[2] - 0.5) <= 0.016 + 1e-12);
}

// A plant that is new, or does not follow, is taken over at its own velocity; one that follows, at the last command.
static void the_velocity_in_force_is_the_plants_unless_it_follows(void **state)
{
    (void)state;
    for (int round = 0; round < 4; round++) {
        struct rig *rig = start();
        go_for(rig, 100);
        double last[LW_NJ];
        memcpy(last, rig->out.qd, sizeof last);
        for (int j = 0; j < LW_NJ; j++)
            rig->joint.qd[j] = 0.3 + 0.1 * j;
        rig->joint.stamp.session += round == 1; // restarted
        rig->joint.mode = round == 2 ? LW_PLANT_STOPPING : round == 3 ? LW_PLANT_HOLD : LW_PLANT_MOVING;
        tick(rig);
        for (int j = 0; j < LW_NJ; j++)
            assert_true(fabs(rig->out.qd[j] - (round ? rig->joint.qd[j] : last[j])) <= 0.016 + 1e-12);
    }
}

// --- motion ---

// Whatever is asked and whatever fails, no command steps further than the acceleration limit or beyond the speed limit,
// and none is anything but finite.
static void no_event_steps_the_command(void **state)
{
    (void)state;
    struct random random = {71};
    struct rig *rig = start();
    double at[3] = {-0.35, -0.5, 0.36};
    put_ball(&rig->world, 1, at, 0.08);
    for (int64_t k = 1; k <= 20000; k++) {
        double last[LW_NJ];
        memcpy(last, rig->state.velocity, sizeof last);
        if (random_below(&random, 50) == 0)
            ask(rig, random_below(&random, 4) ? LW_REQUEST_GOAL : LW_REQUEST_STOP, OPERATOR, k,
                random_in(&random, -1, 1));
        if (random_below(&random, 50) == 0)
            rig->age_ns = random_below(&random, 2) * 30 * ms;
        if (random_below(&random, 50) == 0) {
            random_fill(&random, -0.8, 0.8, at, 3);
            put_ball(&rig->world, 1, at, 0.08);
        }
        const double q = rig->joint.q[3];
        const bool broken = random_below(&random, 30) == 0;
        if (broken)
            rig->joint.q[3] = NO_NUMBER;
        go(rig);
        if (broken)
            rig->joint.q[3] = q + 0.002 * rig->out.qd[3];
        for (int j = 0; j < LW_NJ; j++) {
            assert_true(fabs(rig->out.qd[j] - last[j]) <= 0.016 + 1e-9);
            assert_true(fabs(rig->out.qd[j]) <= rig->scene.limits.velocity[j] + 1e-9);
        }
    }
}

// The arm gets to its goal, and then it is at rest there.
static void it_reaches_its_goal(void **state)
{
    (void)state;
    struct rig *rig = start();
    assert_true(lw_controller_at_rest(&rig->state));
    go_for(rig, 1);
    assert_false(lw_controller_at_rest(&rig->state));
    go_for(rig, 10000);
    assert_true(rig->out.deviation < 1e-3);
    assert_true(speed(rig) < 1e-3);
}

// --- explanation ---

// The explanation echoes the input, and distance and deviation are those of the configuration it names.
static void the_explanation_echoes_the_input(void **state)
{
    (void)state;
    struct rig *rig = start();
    const double at[1][3] = {{-0.35, -0.5, 0.36}};
    rig->world.version = 17;
    rig->world.last = (struct lw_stamp){3, 4, 5, 6};
    rig->world.last_channel = 2;
    put_balls(&rig->world, 33, at, 1, 0.08);
    rig->world.last_channel = 2;
    rig->age_ns = 123;
    ask(rig, LW_REQUEST_GOAL, OPERATOR, 9, 0.2);
    rig->state.tick = 41;
    tick(rig);
    const struct lw_joint_command *out = &rig->out;
    assert_true(out->plant_session == PLANT && out->state_seq == 4 && out->state_tick == 5 && out->state_mono_ns == 2);
    assert_true(out->world_version == 17 && out->obstacle_count == 1 && out->world.session == 5 && out->world.seq == 6);
    assert_true(out->tick == 42 && out->tick_ns == 41 * 2 * ms && out->state_age_ns == 123);
    assert_true(out->request.session == OPERATOR && out->request.seq == 9);
    assert_true(out->stamp.session == 0 && out->wake_late_ns == 0 && out->previous_exec_ns == 0 && out->skipped == 0);
    assert_same_bits(out->q, rig->joint.q, sizeof out->q);

    struct lw_pose frame[LW_NJ];
    double gap[3];
    assert_int_equal(lw_arm_fk(rig->config.arm, rig->joint.q, frame), LW_OK);
    lw_vec_sub(rig->request.goal, frame[5].p, gap);
    assert_near(out->deviation, lw_vec_norm(gap), 0);
    double gap_to_ball[3];
    lw_vec_sub(frame[2].p, at[0], gap_to_ball);
    assert_int_equal(out->world_channel, 2);
    assert_int_equal(out->nearest.obstacle, 33);
    assert_true(out->nearest.clearance > 0 && out->nearest.clearance < lw_vec_norm(gap_to_ball));
    assert_in_range(out->nearest.link, 1, LW_NJ);
}

// Two controllers with the same past and the same input say the same to the last bit, as sent on the wire.
static void the_same_input_gives_the_same_bytes(void **state)
{
    (void)state;
    struct random random = {72};
    struct rig *rig = start();
    static struct rig copy;
    for (int64_t k = 1; k <= 2000; k++) {
        union lw_message a, b;
        unsigned char a_bytes[LW_WIRE_MAX], b_bytes[LW_WIRE_MAX];
        ask(rig, LW_REQUEST_GOAL, OPERATOR, k / 100, random_in(&random, -0.5, 0.5));
        copy = *rig;
        tick(&copy);
        go(rig);
        a.joint_command = rig->out;
        b.joint_command = copy.out;
        const uint32_t size = lw_wire_encode(LW_CHANNEL_JOINT_COMMAND, &a, a_bytes);
        assert_int_equal(lw_wire_encode(LW_CHANNEL_JOINT_COMMAND, &b, b_bytes), size);
        assert_same_bits(a_bytes, b_bytes, size);
        assert_same_bits(rig->state.velocity, copy.state.velocity, sizeof copy.state.velocity);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(init_refuses_unknown_robots_and_laws),
        cmocka_unit_test(it_waits_for_the_world),
        cmocka_unit_test(the_newest_goal_is_in_force),
        cmocka_unit_test(a_repeated_request_changes_nothing),
        cmocka_unit_test(an_overtaken_request_comes_too_late),
        cmocka_unit_test(stop_holds_until_the_next_goal),
        cmocka_unit_test(a_stop_with_the_numbers_of_a_goal_stops),
        cmocka_unit_test(a_goal_obeyed_before_does_not_end_a_stop),
        cmocka_unit_test(a_stale_state_brakes),
        cmocka_unit_test(a_position_that_is_no_number_brakes),
        cmocka_unit_test(a_velocity_that_is_no_number_counts_as_rest),
        cmocka_unit_test(the_velocity_in_force_is_the_plants_unless_it_follows),
        cmocka_unit_test(no_event_steps_the_command),
        cmocka_unit_test(it_reaches_its_goal),
        cmocka_unit_test(the_explanation_echoes_the_input),
        cmocka_unit_test(the_same_input_gives_the_same_bytes),
    };
    return cmocka_run_group_tests_name("tick", tests, NULL, NULL);
}
