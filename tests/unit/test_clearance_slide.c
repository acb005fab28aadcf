// SPDX-License-Identifier: BSD-3-Clause
// Tests of the guard's clearance where nothing is left of it, and where a law wishes for more than the joints can.
//
// Units    metres, radians, seconds.
// Frames   base frame.
// Arrays   one entry a joint.
// Memory   static where results are large.
// Errors   cmocka's.
#include "controller/clearance.h"
#include "helpers.h"

static const double period_s = 0.002;
static struct lw_rooms rooms;

static struct lw_limits limits(void)
{
    struct lw_limits limits = {.clearance = 0.01};
    for (int j = 0; j < LW_NJ; j++) {
        limits.position_min[j] = -6;
        limits.position_max[j] = 6;
        limits.velocity[j] = 3;
        limits.acceleration[j] = 8;
    }
    return limits;
}

// Ticks the guard with one wish, the joints standing in one place.
static void tick(const double q[LW_NJ], const double wish[LW_NJ], int ticks, double velocity[LW_NJ])
{
    const struct lw_limits l = limits();
    for (int k = 0; k < ticks; k++) {
        double command[LW_NJ];
        const struct lw_guard_input in = {
            .limits = &l, .period_s = period_s, .q = q, .velocity = velocity, .wish = wish};
        (void)lw_clearance_command(&in, &rooms, command);
        memcpy(velocity, command, sizeof command);
    }
}

static double product(const double a[LW_NJ], const double b[LW_NJ])
{
    double sum = 0;
    for (int j = 0; j < LW_NJ; j++)
        sum += a[j] * b[j];
    return sum;
}

// Where a room is used up, a wish that closes in loses that much of itself and no more: the arm goes along.
static void the_arm_slides_along_a_room_that_is_used_up(void **state)
{
    (void)state;
    struct random random = {79};
    static const double q[LW_NJ] = {0};
    int closing = 0;
    for (int n = 0; n < 2000; n++) {
        double wish[LW_NJ], velocity[LW_NJ] = {0};
        struct lw_room *room = &rooms.room[0];
        rooms.count = 1;
        *room = (struct lw_room){.room = n % 2 == 0 ? -0.005 : 0, .approach = 0};
        random_fill(&random, -1, 1, room->gradient, LW_NJ);
        random_fill(&random, -1, 1, wish, LW_NJ);
        const double rate = product(room->gradient, wish), square = product(room->gradient, room->gradient);
        tick(q, wish, 100, velocity);
        for (int j = 0; j < LW_NJ; j++)
            assert_near(velocity[j], wish[j] - (rate < 0 ? rate / square * room->gradient[j] : 0), 1e-9);
        closing += rate < 0;
    }
    assert_true(closing > 500);
}

// Two used-up rooms whose planes meet at an acute angle leave a way along both.
static void the_arm_slides_between_two_rooms(void **state)
{
    (void)state;
    static const double q[LW_NJ] = {0}, wish[LW_NJ] = {0, -1, 0.5};
    for (int degrees = 1; degrees < 90; degrees += 4) {
        const double angle = degrees * 3.14159265358979 / 180;
        double velocity[LW_NJ] = {0};
        rooms.count = 2;
        rooms.room[0] = (struct lw_room){.room = -0.005, .gradient = {-cos(angle / 2), sin(angle / 2)}};
        rooms.room[1] = (struct lw_room){.room = -0.005, .gradient = {cos(angle / 2), sin(angle / 2)}};
        tick(q, wish, 300, velocity);
        assert_near(velocity[2], 0.5, 1e-9);
    }
}

// What a joint changes by rounding alone does not stop it.
static void rounding_is_no_closing_in(void **state)
{
    (void)state;
    static const double q[LW_NJ] = {0}, wish[LW_NJ] = {1, 0.5};
    double velocity[LW_NJ] = {0};
    rooms.count = 1;
    rooms.room[0] = (struct lw_room){.room = -0.005, .gradient = {-1e-17, 1e-17}};
    tick(q, wish, 100, velocity);
    for (int j = 0; j < LW_NJ; j++)
        assert_near(velocity[j], wish[j], 1e-12);
}

// A wish beyond the limits makes no joint slower than one within them does: towards something three metres away, at
// rest or coming, and with a joint at the end of its range.
static void a_larger_wish_is_not_slower(void **state)
{
    (void)state;
    for (int coming = 0; coming < 2; coming++)
        for (int exponent = 0; exponent < 6; exponent++) {
            const double factor = pow(10, exponent), q[LW_NJ] = {0, 6}, wish[LW_NJ] = {3 * factor, 3 * factor, factor};
            double velocity[LW_NJ] = {0};
            rooms.count = 1;
            rooms.room[0] = (struct lw_room){.room = 3, .gradient = {-1, -1}, .approach = coming ? 0.1 : 0};
            tick(q, wish, 300, velocity);
            assert_near(velocity[0], 3, 1e-9);
            assert_near(velocity[1], 0, 1e-9);
            assert_true(velocity[2] > 1 - 1e-9);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(the_arm_slides_along_a_room_that_is_used_up),
                                       cmocka_unit_test(the_arm_slides_between_two_rooms),
                                       cmocka_unit_test(rounding_is_no_closing_in),
                                       cmocka_unit_test(a_larger_wish_is_not_slower)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
