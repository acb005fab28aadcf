// SPDX-License-Identifier: BSD-3-Clause
// Tables of the arms: UR5 (CB3 manual, equal to the URDF) and UR10 (URDF).
//
// Units    metres, radians, seconds.
// Frames   standard DH, see arm.h.
// Arrays   one entry a joint, base to wrist 3.
// Memory   constants.
// Errors   none.
#include "arm/arm.h"

#define PI 3.14159265358979323846

// alpha is +pi/2, 0, 0, +pi/2, -pi/2, 0 on both arms; the exact cosines and sines stand here.
#define UR_ALPHA .cos_alpha = {0, 1, 1, 0, 0, 1}, .sin_alpha = {1, 0, 0, 1, -1, 0}
#define UR_RANGE .position_max = {2 * PI, 2 * PI, 2 * PI, 2 * PI, 2 * PI, 2 * PI}

static const struct lw_arm arms[LW_ROBOT_COUNT] = {
    [LW_UR5] = {.name = "ur5",
                .a = {0, -0.425, -0.39225, 0, 0, 0},
                .d = {0.089159, 0, 0, 0.10915, 0.09465, 0.0823},
                UR_ALPHA,
                UR_RANGE,
                .velocity_max = {PI, PI, PI, PI, PI, PI}},
    [LW_UR10] = {.name = "ur10",
                 .a = {0, -0.612, -0.5723, 0, 0, 0},
                 .d = {0.1273, 0, 0, 0.163941, 0.1157, 0.0922},
                 UR_ALPHA,
                 UR_RANGE,
                 .velocity_max = {2 * PI / 3, 2 * PI / 3, PI, PI, PI, PI}},
};

const struct lw_arm *lw_arm_get(enum lw_robot robot)
{
    return &arms[robot];
}
