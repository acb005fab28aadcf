// SPDX-License-Identifier: BSD-3-Clause
// A controller and an arm that does what it is told, tick by tick.
//
// Units    metres, radians, seconds; ns where a name says so.
// Frames   base frame.
// Arrays   one entry a joint.
// Memory   static.
// Errors   cmocka's.
#ifndef LW_TESTS_TICK_RIG_H
#define LW_TESTS_TICK_RIG_H

#include "balls.h"
#include "controller/tick.h"
#include "helpers.h"

enum { PLANT = 100, CONTROLLER = 200, OPERATOR = 7, OTHER = 8 };
static const int64_t ms = 1000000;

// A controller and an arm that does what it is told.
struct rig {
    struct lw_scene scene;
    struct lw_controller config;
    struct lw_controller_state state;
    struct lw_joint_state joint;
    struct lw_snapshot world;
    struct lw_request request;
    int64_t age_ns;
    bool warming_up;
    struct lw_joint_command out;
};

static inline struct rig *start(void)
{
    static struct rig rig;
    memset(&rig, 0, sizeof rig);
    rig.scene = lw_scene_defaults(LW_UR5);
    const double q0[LW_NJ] = {0, -1.2, 1.6, -0.4, 0.3, 0}, goal[3] = {0.25, -0.6, 0.25};
    memcpy(rig.scene.goal, goal, sizeof goal);
    assert_int_equal(lw_controller_init(&rig.config, &rig.state, &rig.scene, CONTROLLER), LW_OK);
    rig.joint = (struct lw_joint_state){.stamp = {1, 2, PLANT, 4},
                                        .mode = LW_PLANT_MOVING,
                                        .command_session = CONTROLLER,
                                        .tick = 5,
                                        .period_ns = 2 * ms};
    memcpy(rig.joint.q, q0, sizeof q0);
    rig.world.version = 1;
    return &rig;
}

static inline void tick(struct rig *rig)
{
    const struct lw_tick_input in = {.time_ns = rig->state.tick * rig->config.period_ns,
                                     .state_age_ns = rig->age_ns,
                                     .warming_up = rig->warming_up,
                                     .joint = &rig->joint,
                                     .world = &rig->world,
                                     .request = &rig->request};
    memset(&rig->out, 0x5a, sizeof rig->out);
    lw_tick(&rig->config, &rig->state, &in, &rig->out);
}

// A tick, then the arm moves as commanded.
static inline void go(struct rig *rig)
{
    tick(rig);
    for (int j = 0; j < LW_NJ; j++) {
        rig->joint.qd[j] = rig->out.qd[j];
        rig->joint.q[j] += 0.002 * rig->out.qd[j];
    }
    rig->joint.tick++;
    rig->joint.stamp.seq++;
}

static inline void go_for(struct rig *rig, int ticks)
{
    for (int k = 0; k < ticks; k++)
        go(rig);
}

static inline double speed(const struct rig *rig)
{
    double fastest = 0;
    for (int j = 0; j < LW_NJ; j++)
        fastest = fmax(fastest, fabs(rig->out.qd[j]));
    return fastest;
}

static inline void ask(struct rig *rig, enum lw_request_kind kind, int64_t session, int64_t seq, double x)
{
    rig->request = (struct lw_request){.stamp = {.session = session, .seq = seq}, .kind = kind, .goal = {x, -0.5, 0.3}};
}

// From a speed the arm brakes at 8 rad/s^2 and for no longer than that takes.
static inline void check_brakes_to_rest(struct rig *rig, unsigned reason)
{
    const double before = speed(rig);
    assert_true(before > 0.05);
    const int needed = (int)ceil(before / 0.016 - 1e-9);
    for (int k = 1; k <= needed; k++) {
        go(rig);
        assert_int_equal(rig->out.flags & ~(unsigned)LW_LIMIT_ACCELERATION, reason);
        assert_near(speed(rig), fmax(0, before - 0.016 * k), 1e-9);
        assert_int_equal(rig->out.mode, LW_COMMAND_VELOCITY);
    }
    assert_true(lw_controller_at_rest(&rig->state));
}

#endif
