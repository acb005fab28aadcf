// SPDX-License-Identifier: BSD-3-Clause
// What a scene says about obstacles, about the sensor that reports them, and about the tool on the flange.
//
// Units    metres, seconds, Hz; degrees where a name says so.
// Frames   base frame of the arm; the tool in frame 6.
// Arrays   points [3] x y z; rows of numbers lie in the scene's pool (scene.h).
// Memory   plain data.
// Errors   LW_E_SCENE with one line of text.
#ifndef LW_SCENE_SCENE_OBSTACLES_H
#define LW_SCENE_SCENE_OBSTACLES_H

#include "base/schema.h" // struct lw_rows, struct lw_key

struct lw_scene;

// Obstacles of a scene, and numbers in all lists of vertices, waypoints and times together.
enum { LW_SCENE_OBSTACLES = 256, LW_SCENE_NUMBERS = 6144 };

enum lw_motion_kind { LW_MOTION_NONE, LW_MOTION_WAYPOINTS, LW_MOTION_CIRCLE, LW_MOTION_RANDOM };
enum lw_motion_repeat { LW_REPEAT_ONCE, LW_REPEAT_LOOP, LW_REPEAT_BACK_AND_FORTH };

// How an obstacle moves from where it starts (scene/motion.h).
struct lw_scene_motion {
    int kind;                 // enum lw_motion_kind
    struct lw_rows waypoints; // m, [3] each: the places it goes to, one after the other
    struct lw_rows times_s;   // s after the start, one a waypoint and one for the way back of a loop; none = by speed
    double speed;             // m/s, along the waypoints; random: never faster
    int repeat;               // enum lw_motion_repeat
    double centre[3];         // m, circle
    double axis[3];           // circle, of any length
    double period_s;          // circle
    double reach[3];          // m, random: never farther from where it starts
};

struct lw_scene_obstacle {
    int id;                  // 0 in a file = place in the list, from 1
    int line;                // of the file, 0 = of an override
    int shape;               // enum lw_shape_kind; a plane is a half-space
    double at[3];            // m, where it starts: its centre, of a plane any point of its face
    double rpy_deg[3];       // degrees about the base's x, y, z, in this order; a capsule lies along its z
    double normal[3];        // plane: out of the solid, of any length
    double radius;           // m, sphere (0 = a point) and capsule
    double half_length;      // m, capsule: half of its axis
    double half_extents[3];  // m, box
    struct lw_rows vertices; // m, [3] each, hull
    double rounding;         // m, box and hull: added on all sides
    double velocity[3];      // m/s, added to its motion
    double spin[3];          // rad/s about axes of the base
    double start_s;          // until then it stands still
    double visible_s[2];     // s, from and until when the sensor sees it
    struct lw_scene_motion motion;
};

// The perception source that reports the obstacles (scene/sensor.h).
struct lw_sensor_config {
    double rate_hz;     // samples; 0 in a file = 30 when something moves, else 10
    double noise_m;     // m, standard deviation of each coordinate of a position
    double latency_s;   // from a sample until it is told
    double valid_for_s; // what is told counts for this long after its sample
};

struct lw_scene_tool {
    int kind;                // enum lw_tool_kind
    double a[3], b[3];       // m, capsule: ends of its axis
    double radius;           // m, of a capsule, rounding of a hull
    struct lw_rows vertices; // m, [3] each, hull
};

// Tables of the keys below obstacles, sensor and tool.
extern const struct lw_key lw_scene_obstacle_keys[], lw_scene_sensor_keys[], lw_scene_tool_keys[];

// Fills in the defaults of obstacles, sensor and tool.
void lw_scene_obstacles_defaults(struct lw_scene *scene);

// Fills in what depends on other keys.
void lw_scene_obstacles_resolve(struct lw_scene *scene);

// Checks what concerns several keys of obstacles, sensor and tool at once.
LW_MUST_CHECK enum lw_status lw_scene_obstacles_check(const struct lw_scene *scene, const struct lw_source *source,
                                                      struct lw_error *error);

// Orientation of an obstacle at its start, base <- shape, w x y z; the z axis of a plane is its normal.
void lw_scene_obstacle_quat(const struct lw_scene_obstacle *obstacle, double quat[4]);

#endif
