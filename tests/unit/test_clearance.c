// SPDX-License-Identifier: BSD-3-Clause
// Tests of the guard's clearance, two-sided: no pair comes nearer than it may, and no velocity is cut that need not be.
//
// Units    metres, radians, seconds.
// Frames   base frame.
// Arrays   one entry a joint.
// Memory   static where results are large.
// Errors   cmocka's.
#include "arm/joint.h" // enum lw_flag
#include "base/vec.h"  // lw_vec_*
#include "controller/clearance.h"
#include "helpers.h"

static const double period_s = 0.002;

static struct lw_limits limits(double acceleration)
{
    struct lw_limits limits = {.clearance = 0.01};
    for (int j = 0; j < LW_NJ; j++) {
        limits.position_min[j] = -6;
        limits.position_max[j] = 6;
        limits.velocity[j] = 3;
        limits.acceleration[j] = acceleration;
    }
    return limits;
}

// Random rooms; each gradient is that of a lever of up to a metre.
static struct lw_rooms *random_rooms(struct random *random, int count, double room_max)
{
    static struct lw_rooms rooms;
    rooms.count = count;
    for (int i = 0; i < count; i++) {
        random_fill(random, -1, 1, rooms.room[i].gradient, LW_NJ);
        rooms.room[i].room = random_in(random, -0.01, room_max);
        rooms.room[i].approach = random_below(random, 3) == 0 ? random_in(random, 0, 0.5) : 0;
    }
    return &rooms;
}

// Way towards a pair while the arm brakes in a straight line, tick by tick, and the obstacle's own way meanwhile.
static double way_until_rest(const struct lw_limits *l, const struct lw_room *room, const double velocity[LW_NJ])
{
    double time = 0, closing = 0, way = 0;
    for (int j = 0; j < LW_NJ; j++) {
        time = fmax(time, fabs(velocity[j]) / l->acceleration[j]);
        closing -= room->gradient[j] * velocity[j];
    }
    for (int k = 0; k * period_s < time; k++)
        way += period_s * (closing * (1 - k * period_s / time) + room->approach);
    return way;
}

static bool closes(const struct lw_room *room, const double velocity[LW_NJ])
{
    double rate = 0;
    for (int j = 0; j < LW_NJ; j++)
        rate += room->gradient[j] * velocity[j];
    return rate < 0;
}

// The allowed part can be braked within every room; a part a little larger needs more than one of them has by the
// formula of the header, and a part of one is only given where everything fits.
static void the_part_is_the_largest_that_can_be_braked(void **state)
{
    (void)state;
    struct random random = {71};
    int cut = 0, whole = 0, stopped = 0;
    for (int n = 0; n < 5000; n++) {
        const struct lw_limits l = limits(random_in(&random, 2, 20));
        const struct lw_rooms *rooms = random_rooms(&random, 1 + random_below(&random, 6), 0.6);
        double velocity[LW_NJ], part_of[LW_NJ];
        random_fill(&random, -2, 2, velocity, LW_NJ);
        const double part = lw_clearance_part(&l, period_s, rooms, velocity);
        assert_true(part >= 0 && part <= 1);
        double time = 0, tightest = HUGE_VAL;
        for (int j = 0; j < LW_NJ; j++) {
            part_of[j] = part * velocity[j];
            time = fmax(time, fabs(velocity[j]) / l.acceleration[j]);
        }
        for (int i = 0; i < rooms->count; i++) {
            const struct lw_room *room = &rooms->room[i];
            if (!closes(room, velocity))
                continue;
            double closing = 0;
            for (int j = 0; j < LW_NJ; j++)
                closing -= room->gradient[j] * velocity[j];
            const double left = room->room - room->approach * (time + period_s);
            const double need = part * closing * (part * time / 2 + period_s);
            tightest = fmin(tightest, left - need);
            if (part > 0)
                assert_true(way_until_rest(&l, room, part_of) <= room->room + 1e-9);
        }
        cut += part > 0 && part < 1;
        whole += part == 1;
        stopped += part == 0;
        if (part > 0 && part < 1)
            assert_near(tightest, 0, 1e-12);
        else if (part == 0)
            assert_true(tightest <= 0);
        else
            assert_true(tightest >= -1e-12);
    }
    assert_true(cut > 300 && whole > 300 && stopped > 300);
}

