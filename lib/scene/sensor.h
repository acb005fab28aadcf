// SPDX-License-Identifier: BSD-3-Clause
// Sensor: what a perception source that sees a scene's obstacles sends, sample by sample. Live, in lockstep and in
// batch runs the simulator sends the same messages of the same samples.
//
// A sample is taken every 1 / sensor.rate_hz of motion time, at whole multiples of that, and told sensor.latency_s
// later; before the arm moves it is always sample 0. Its messages, in this order:
//   HULL               hulls with their vertices: all in sample 0, each when it comes into sight and once a second
//   OBSTACLES, UPSERT  obstacles of other shapes, 32 in a message
//   OBSTACLES, UPSERT  the other hulls by their ids alone
//   OBSTACLES, REMOVE  those that were seen in the sample before and no longer are
// When there is nothing to tell it is one UPSERT of nothing, so that the world is known to be empty. REPLACE is never
// sent: each message of a sample would drop what the one before has told. Hulls have messages of their own, because one
// whose vertices got lost makes its whole message unknown to the receiver. What gets lost comes again with the next
// sample, vertices within a second; what is no longer told expires.
//
// Units    metres, seconds; ns and ms where a name says so.
// Frames   base frame of the arm.
// Arrays   as struct lw_obstacle_change.
// Memory   plain data of some 70 kB; the scene has to live as long.
// Errors   none for a scene that was checked.
#ifndef LW_SCENE_SENSOR_H
#define LW_SCENE_SENSOR_H

#include "collision/obstacle.h" // struct lw_obstacle, struct lw_obstacle_change
#include "scene/scene.h"        // struct lw_scene

// What is told of an obstacle, in the order of the messages.
enum lw_telling { LW_TELL_VERTICES, LW_TELL_OTHERS, LW_TELL_NAMES, LW_TELL_GONE, LW_TELLINGS };

struct lw_sensor {
    const struct lw_scene *scene;
    int64_t period_ns, latency_ns;
    int valid_for_ms;
    int64_t hull_samples; // vertices of a hull come again after so many

    int64_t sample;                              // seen last, -1 = none
    int64_t age_ns;                              // of that sample, when it was looked at
    bool is_seen[LW_SCENE_OBSTACLES];            // in it, by place in the scene
    struct lw_obstacle seen[LW_SCENE_OBSTACLES]; // by place in the scene
    int count[LW_TELLINGS];                      // obstacles to tell, by enum lw_telling
    int place[LW_TELLINGS][LW_SCENE_OBSTACLES];  // in the scene
};

void lw_sensor_init(struct lw_sensor *sensor, const struct lw_scene *scene);

// Looks at the scene at a time of motion: takes the newest sample that may be told by then. Returns false when that was
// taken before; its messages then are those of a repetition.
bool lw_sensor_look(struct lw_sensor *sensor, int64_t motion_ns);

// Message number i of the sample taken last; false when it has no more.
//   now_ns  in   when the sensor looked, on the clock of the receiver; the message says how long before that it saw
bool lw_sensor_tell(const struct lw_sensor *sensor, int64_t now_ns, int i, struct lw_obstacle_change *change);

#endif
