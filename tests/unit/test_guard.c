// SPDX-License-Identifier: BSD-3-Clause
// Tests of the guard, two-sided: no limit is ever broken, and no command is slower than the limits require.
//
// Units    radians, seconds.
// Frames   none.
// Arrays   one entry a joint.
// Memory   stack.
// Errors   cmocka's.
#include "controller/guard.h"
#include "guard_oracle.h" // the answer that is as fast as the limits allow
#include "helpers.h"

static const double tolerance = 1e-9;
static const double no_wish[LW_NJ] = {0};

// An arm that does what it is told.
struct rig {
    struct lw_limits limits;
    double period_s, q[LW_NJ], velocity[LW_NJ];
};

static struct rig still_rig(double range, double velocity, double acceleration)
{
    struct rig rig = {.period_s = 0.002};
    for (int j = 0; j < LW_NJ; j++) {
        rig.limits.position_min[j] = -range;
        rig.limits.position_max[j] = range;
        rig.limits.velocity[j] = velocity;
        rig.limits.acceleration[j] = acceleration;
    }
    return rig;
}

static unsigned shape(const struct rig *rig, const double wish[LW_NJ], double command[LW_NJ])
{
    const struct lw_guard_input in = {
        .limits = &rig->limits, .period_s = rig->period_s, .q = rig->q, .velocity = rig->velocity, .wish = wish};
    return lw_guard_shape(&in, command);
}

// One tick: shape, then move as commanded.
static unsigned go(struct rig *rig, const double wish[LW_NJ])
{
    double command[LW_NJ];
    const unsigned flags = shape(rig, wish, command);
    for (int j = 0; j < LW_NJ; j++) {
        rig->velocity[j] = command[j];
        rig->q[j] += rig->period_s * command[j];
    }
    return flags;
}

// --- braking velocity ---

// Way until rest, tick by tick.
static double way_to_rest(double v, double acceleration, double period_s)
{
    double way = 0;
    while (v > 0) {
        way += v * period_s;
        v -= acceleration * period_s;
    }
    return way;
}

// Braking from it ends exactly at the end of the room; a start one part in a million faster would not stop in time.
static void braking_velocity_uses_the_room_and_no_more(void **state)
{
    (void)state;
    struct random random = {11};
    for (int i = 0; i < 5000; i++) {
        const double room = random_in(&random, 0, 1) * random_in(&random, 0, 2),
                     period_s = random_in(&random, 5e-4, 0.01);
        const double a = random_in(&random, 0.5, 40);
        const double v = lw_guard_braking_velocity(room, a, period_s);
        assert_near(way_to_rest(v, a, period_s), room, 1e-9 * room);
        assert_true(way_to_rest(v * (1 + 1e-6), a, period_s) > room);
        assert_near(v, oracle_braking_velocity(room, a, period_s), 1e-9);
    }
}

// Where one more tick of braking begins, both formulas meet: rooms of 0, 1, 2 ... whole steps.
static void braking_velocity_of_whole_steps_is_whole(void **state)
{
    (void)state;
    for (int k = 0; k < 50; k++)
        assert_near(lw_guard_braking_velocity(0.5 * 0.25 * k * (k + 1) / 2, 2, 0.25), 0.5 * k, 1e-12);
}

// No room, no velocity, on either side of the range; without an acceleration limit the room is used in one tick.
static void braking_velocity_at_its_ends(void **state)
{
    (void)state;
    assert_near(lw_guard_braking_velocity(0, 5, 0.01), 0, 0);
    assert_near(lw_guard_braking_velocity(-1, 5, 0.01), 0, 0);
    assert_near(lw_guard_braking_velocity(-1, HUGE_VAL, 0.01), 0, 0);
    assert_near(lw_guard_braking_velocity(0.3, HUGE_VAL, 0.01), 30, 1e-14);
    assert_near(lw_guard_braking_velocity(1e-300, 5, 0.01), 1e-298, 1e-310);
}

// --- each limit alone ---

// A wish within all limits passes bit for bit, minus zero included, and raises no flag.
static void an_allowed_wish_passes_untouched(void **state)
{
    (void)state;
    const struct rig rig = still_rig(3, 2, 800);
    const double wish[LW_NJ] = {1.5, -1.5, -0.0, 0.1, 1e-300, -2e-16};
    double command[LW_NJ];
    assert_int_equal(shape(&rig, wish, command), 0);
    assert_same_bits(command, wish, sizeof wish);
}