// What does not close in asks for no room, not even inside it.
static void leaving_is_free(void **state)
{
    (void)state;
    const struct lw_limits l = limits(8);
    static struct lw_rooms rooms = {.count = 1, .room = {{.gradient = {1}, .room = -0.05, .approach = 1}}};
    const double away[LW_NJ] = {2, -3, 1, 0, 0, 0}, along[LW_NJ] = {0, 3, 0, 0, 0, 0}, towards[LW_NJ] = {-1e-9};
    assert_near(lw_clearance_part(&l, period_s, &rooms, away), 1, 0);
    assert_near(lw_clearance_part(&l, period_s, &rooms, along), 1, 0);
    assert_near(lw_clearance_part(&l, period_s, &rooms, towards), 0, 0);
}

// An axis that is driven at a wall by any wishes never comes nearer than it may, and when it is driven on it comes as
// near as that.
static void a_wall_is_never_reached_and_always_approached(void **state)
{
    (void)state;
    struct random random = {72};
    static struct lw_rooms rooms = {.count = 1};
    for (int n = 0; n < 200; n++) {
        const struct lw_limits l = limits(random_in(&random, 2, 30));
        double q[LW_NJ] = {0}, velocity[LW_NJ] = {0}, command[LW_NJ];
        const double wall = 0.7;
        unsigned seen = 0;
        for (int k = 0; k < 3000; k++) {
            double wish[LW_NJ] = {0};
            random_fill(&random, -2, 2, wish, LW_NJ);
            wish[0] = k < 1500 ? random_in(&random, -1, 3) : 3;
            rooms.room[0] = (struct lw_room){.gradient = {-1}, .room = wall - q[0] - l.clearance};
            const struct lw_guard_input in = {
                .limits = &l, .period_s = period_s, .q = q, .velocity = velocity, .wish = wish};
            seen |= lw_clearance_command(&in, &rooms, command);
            for (int j = 0; j < LW_NJ; j++) {
                assert_true(fabs(command[j] - velocity[j]) <= l.acceleration[j] * period_s + 1e-12);
                q[j] += j == 0 ? period_s * command[j] : 0;
            }
            memcpy(velocity, command, sizeof velocity);
            assert_true(wall - q[0] >= l.clearance - 1e-12);
        }
        assert_true(seen & LW_LIMIT_CLEARANCE);
        assert_near(wall - q[0], l.clearance, 2e-3);
    }
}

// Without rooms it is the guard alone, bit for bit; with a wish that is no number too.
static void without_rooms_nothing_changes(void **state)
{
    (void)state;
    struct random random = {73};
    static struct lw_rooms rooms = {.count = 0};
    for (int n = 0; n < 500; n++) {
        const struct lw_limits l = limits(8);
        double q[LW_NJ], velocity[LW_NJ], wish[LW_NJ], one[LW_NJ], two[LW_NJ];
        random_fill(&random, -6, 6, q, LW_NJ);
        random_fill(&random, -2, 2, velocity, LW_NJ);
        random_fill(&random, -4, 4, wish, LW_NJ);
        if (n % 10 == 0)
            wish[n % LW_NJ] = (double)NAN;
        const struct lw_guard_input in = {
            .limits = &l, .period_s = period_s, .q = q, .velocity = velocity, .wish = wish};
        assert_int_equal(lw_clearance_command(&in, &rooms, one), lw_guard_shape(&in, two));
        assert_same_bits(one, two, sizeof one);
    }
}

// A wish that turns aside at full speed is not followed where the acceleration limits would carry the arm on into the
// wall: it brakes along its way first.
static void acceleration_limits_do_not_carry_it_into_the_wall(void **state)
{
    (void)state;
    const struct lw_limits l = limits(8);
    static struct lw_rooms rooms = {.count = 1};
    // At 2 rad/s braking takes 0.25 s and 0.25 m, and the tick's own way.
    rooms.room[0] = (struct lw_room){.gradient = {-1}, .room = 0.25};
    const double q[LW_NJ] = {0}, velocity[LW_NJ] = {2}, wish[LW_NJ] = {0, 3, 3, 3, 3, 3};
    double command[LW_NJ];
    const struct lw_guard_input in = {.limits = &l, .period_s = period_s, .q = q, .velocity = velocity, .wish = wish};
    assert_true(lw_clearance_command(&in, &rooms, command) & LW_LIMIT_CLEARANCE);
    const double expected[LW_NJ] = {2 - 8 * period_s};
    for (int j = 0; j < LW_NJ; j++)
        assert_near(command[j], expected[j], 1e-12);
}

