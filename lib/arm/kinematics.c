// SPDX-License-Identifier: BSD-3-Clause
// Forward kinematics and Jacobians of a DH chain, without 4x4 products.
//
// Units    metres, radians.
// Frames   see arm.h.
// Arrays   see arm.h.
// Memory   caller's only.
// Errors   see arm.h.
#include "arm/arm.h"

#include "base/vec.h" // lw_vec_*, lw_all_finite

#include <math.h>   // sin, cos
#include <string.h> // memset

// Axis and origin of the frame a joint turns about: joint 0..5 turns about z of frame `joint`.
static void joint_axis(const struct lw_pose frame[LW_NJ], int joint, double axis[3], double origin[3])
{
    for (int i = 0; i < 3; i++) {
        axis[i] = joint == 0 ? (i == 2) : frame[joint - 1].r[3 * i + 2];
        origin[i] = joint == 0 ? 0.0 : frame[joint - 1].p[i];
    }
}

// Next frame of the chain: xn = c x + s y, yt = -s x + c y, p += d z + a xn, then the turn by alpha about xn.
static void next_frame(const struct lw_arm *arm, int joint, double q, const struct lw_pose *from, struct lw_pose *to)
{
    const double c = cos(q), s = sin(q);
    const double ca = arm->cos_alpha[joint], sa = arm->sin_alpha[joint];
    for (int i = 0; i < 3; i++) {
        const double *row = &from->r[3 * i];
        const double x = c * row[0] + s * row[1];
        const double y = -s * row[0] + c * row[1];
        const double z = row[2];
        to->p[i] = from->p[i] + arm->d[joint] * z + arm->a[joint] * x;
        to->r[3 * i] = x;
        to->r[3 * i + 1] = ca * y + sa * z;
        to->r[3 * i + 2] = -sa * y + ca * z;
    }
}

enum lw_status lw_arm_fk(const struct lw_arm *arm, const double q[LW_NJ], struct lw_pose frame[LW_NJ])
{
    static const struct lw_pose base = {.r = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
    if (!lw_all_finite(q, LW_NJ))
        return LW_E_NOT_FINITE;
    for (int j = 0; j < LW_NJ; j++)
        next_frame(arm, j, q[j], j == 0 ? &base : &frame[j - 1], &frame[j]);
    return LW_OK;
}

void lw_arm_jacobian(const struct lw_pose frame[LW_NJ], double jacobian[36])
{
    for (int j = 0; j < LW_NJ; j++) {
        double axis[3], origin[3], lever[3], linear[3];
        joint_axis(frame, j, axis, origin);
        lw_vec_sub(frame[LW_NJ - 1].p, origin, lever);
        lw_vec_cross(axis, lever, linear);
        for (int i = 0; i < 3; i++) {
            jacobian[LW_NJ * i + j] = linear[i];
            jacobian[LW_NJ * (i + 3) + j] = axis[i];
        }
    }
}

void lw_arm_point_jacobian(const struct lw_pose frame[LW_NJ], int link, const double point[3], double jacobian[18])
{
    memset(jacobian, 0, 18 * sizeof *jacobian);
    for (int j = 0; j < link; j++) {
        double axis[3], origin[3], lever[3], linear[3];
        joint_axis(frame, j, axis, origin);
        lw_vec_sub(point, origin, lever);
        lw_vec_cross(axis, lever, linear);
        for (int i = 0; i < 3; i++)
            jacobian[LW_NJ * i + j] = linear[i];
    }
}

void lw_arm_point_effect(const struct lw_pose frame[LW_NJ], int link, const double point[3], const double n[3],
                         double effect[LW_NJ])
{
    double axis[3], origin[3], lever[3], moment[3];
    for (int j = 0; j < LW_NJ; j++) {
        effect[j] = 0;
        if (j >= link)
            continue;
        joint_axis(frame, j, axis, origin);
        lw_vec_sub(point, origin, lever);
        lw_vec_cross(lever, n, moment);
        effect[j] = lw_vec_dot(axis, moment);
    }
}

void lw_arm_twists(const struct lw_pose frame[LW_NJ], const double qd[LW_NJ], struct lw_twist twist[LW_NJ])
{
    struct lw_twist sum = {{0}, {0}};
    for (int j = 0; j < LW_NJ; j++) {
        double axis[3], origin[3], at_base[3];
        joint_axis(frame, j, axis, origin);
        lw_vec_cross(origin, axis, at_base);
        lw_vec_add_scaled(qd[j], axis, sum.angular);
        lw_vec_add_scaled(qd[j], at_base, sum.at_base);
        twist[j] = sum;
    }
}

void lw_wrench_add(struct lw_wrench *wrench, int link, const double point[3], const double force[3])
{
    double moment[3];
    lw_vec_cross(point, force, moment);
    lw_vec_add_scaled(1.0, force, wrench->force[link - 1]);
    lw_vec_add_scaled(1.0, moment, wrench->moment[link - 1]);
}

void lw_arm_joint_effect(const struct lw_pose frame[LW_NJ], const struct lw_wrench *wrench, double effect[LW_NJ])
{
    double force[3] = {0}, moment[3] = {0};
    for (int j = LW_NJ - 1; j >= 0; j--) {
        // All that acts beyond joint j turns it.
        lw_vec_add_scaled(1.0, wrench->force[j], force);
        lw_vec_add_scaled(1.0, wrench->moment[j], moment);
        double axis[3], origin[3], shift[3];
        joint_axis(frame, j, axis, origin);
        lw_vec_cross(origin, force, shift);
        lw_vec_sub(moment, shift, shift);
        effect[j] = lw_vec_dot(axis, shift);
    }
}