// Limits that are off, the range too, shape nothing; one that is not still holds.
static void infinite_limits_are_off(void **state)
{
    (void)state;
    const double wish[LW_NJ] = {1e9, -1e9, 0.5, -0.5, 0, 1};
    double command[LW_NJ];
    const struct rig off = still_rig(HUGE_VAL, HUGE_VAL, HUGE_VAL);
    assert_int_equal(shape(&off, wish, command), 0);
    assert_same_bits(command, wish, sizeof wish);
    struct rig braked = still_rig(HUGE_VAL, HUGE_VAL, 8);
    assert_int_equal(go(&braked, wish), LW_LIMIT_ACCELERATION);
    assert_near(braked.velocity[0], 8 * braked.period_s, 1e-12);
    assert_near(braked.velocity[1], -8 * braked.period_s, 1e-12);
}

// A wish exactly at a limit is allowed; the next number beyond it is not, and then only that limit's flag is up.
static void limits_themselves_are_allowed(void **state)
{
    (void)state;
    double command[LW_NJ], wish[LW_NJ] = {0.5, -0.5, 0, 0, 0, 0};
    const struct rig fast = still_rig(3, 0.5, HUGE_VAL);
    assert_int_equal(shape(&fast, wish, command), 0);
    wish[1] = nextafter(-0.5, -1);
    assert_int_equal(shape(&fast, wish, command), LW_LIMIT_VELOCITY);
    struct rig strong = still_rig(3, HUGE_VAL, 4);
    strong.period_s = 0.125;
    wish[1] = -0.5;
    assert_int_equal(shape(&strong, wish, command), 0);
    wish[1] = nextafter(-0.5, -1);
    assert_int_equal(shape(&strong, wish, command), LW_LIMIT_ACCELERATION);
    struct rig wide = still_rig(0.0625, HUGE_VAL, HUGE_VAL);
    wide.period_s = 0.125;
    wish[1] = -0.5;
    assert_int_equal(shape(&wide, wish, command), 0);
    wish[1] = nextafter(-0.5, -1);
    assert_int_equal(shape(&wide, wish, command), LW_LIMIT_POSITION);
    assert_near(command[1], -0.5, 0);
}

// Where only speed limits act, the direction stays, one joint stands at its limit, and the flag says so.
static void speed_limits_keep_the_direction(void **state)
{
    (void)state;
    struct random random = {12};
    for (int i = 0; i < 2000; i++) {
        struct rig rig = still_rig(6, HUGE_VAL, HUGE_VAL);
        double wish[LW_NJ], command[LW_NJ], fullest = 0;
        random_fill(&random, 0.5, 3, rig.limits.velocity, LW_NJ - 1); // joint 6 has none
        random_fill(&random, -9, 9, wish, LW_NJ);
        wish[random_below(&random, LW_NJ - 1)] = 10;
        assert_int_equal(shape(&rig, wish, command), LW_LIMIT_VELOCITY);
        for (int j = 0; j < LW_NJ; j++) {
            assert_near(command[j] * wish[0], wish[j] * command[0], 1e-12);
            assert_true(command[j] * wish[j] >= 0);
            fullest = fmax(fullest, fabs(command[j]) / rig.limits.velocity[j]);
        }
        assert_near(fullest, 1, 1e-12);
    }
}

// Where only acceleration limits act, the command lies on the straight way from the old velocity to the wish.
static void acceleration_limits_keep_the_direction_of_the_step(void **state)
{
    (void)state;
    struct random random = {13};
    for (int i = 0; i < 2000; i++) {
        struct rig rig = still_rig(1e6, HUGE_VAL, HUGE_VAL);
        double wish[LW_NJ], command[LW_NJ], fullest = 0;
        random_fill(&random, 0.5, 3, rig.limits.acceleration, LW_NJ - 1);
        random_fill(&random, -1, 1, rig.velocity, LW_NJ);
        random_fill(&random, -1, 1, wish, LW_NJ);
        wish[2] = rig.velocity[2] + 0.5;
        assert_int_equal(shape(&rig, wish, command), LW_LIMIT_ACCELERATION);
        const double part = (command[2] - rig.velocity[2]) / 0.5;
        for (int j = 0; j < LW_NJ; j++) {
            assert_near(command[j], rig.velocity[j] + part * (wish[j] - rig.velocity[j]), 1e-12);
            fullest = fmax(fullest, fabs(command[j] - rig.velocity[j]) / (rig.limits.acceleration[j] * rig.period_s));
        }
        assert_near(fullest, 1, 1e-10);
    }
}

// Pushed towards an end for ever, a joint arrives at it, stays there, and leaves it at once when asked to.
static void a_joint_reaches_the_end_of_its_range_and_leaves_it(void **state)
{
    (void)state;
    for (int side = -1; side <= 1; side += 2) {
        struct rig rig = still_rig(0.7, 2, 8);
        rig.limits.position_min[3] = -0.3; // ends differ
        double wish[LW_NJ] = {0};
        const double end = side > 0 ? 0.7 : -0.3;
        wish[3] = side * 1e9;
        for (int k = 0; k < 2000; k++)
            assert_true(go(&rig, wish) & LW_LIMIT_POSITION);
        assert_near(rig.q[3], end, tolerance);
        assert_near(rig.velocity[3], 0, tolerance);
        wish[3] = -side * 1e-3;
        assert_int_equal(go(&rig, wish), 0);
        assert_near(rig.velocity[3], -side * 1e-3, tolerance);
    }
}

