// SPDX-License-Identifier: BSD-3-Clause
// The field on the whole arm: the joint velocities of the law are minus the gradient of the stated potential by the
// joint positions, found by central differences, for every shape, moving or not, and for the arm against itself.
//
// Units    metres, radians, seconds.
// Frames   base frame.
// Arrays   one entry a joint.
// Memory   static: surroundings and snapshots are large.
// Errors   cmocka's.
#include "base/vec.h" // lw_vec_*
#include "controller/apf.h"
#include "helpers.h"

enum { CONFIGURATIONS = 150 };

static struct lw_snapshot world;
static struct lw_surroundings around;
static struct lw_body body;
static int compared, doubtful; // slopes, and those whose own error is above a millionth

static struct lw_law_params params(int gamma)
{
    return (struct lw_law_params){.apf = {.attraction = LW_ATTRACTION_CONE,
                                          .gamma = gamma,
                                          .k_a = 1,
                                          .eta = 0.02,
                                          .rho_rep = 0.4,
                                          .distance_min = 0.005,
                                          .approach_s = 0.3,
                                          .eta_self = 0.001,
                                          .rho_self = 0.15}};
}

static void look(const struct lw_law_params *law, const double q[LW_NJ])
{
    const struct lw_law_reach reach = lw_apf_law.reach(law, world.speed_max);
    const struct lw_eyes eyes = {.body = &body, .world = &world, .reach = reach.obstacles, .self_reach = reach.self};
    assert_int_equal(lw_surroundings_place(lw_arm_get(LW_UR5), &body, q, &around), LW_OK);
    lw_surroundings_look(&eyes, &around);
}

static double closing(const struct lw_near *pair)
{
    return fmax(lw_vec_dot(pair->distance.n, pair->velocity), 0);
}

// The potential as apf.h states it: a straight line below distance_min, nothing above rho.
static double potential(const struct lw_apf_params *p, const struct lw_near *pair, double come)
{
    const bool self = pair->obstacle == 0;
    const double rho = self ? p->rho_self : p->rho_rep, eta = self ? p->eta_self : p->eta;
    const double d = pair->distance.d - p->approach_s * come, near = fmax(d, p->distance_min);
    if (d > rho)
        return 0;
    const double slope = -eta / 2 * p->gamma * pow(1 / near - 1 / rho, p->gamma - 1) / (near * near);
    return eta / 2 * pow(1 / near - 1 / rho, p->gamma) + slope * (d - near);
}

// Sum over all pairs at a configuration. Closing speeds count as given: those of `pairs`, looked up by part and id.
static double sum(const struct lw_law_params *law, const double q[LW_NJ], const struct lw_near_list *pairs)
{
    double total = 0;
    look(law, q);
    for (int i = 0; i < around.near.count; i++) {
        const struct lw_near *pair = &around.near.pair[i];
        double come = 0;
        for (int k = 0; k < pairs->count; k++)
            if (pairs->pair[k].part == pair->part && pairs->pair[k].obstacle == pair->obstacle)
                come = closing(&pairs->pair[k]);
        total += potential(&law->apf, pair, pair->obstacle == 0 ? 0 : come);
    }
    return total;
}

// Central difference of the sum by one joint, its error of second order removed.
static double slope(const struct lw_law_params *law, const double q[LW_NJ], int joint, double h,
                    const struct lw_near_list *pairs)
{
    double value[4];
    for (int i = 0; i < 4; i++) {
        double moved[LW_NJ];
        memcpy(moved, q, sizeof moved);
        moved[joint] += h * (i < 2 ? 1 : 2) * (i % 2 == 0 ? 1 : -1);
        value[i] = sum(law, moved, pairs);
    }
    return (8 * (value[0] - value[1]) - (value[2] - value[3])) / (12 * h);
}

// Whether a pair of the list is so near the end of its field that a difference would reach beyond, or left out because
// the joints hardly change it.
static bool at_an_end(const struct lw_apf_params *p, const struct lw_near_list *pairs)
{
    bool any = false;
    for (int i = 0; i < pairs->count; i++) {
        const struct lw_near *pair = &pairs->pair[i];
        const bool self = pair->obstacle == 0;
        const double d = pair->distance.d - (self ? 0 : p->approach_s * closing(pair));
        any |= fabs(d - (self ? p->rho_self : p->rho_rep)) < 2e-3 || d < 2e-3 + p->distance_min;
        any |= (pair->distance.flags & LW_DISTANCE_CORE) != 0 || pair->fixed;
    }
    return any;
}

