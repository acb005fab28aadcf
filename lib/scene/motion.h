// SPDX-License-Identifier: BSD-3-Clause
// Motion of a scene's obstacles: where each is at any time, and its velocity, the exact derivative of that.
//
// Units    metres, radians, seconds of motion.
// Frames   base frame of the arm.
// Arrays   points [3] x y z, quaternions w x y z.
// Memory   none; pure functions of scene and time.
// Errors   none for a scene that was checked.
#ifndef LW_SCENE_MOTION_H
#define LW_SCENE_MOTION_H

#include "scene/scene.h" // struct lw_scene

// Where an obstacle is and how it moves.
struct lw_moving {
    double p[3];     // m, its origin
    double quat[4];  // base <- shape
    double v[3];     // m/s, of p
    double omega[3]; // rad/s, about p
};

// An obstacle at a time. Until its start it stands still; at a corner of its way the velocity is that of the way behind
// it. The same scene and time give the same bits.
void lw_motion_at(const struct lw_scene *scene, const struct lw_scene_obstacle *obstacle, double t,
                  struct lw_moving *out);

// Whether an obstacle moves at all.
bool lw_motion_moves(const struct lw_scene_obstacle *obstacle);

// Time that the way along the waypoints takes, of a loop with the way back; s.
double lw_motion_length_s(const struct lw_scene *scene, const struct lw_scene_obstacle *obstacle);

#endif