// Starting outside its range a joint may come in at any speed but go no further out.
static void a_joint_outside_its_range_may_only_come_in(void **state)
{
    (void)state;
    struct rig rig = still_rig(0.5, 2, 800);
    rig.q[0] = 0.6;
    rig.q[1] = -0.6;
    double command[LW_NJ];
    const double out[LW_NJ] = {1, -1, 0, 0, 0, 0}, in[LW_NJ] = {-1, 1, 0, 0, 0, 0};
    assert_int_equal(shape(&rig, out, command), LW_LIMIT_POSITION);
    assert_all_near(command, no_wish, LW_NJ, 0);
    assert_int_equal(shape(&rig, in, command), 0);
    assert_all_near(command, in, LW_NJ, 0);
}

// A joint that must brake for its range brakes as hard as it may, however little of the common step is left to it.
static void a_joint_that_must_brake_goes_first(void **state)
{
    (void)state;
    struct rig rig = still_rig(1, HUGE_VAL, 8);
    rig.velocity[2] = lw_guard_braking_velocity(0.1, 8, rig.period_s);
    rig.q[2] = 0.9 + rig.velocity[2] * rig.period_s; // one tick later it has to be a step slower
    double wish[LW_NJ] = {1e9, 0, 9, 0, 0, 0}, command[LW_NJ];
    const unsigned flags = shape(&rig, wish, command);
    assert_int_equal(flags, LW_LIMIT_POSITION | LW_LIMIT_ACCELERATION);
    assert_near(command[2], rig.velocity[2] - 0.016, tolerance);
    assert_near(command[0], 0.016, tolerance);
}

// --- no numbers ---

// One value that is no number among the wishes or the positions: the whole arm brakes, straight and at full
// acceleration, to rest and stays there.
static void no_number_brakes_as_hard_as_allowed(void **state)
{
    (void)state;
    const double bad[] = {NO_NUMBER, -NO_NUMBER, HUGE_VAL, -HUGE_VAL};
    for (int i = 0; i < 4 * LW_NJ * 2; i++) {
        struct rig rig = still_rig(6, 3, 8);
        const double start[LW_NJ] = {1, -2, 0.5, 0, 0.1, -0.3};
        memcpy(rig.velocity, start, sizeof start);
        double wish[LW_NJ] = {3, 3, 3, 3, 3, 3};
        *(i % 2 ? &rig.q[i / 8] : &wish[i / 8]) = bad[i / 2 % 4];
        for (int tick = 1; tick <= 130; tick++) {
            const unsigned flags = go(&rig, wish);
            const double left = fmax(0, 1 - tick * 0.016 / 2); // joint 2 needs longest: 2 rad/s at 8 rad/s^2
            assert_int_equal(flags, LW_NOT_FINITE | (tick <= 124 ? LW_LIMIT_ACCELERATION : 0));
            for (int j = 0; j < LW_NJ; j++)
                assert_near(rig.velocity[j], left * start[j], tolerance);
        }
    }
}

// Without acceleration limits "brake" is "stand still at once".
static void no_number_without_acceleration_limits_stops_at_once(void **state)
{
    (void)state;
    struct rig rig = still_rig(6, 3, HUGE_VAL);
    rig.velocity[1] = 2;
    double wish[LW_NJ] = {1, 1, 1, NO_NUMBER, 1, 1}, command[LW_NJ];
    assert_int_equal(shape(&rig, wish, command), LW_NOT_FINITE);
    assert_all_near(command, no_wish, LW_NJ, 0);
}

// --- long random sequences ---

static struct rig random_rig(struct random *random)
{
    static const double periods[] = {0.001, 0.002, 0.008};
    struct rig rig = {.period_s = periods[random_below(random, 3)]};
    for (int j = 0; j < LW_NJ; j++) {
        rig.limits.position_min[j] = -random_in(random, 0.02, 3);
        rig.limits.position_max[j] = random_in(random, 0.02, 3);
        rig.limits.velocity[j] = random_below(random, 4) ? random_in(random, 0.2, 4) : HUGE_VAL;
        rig.limits.acceleration[j] = random_below(random, 4) ? random_in(random, 0.5, 20) : HUGE_VAL;
        rig.q[j] = random_in(random, rig.limits.position_min[j], rig.limits.position_max[j]);
    }
    return rig;
}