// Compares the law with the slopes at one configuration. Returns whether anything repelled.
static bool check(const struct lw_law_params *law, const double q[LW_NJ])
{
    static struct lw_near_list pairs;
    static const double no_circulation[3] = {0};
    double qd[LW_NJ];
    look(law, q);
    memcpy(&pairs, &around.near, sizeof pairs);
    if (at_an_end(&law->apf, &pairs))
        return false;
    double tip[3];
    memcpy(tip, around.frame[LW_NJ - 1].p, sizeof tip);
    const struct lw_law_input in = {.around = &around, .body = &body, .goal = tip, .circulation = no_circulation};
    lw_apf_law.step(law, &in, qd);
    double size = 0;
    for (int j = 0; j < LW_NJ; j++)
        size = fmax(size, fabs(qd[j]));
    for (int j = 0; j < LW_NJ && size > 0; j++) {
        // Where features change within the step the difference has an error of its own: a smaller step shows that.
        const double wide = slope(law, q, j, 1e-4, &pairs), narrow = slope(law, q, j, 2e-5, &pairs);
        const double own = fabs(wide - narrow);
        assert_near(qd[j], -narrow, 1e-6 * size + 2 * own);
        doubtful += own > 1e-6 * size;
        compared++;
    }
    return size > 0;
}

// An obstacle of a kind somewhere around the arm; half of them move.
static void random_world(struct random *random, enum lw_shape_kind kind)
{
    static double vertex[3 * 20];
    struct lw_solid solid = {.kind = kind,
                             .radius = kind == LW_HALFSPACE ? 0 : random_in(random, 0.01, 0.15),
                             .half_length = random_in(random, 0.05, 0.3),
                             .normal = {0, 0, 1},
                             .count = 20,
                             .vertex = vertex};
    random_fill(random, 0.03, 0.2, solid.half, 3);
    random_fill(random, -0.2, 0.2, vertex, 3 * 20);
    double p[3], quaternion[4];
    random_fill(random, -0.8, 0.8, p, 3);
    random_fill(random, -1, 1, quaternion, 4);
    if (kind == LW_HALFSPACE) {
        p[2] = -0.35;
        random_fill(random, -0.2, 0.2, &quaternion[1], 3);
        quaternion[0] = 1;
    }
    double length = 0;
    for (int i = 0; i < 4; i++)
        length += quaternion[i] * quaternion[i];
    for (int i = 0; i < 4; i++)
        quaternion[i] /= sqrt(length);
    struct lw_pose pose;
    assert_int_equal(lw_pose_make(p, quaternion, &pose), LW_OK);
    struct lw_motion motion = {0};
    if (random_below(random, 2) == 0) {
        random_fill(random, -0.3, 0.3, motion.v, 3);
        random_fill(random, -1, 1, motion.omega, 3);
    }
    lw_snapshot_begin(&world);
    assert_int_equal(lw_snapshot_add(&world, 7, 1, &solid, &pose, &motion), LW_OK);
    lw_snapshot_end(&world);
}

static void check_kind(enum lw_shape_kind kind, uint64_t seed)
{
    struct random random = {seed};
    compared = doubtful = 0;
    for (int model = LW_BODY_JOINTS; model <= LW_BODY_CAPSULES_FINE; model++) {
        int seen = 0;
        lw_body_make(LW_UR5, (enum lw_body_model)model, NULL, &body);
        for (int n = 0; n < 400 && seen < CONFIGURATIONS; n++) {
            const struct lw_law_params law = params(1 + random_below(&random, 2));
            double q[LW_NJ];
            random_fill(&random, -3, 3, q, LW_NJ);
            random_world(&random, kind);
            seen += check(&law, q);
        }
        assert_true(seen > CONFIGURATIONS / 4);
    }
    print_message("%d slopes compared, %d of them doubtful\n", compared, doubtful);
    assert_true(doubtful * 20 < compared);
}

static void sphere(void **state)
{
    (void)state;
    check_kind(LW_SPHERE, 81);
}
static void capsule(void **state)
{
    (void)state;
    check_kind(LW_CAPSULE, 82);
}
static void box(void **state)
{
    (void)state;
    check_kind(LW_BOX, 83);
}
static void hull(void **state)
{
    (void)state;
    check_kind(LW_HULL, 84);
}
static void halfspace(void **state)
{
    (void)state;
    check_kind(LW_HALFSPACE, 85);
}

// Nothing but the arm itself.
static void the_arm_against_itself(void **state)
{
    (void)state;
    struct random random = {86};
    int seen = 0;
    lw_snapshot_begin(&world);
    lw_snapshot_end(&world);
    lw_body_make(LW_UR5, LW_BODY_CAPSULES, NULL, &body);
    for (int n = 0; n < 20000 && seen < 100; n++) {
        const struct lw_law_params law = params(2);
        double q[LW_NJ];
        random_fill(&random, -3, 3, q, LW_NJ);
        seen += check(&law, q);
    }
    assert_true(seen >= 100);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(sphere),    cmocka_unit_test(capsule),
                                       cmocka_unit_test(box),       cmocka_unit_test(hull),
                                       cmocka_unit_test(halfspace), cmocka_unit_test(the_arm_against_itself)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
