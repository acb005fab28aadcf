// SPDX-License-Identifier: BSD-3-Clause
// Law `apf`: artificial potential field of Tezak & Truntic 2020, equations (1) to (6).
//
// Units    metres; forces are read as joint velocities per lever arm (rad/s per m).
// Frames   base frame of the arm.
// Arrays   see law.h.
// Memory   see law.h.
// Errors   see law.h.
#ifndef LW_CONTROLLER_APF_H
#define LW_CONTROLLER_APF_H

#include "controller/law.h" // struct lw_law

extern const struct lw_law lw_apf_law;

// Attractive force on the tip, -grad of (1) U_attr = k_a |G - p|; with cone_par proportional within r0.
//   force  out  [3]; zero within 1e-12 m of the goal
void lw_apf_attraction(const struct lw_apf_params *params, const double tip[3], const double goal[3], double force[3]);

// Size of the repulsive force, -d/dd of (2) U_rep = (eta/2) (1/d - 1/rho)^gamma for d <= rho, else 0.
//   distance  m, to the obstacle's surface; below distance_min it counts as distance_min
double lw_apf_repulsion(const struct lw_apf_params *params, double distance);

#endif