// Changes the wish now and then, so that some are held until they meet a limit.
static void random_wish(struct random *random, double wish[LW_NJ])
{
    static const double odd[] = {NO_NUMBER, HUGE_VAL, -HUGE_VAL, 1e9, -1e9, 1e300, -1e300, 0, -0.0, 1e-12};
    switch (random_below(random, 20)) {
    case 0: random_fill(random, -5, 5, wish, LW_NJ); break;
    case 1: random_fill(random, -0.2, 0.2, wish, LW_NJ); break;
    case 2: memset(wish, 0, LW_NJ * sizeof *wish); break;
    case 3: wish[random_below(random, LW_NJ)] = odd[random_below(random, 10)]; break;
    case 4: wish[random_below(random, LW_NJ)] *= -1; break;
    case 5:
        for (int j = 0; j < LW_NJ; j++)
            wish[j] = (random_below(random, 2) ? 1 : -1) * random_in(random, 1, 1e6);
        break;
    default: break;
    }
}

static void check_limits(const struct rig *before, const struct rig *after)
{
    const struct lw_limits *limits = &before->limits;
    for (int j = 0; j < LW_NJ; j++) {
        assert_true(isfinite(after->velocity[j]));
        assert_true(fabs(after->velocity[j]) <= limits->velocity[j] + tolerance);
        assert_true(fabs(after->velocity[j] - before->velocity[j]) <=
                    limits->acceleration[j] * before->period_s + tolerance);
        assert_true(after->q[j] <= limits->position_max[j] + tolerance);
        assert_true(after->q[j] >= limits->position_min[j] - tolerance);
    }
}

// The command is the fastest one allowed, and each flag is up exactly when its limit had a say.
static void check_answer(const struct rig *before, const double wish[LW_NJ], const double command[LW_NJ],
                         unsigned flags)
{
    const struct oracle_state s = {&before->limits, before->period_s, before->q, before->velocity, wish};
    const struct oracle_answer answer = oracle_answer(&s);
    assert_all_near(command, answer.command, LW_NJ, tolerance);
    assert_int_equal(flags & ~answer.marginal, answer.flags & ~answer.marginal);
    if (flags == 0)
        assert_all_near(command, wish, LW_NJ, 0);
}

// Any limits, any wishes, from anywhere in the range: all limits hold in every tick, and nothing is slower than it
// must.
static void random_wishes_never_break_a_limit_nor_lose_speed(void **state)
{
    (void)state;
    struct random random = {14};
    for (int run = 0; run < 200; run++) {
        struct rig rig = random_rig(&random);
        double wish[LW_NJ] = {0};
        for (int tick = 0; tick < 250; tick++) {
            const struct rig before = rig;
            random_wish(&random, wish);
            const unsigned flags = go(&rig, wish);
            check_limits(&before, &rig);
            check_answer(&before, wish, rig.velocity, flags);
        }
    }
}

// An arm found in any state, too fast for its limits or outside its range: the answer is still the fastest way back.
static void any_start_is_answered_with_the_fastest_way_back(void **state)
{
    (void)state;
    struct random random = {15};
    for (int i = 0; i < 20000; i++) {
        struct rig rig = random_rig(&random);
        double wish[LW_NJ], command[LW_NJ];
        random_fill(&random, -4, 4, rig.q, LW_NJ);
        random_fill(&random, -6, 6, rig.velocity, LW_NJ);
        random_fill(&random, -6, 6, wish, LW_NJ);
        random_wish(&random, wish);
        if (random_below(&random, 8) == 0)
            rig.q[random_below(&random, LW_NJ)] = NO_NUMBER;
        const unsigned flags = shape(&rig, wish, command);
        assert_true(lw_all_finite(command, LW_NJ));
        check_answer(&rig, wish, command, flags);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(braking_velocity_uses_the_room_and_no_more),
        cmocka_unit_test(braking_velocity_of_whole_steps_is_whole),
        cmocka_unit_test(braking_velocity_at_its_ends),
        cmocka_unit_test(an_allowed_wish_passes_untouched),
        cmocka_unit_test(infinite_limits_are_off),
        cmocka_unit_test(limits_themselves_are_allowed),
        cmocka_unit_test(speed_limits_keep_the_direction),
        cmocka_unit_test(acceleration_limits_keep_the_direction_of_the_step),
        cmocka_unit_test(a_joint_reaches_the_end_of_its_range_and_leaves_it),
        cmocka_unit_test(a_joint_outside_its_range_may_only_come_in),
        cmocka_unit_test(a_joint_that_must_brake_goes_first),
        cmocka_unit_test(no_number_brakes_as_hard_as_allowed),
        cmocka_unit_test(no_number_without_acceleration_limits_stops_at_once),
        cmocka_unit_test(random_wishes_never_break_a_limit_nor_lose_speed),
        cmocka_unit_test(any_start_is_answered_with_the_fastest_way_back),
    };
    return cmocka_run_group_tests_name("guard", tests, NULL, NULL);
}