// No point of the body is faster than its speed says, and some point is nearly as fast: points on all axes, found by
// moving the joints a little.
static void the_speed_is_that_of_the_fastest_point(void **state)
{
    (void)state;
    struct random random = {75};
    static struct lw_surroundings here, there;
    static struct lw_body body;
    lw_body_make(LW_UR10, LW_BODY_CAPSULES_FINE, NULL, &body);
    const double h = 1e-7;
    for (int n = 0; n < 500; n++) {
        double q[LW_NJ], qd[LW_NJ], later[LW_NJ], fastest = 0, thickest = 0;
        random_fill(&random, -3, 3, q, LW_NJ);
        random_fill(&random, -2, 2, qd, LW_NJ);
        for (int j = 0; j < LW_NJ; j++)
            later[j] = q[j] + h * qd[j];
        assert_int_equal(lw_surroundings_place(lw_arm_get(LW_UR10), &body, q, &here), LW_OK);
        assert_int_equal(lw_surroundings_place(lw_arm_get(LW_UR10), &body, later, &there), LW_OK);
        for (int i = 0; i < body.count; i++) {
            double a[3], b[3];
            lw_vec_sub(there.placed.capsule[i].a, here.placed.capsule[i].a, a);
            lw_vec_sub(there.placed.capsule[i].b, here.placed.capsule[i].b, b);
            fastest = fmax(fastest, fmax(lw_vec_norm(a), lw_vec_norm(b)) / h);
            thickest = fmax(thickest, body.part[i].capsule.r);
        }
        double turning = 0;
        for (int j = 0; j < LW_NJ; j++)
            turning += fabs(qd[j]);
        const double speed = lw_surroundings_speed(&here, &body, qd);
        assert_true(speed >= fastest - 1e-5);
        assert_true(speed <= fastest + thickest * turning + 1e-5);
    }
}

// The reach covers every room that could cut the fastest motion possible in the next tick.
static void the_reach_covers_what_could_matter(void **state)
{
    (void)state;
    struct random random = {74};
    static struct lw_body body;
    static struct lw_surroundings here;
    lw_body_make(LW_UR10, LW_BODY_CAPSULES, NULL, &body);
    for (int n = 0; n < 2000; n++) {
        const struct lw_limits l = limits(random_in(&random, 1, 30));
        const double obstacle = random_in(&random, 0, 1);
        double q[LW_NJ], velocity[LW_NJ], next[LW_NJ];
        random_fill(&random, -3, 3, q, LW_NJ);
        random_fill(&random, -2, 2, velocity, LW_NJ);
        for (int j = 0; j < LW_NJ; j++)
            next[j] = velocity[j] + random_in(&random, -1, 1) * l.acceleration[j] * period_s;
        assert_int_equal(lw_surroundings_place(lw_arm_get(LW_UR10), &body, q, &here), LW_OK);
        const struct lw_guard_input in = {.limits = &l, .period_s = period_s, .velocity = velocity};
        const struct lw_law_reach reach = lw_clearance_reach(&in, &body, &here, obstacle);
        // Something straight ahead of any point of the surface, coming at full speed.
        static struct lw_rooms rooms = {.count = 1};
        const int part = random_below(&random, body.count);
        double ahead[3], point[3];
        random_fill(&random, -1, 1, ahead, 3);
        const double length = lw_vec_norm(ahead);
        for (int i = 0; i < 3; i++) {
            ahead[i] /= -length;
            point[i] = here.placed.capsule[part].b[i] - body.part[part].capsule.r * ahead[i];
        }
        rooms.room[0].room = reach.obstacles - l.clearance;
        rooms.room[0].approach = obstacle;
        lw_arm_point_effect(here.frame, body.part[part].link, point, ahead, rooms.room[0].gradient);
        assert_near(lw_clearance_part(&l, period_s, &rooms, next), 1, 1e-12);
    }
    struct lw_limits off = limits(8);
    off.clearance = HUGE_VAL;
    const double velocity[LW_NJ] = {1};
    const struct lw_guard_input in = {.limits = &off, .period_s = period_s, .velocity = velocity};
    assert_near(lw_clearance_reach(&in, &body, &here, 1).obstacles, 0, 0);
}

// --- curved ways ---

static struct lw_snapshot one_ball;
static struct lw_surroundings later; // where braking has led
static struct lw_body braked;
static const struct lw_eyes braked_eyes = {.body = &braked, .world = &one_ball, .reach = HUGE_VAL, .self_reach = 0};

