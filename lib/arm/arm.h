// SPDX-License-Identifier: BSD-3-Clause
// Kinematics of a six-joint UR arm from its Denavit-Hartenberg table.
//
// Units    metres, radians, seconds. Angles are not wrapped.
// Frames   0 is the base (the world of every message), i = 1..6 is fixed to link i, 6 is the flange (tip).
// Arrays   a rotation is row-major [9]; a Jacobian is row-major: linear rows first, columns are joints.
// Memory   no function here allocates, blocks or keeps state between calls.
// Errors   enum lw_status; on failure the outputs are unchanged.
#ifndef LW_ARM_ARM_H
#define LW_ARM_ARM_H

#include "base/status.h" // enum lw_status

enum { LW_NJ = 6 };

enum lw_robot { LW_UR5, LW_UR10, LW_ROBOT_COUNT };

// Constant description of one robot.
struct lw_arm {
    const char *name;
    double a[LW_NJ];            // m, DH link lengths
    double d[LW_NJ];            // m, DH link offsets
    double cos_alpha[LW_NJ];    // exactly 0 or +1: alpha is 0 or +-pi/2
    double sin_alpha[LW_NJ];    // exactly 0, +1 or -1
    double position_max[LW_NJ]; // rad, joint range is +- this
    double velocity_max[LW_NJ]; // rad/s
};

// Pose of a frame in the base frame.
struct lw_pose {
    double r[9]; // rotation, row-major: columns are the frame's axes
    double p[3]; // m, origin
};

// The arm model of a robot; static data, never NULL for a valid robot.
const struct lw_arm *lw_arm_get(enum lw_robot robot);

// Pose of every frame 1..6 in the base frame (standard DH: Rz(q) Tz(d) Tx(a) Rx(alpha)).
//   q      in   [6] rad
//   frame  out  [6] frame[i] is frame i+1
// Fails LW_E_NOT_FINITE. Cost: 6 sin/cos pairs, no branch on data.
LW_MUST_CHECK enum lw_status lw_arm_fk(const struct lw_arm *arm, const double q[LW_NJ], struct lw_pose frame[LW_NJ]);

// Geometric Jacobian [6x6] of the tip, linear rows first, base axes: column j = (z_{j-1} x (o_6 - o_{j-1}); z_{j-1}).
//   frame     in   [6] from lw_arm_fk
//   jacobian  out  [36] rows 0-2 m/rad, rows 3-5 rad/rad
void lw_arm_jacobian(const struct lw_pose frame[LW_NJ], double jacobian[36]);

// Position Jacobian [3x6] of a point fixed to a link; columns of joints beyond the link are 0.
//   link      in   1..6, frame the point is fixed to
//   point     in   [3] m, base frame
//   jacobian  out  [18] m/rad
void lw_arm_point_jacobian(const struct lw_pose frame[LW_NJ], int link, const double point[3], double jacobian[18]);

// Speeds along a direction of a point fixed to a link, a joint each: n . J_x. The gradient of whatever grows along n.
//   n       in   [3] direction, base frame
//   effect  out  [6] m/rad for a unit n; joints beyond the link are 0
void lw_arm_point_effect(const struct lw_pose frame[LW_NJ], int link, const double point[3], const double n[3],
                         double effect[LW_NJ]);

// Motion of a link: a point x of it moves with at_base + angular x x.
struct lw_twist {
    double at_base[3]; // m/s, of the point of the link, thought large, that is at the base origin
    double angular[3]; // rad/s
};

// Motion of every link 1..6 at joint velocities qd [6] rad/s.
void lw_arm_twists(const struct lw_pose frame[LW_NJ], const double qd[LW_NJ], struct lw_twist twist[LW_NJ]);

// Forces on the links, summed per link: the input of lw_arm_joint_effect.
struct lw_wrench {
    double force[LW_NJ][3];  // sum of F, link i+1
    double moment[LW_NJ][3]; // sum of x cross F about the base origin, link i+1
};

// Adds force F acting at point x of a link (1..6), both in the base frame.
void lw_wrench_add(struct lw_wrench *wrench, int link, const double point[3], const double force[3]);

// Joint effect of all forces, sum of J_x^T F, by one backward recursion instead of a Jacobian a force:
// S += S_j, M += M_j, effect_j = z_{j-1} . (M - o_{j-1} x S) for j = 6..1.
//   effect  out  [6] N m for forces in N; rad/s where a law reads forces as velocities
void lw_arm_joint_effect(const struct lw_pose frame[LW_NJ], const struct lw_wrench *wrench, double effect[LW_NJ]);

#endif
