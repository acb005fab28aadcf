// SPDX-License-Identifier: BSD-3-Clause
// Law `apf`: artificial potential field of Tezak & Truntic 2020, equations (1) to (6), on points or on the whole arm.
//
// Repulsive potential of a pair (part of the arm, obstacle) at signed distance d of their surfaces:
//   U(d) = (eta/2) (1/d' - 1/rho)^gamma, d' = d - approach_s * closing, for d' <= rho, else 0                       (2)
// closing >= 0 is the speed at which the obstacle's nearest point comes (Ge & Cui 2002 let the distance shrink
// likewise); it counts as given, so that the force is -grad U at that speed. Below distance_min U goes on as a straight
// line. Parts of the arm repel one another by the same potential with eta_self and rho_self.
//
// Units    metres; forces are read as joint velocities per lever arm (rad/s per m).
// Frames   base frame of the arm.
// Arrays   see law.h.
// Memory   see law.h.
// Errors   see law.h.
#ifndef LW_CONTROLLER_APF_H
#define LW_CONTROLLER_APF_H

#include "controller/law.h" // struct lw_law

#include <stdbool.h> // bool

extern const struct lw_law lw_apf_law;

// One repulsive field.
struct lw_apf_field {
    int gamma;
    double eta, rho, distance_min;
};

// That against obstacles, or that of the arm against itself.
struct lw_apf_field lw_apf_field_of(const struct lw_apf_params *params, bool self);

// Attractive force on the tip, -grad of (1) U_attr = k_a |G - p|; with cone_par proportional within r0.
//   force  out  [3]; zero within 1e-12 m of the goal
void lw_apf_attraction(const struct lw_apf_params *params, const double tip[3], const double goal[3], double force[3]);

// Size of the repulsive force, -dU/dd.
//   distance  m, d' above; below distance_min it counts as distance_min
double lw_apf_repulsion(const struct lw_apf_field *field, double distance);

#endif