// Tick k of braking along a straight line in joint space. False when the arm has come to rest.
static bool brake_on(const struct lw_limits *l, const double velocity[LW_NJ], int k, double at[LW_NJ])
{
    double time = 0;
    for (int j = 0; j < LW_NJ; j++)
        time = fmax(time, fabs(velocity[j]) / l->acceleration[j]);
    for (int j = 0; j < LW_NJ && k * period_s < time; j++)
        at[j] += period_s * velocity[j] * (1 - k * period_s / time);
    assert_int_equal(lw_surroundings_place(lw_arm_get(LW_UR5), &braked, at, &later), LW_OK);
    return k * period_s < time;
}

// Smallest distance of what can move to the ball while the arm brakes.
static double smallest_while_braking(const struct lw_limits *l, const double q[LW_NJ], const double velocity[LW_NJ])
{
    double at[LW_NJ], smallest = HUGE_VAL;
    memcpy(at, q, sizeof at);
    for (int k = 0; brake_on(l, velocity, k, at); k++) {
        lw_surroundings_look(&braked_eyes, &later);
        for (int i = 0; i < later.near.count; i++)
            if (later.near.pair[i].obstacle != 0 && !later.near.pair[i].fixed)
                smallest = fmin(smallest, later.near.pair[i].distance.d);
    }
    return smallest;
}

