// SPDX-License-Identifier: BSD-3-Clause
// Batch: a whole scene in this process, controller tick and plant step in turn. The same two functions as the live
// programs, so the numbers are those of a lockstep run over the bus, bit for bit.
//
// Units    metres, radians, seconds.
// Frames   base frame of the arm.
// Arrays   row k belongs to controller period k; rows = lw_scene_steps(scene) + 1.
// Memory   the caller owns the result's arrays; the run's own memory is freed.
// Errors   enum lw_status.
#ifndef LW_SIMULATOR_BATCH_H
#define LW_SIMULATOR_BATCH_H

#include "scene/scene.h" // struct lw_scene

struct lw_batch_result {
    double *t;              // [rows] s
    double *q;              // [rows][6] rad
    double *qd;             // [rows][6] rad/s, commanded at q
    double *tip;            // [rows][3] m
    double *deviation;      // [rows] m, tip to goal
    double *clearance;      // [rows] m, smallest, arm to obstacles; infinite without obstacles
    double *self_clearance; // [rows] m, smallest, of links watched against each other; infinite where none is near
    int *flags;             // [rows] set of enum lw_flag
    int *outcome;           // [rows] enum lw_law_outcome
};

// Runs a scene. Fails LW_E_FULL when there is no memory. Cost: about a microsecond a row with few obstacles.
LW_MUST_CHECK enum lw_status lw_batch_run(const struct lw_scene *scene, const struct lw_batch_result *result);

#endif