// A ball somewhere, an arm somewhere, clear of it and not mounted on it. Returns false when it is not.
static bool draw_start(struct random *random, double q[LW_NJ], struct lw_surroundings *here)
{
    const struct lw_solid ball = {.kind = LW_SPHERE, .radius = 0.1};
    struct lw_pose pose = {.r = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
    random_fill(random, -3, 3, q, LW_NJ);
    random_fill(random, -0.8, 0.8, pose.p, 3);
    lw_snapshot_begin(&one_ball);
    assert_int_equal(lw_snapshot_add(&one_ball, 1, 1, &ball, &pose, NULL), LW_OK);
    lw_snapshot_end(&one_ball);
    assert_int_equal(lw_surroundings_place(lw_arm_get(LW_UR5), &braked, q, here), LW_OK);
    lw_surroundings_look(&braked_eyes, here);
    bool mounted = false;
    for (int i = 0; i < here->near.count; i++)
        mounted |= here->near.pair[i].fixed;
    return !mounted && lw_surroundings_nearest(here, false)->distance.d >= 0.02;
}

// Braked along a straight line in joint space from an allowed velocity no arm comes nearer to a ball than the
// clearance, curved as the ways of its points are; without room for the curve some would.
static void curved_ways_keep_the_clearance(void **state)
{
    (void)state;
    struct random random = {76};
    static struct lw_surroundings here;
    static struct lw_rooms rooms;
    const struct lw_limits l = limits(8);
    const struct lw_law_reach everything = {HUGE_VAL, HUGE_VAL};
    int cut = 0, would_touch = 0;
    lw_body_make(LW_UR5, LW_BODY_CAPSULES, NULL, &braked);
    for (int n = 0; n < 6000; n++) {
        double q[LW_NJ], velocity[LW_NJ], part[2], smallest[2];
        const bool clear = draw_start(&random, q, &here);
        random_fill(&random, -3, 3, velocity, LW_NJ);
        if (!clear)
            continue;
        lw_clearance_rooms(&l, everything, &braked, &here, &rooms);
        for (int straight = 0; straight < 2; straight++) {
            double allowed[LW_NJ];
            rooms.around = straight ? NULL : &here;
            part[straight] = lw_clearance_part(&l, period_s, &rooms, velocity);
            for (int j = 0; j < LW_NJ; j++)
                allowed[j] = part[straight] * velocity[j];
            smallest[straight] = smallest_while_braking(&l, q, allowed);
        }
        cut += part[0] < 1;
        would_touch += smallest[1] < l.clearance - 1e-6;
        assert_true(smallest[0] > l.clearance - 1e-9);
    }
    assert_true(cut > 50);
    assert_true(would_touch > 0);
}

// --- links among one another ---

static struct lw_surroundings folded;
static struct lw_rooms between_links;

// A folded arm whose nearest links are less than 5 cm apart, and the rooms of that pair alone. False when it is not.
static bool draw_folded(struct random *random, const struct lw_limits *l, double q[LW_NJ])
{
    random_fill(random, -3, 3, q, LW_NJ);
    assert_int_equal(lw_surroundings_place(lw_arm_get(LW_UR5), &braked, q, &folded), LW_OK);
    folded.near.count = folded.near.needed = 0;
    lw_near_self(&braked, &folded.placed, 0.05, &folded.near);
    const struct lw_near *nearest = lw_surroundings_nearest(&folded, true);
    if (nearest == NULL)
        return false;
    folded.near.pair[0] = *nearest;
    folded.near.count = 1;
    lw_clearance_rooms(l, (struct lw_law_reach){HUGE_VAL, HUGE_VAL}, &braked, &folded, &between_links);
    return true;
}

// Joints that do not lie between two links move both alike: however near the two are, they are free.
static void what_moves_two_links_alike_is_free(void **state)
{
    (void)state;
    struct random random = {77};
    const struct lw_limits l = limits(8);
    int near = 0;
    lw_body_make(LW_UR5, LW_BODY_CAPSULES, NULL, &braked);
    for (int n = 0; n < 3000; n++) {
        double q[LW_NJ], velocity[LW_NJ], command[LW_NJ];
        if (!draw_folded(&random, &l, q))
            continue;
        const struct lw_near *pair = &folded.near.pair[0];
        random_fill(&random, -3, 3, velocity, LW_NJ);
        for (int j = braked.part[pair->part].link; j < braked.part[pair->other].link; j++)
            velocity[j] = 0;
        near += pair->distance.d < l.clearance;
        assert_true(between_links.count > 0);
        assert_near(lw_clearance_part(&l, period_s, &between_links, velocity), 1, 0);
        const struct lw_guard_input in = {
            .limits = &l, .period_s = period_s, .q = q, .velocity = velocity, .wish = velocity};
        (void)lw_clearance_command(&in, &between_links, command);
        assert_same_bits(command, velocity, sizeof command);
    }
    assert_true(near > 100);
}

// Smallest distance of a pair while the arm brakes.
static double smallest_between(const struct lw_limits *l, const struct lw_near *pair, const double q[LW_NJ],
                               const double velocity[LW_NJ])
{
    struct lw_distance distance;
    double at[LW_NJ], smallest = HUGE_VAL;
    memcpy(at, q, sizeof at);
    for (int k = 0; brake_on(l, velocity, k, at); k++) {
        lw_distance_capsules(&later.placed.capsule[pair->part], &later.placed.capsule[pair->other], &distance);
        smallest = fmin(smallest, distance.d);
    }
    return smallest;
}

// Braked from an allowed velocity no two links come nearer than the clearance; from the whole velocity many would.
static void links_keep_the_clearance_from_each_other(void **state)
{
    (void)state;
    struct random random = {78};
    const struct lw_limits l = limits(8);
    int cut = 0, would_touch = 0;
    lw_body_make(LW_UR5, LW_BODY_CAPSULES, NULL, &braked);
    for (int n = 0; n < 6000; n++) {
        double q[LW_NJ], velocity[LW_NJ], allowed[LW_NJ];
        random_fill(&random, -3, 3, velocity, LW_NJ);
        if (!draw_folded(&random, &l, q) || folded.near.pair[0].distance.d < 0.012)
            continue;
        const double part = lw_clearance_part(&l, period_s, &between_links, velocity);
        for (int j = 0; j < LW_NJ; j++)
            allowed[j] = part * velocity[j];
        cut += part < 1;
        would_touch += smallest_between(&l, &folded.near.pair[0], q, velocity) < l.clearance;
        assert_true(smallest_between(&l, &folded.near.pair[0], q, allowed) > l.clearance - 1e-9);
    }
    assert_true(cut > 100 && would_touch > 100);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(what_moves_two_links_alike_is_free),
                                       cmocka_unit_test(links_keep_the_clearance_from_each_other),
                                       cmocka_unit_test(the_part_is_the_largest_that_can_be_braked),
                                       cmocka_unit_test(leaving_is_free),
                                       cmocka_unit_test(a_wall_is_never_reached_and_always_approached),
                                       cmocka_unit_test(without_rooms_nothing_changes),
                                       cmocka_unit_test(acceleration_limits_do_not_carry_it_into_the_wall),
                                       cmocka_unit_test(curved_ways_keep_the_clearance),
                                       cmocka_unit_test(the_speed_is_that_of_the_fastest_point),
                                       cmocka_unit_test(the_reach_covers_what_could_matter)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
