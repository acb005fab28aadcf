// SPDX-License-Identifier: BSD-3-Clause
// Scene: everything a run is made of, read by controller, simulator and Python from one YAML file.
//
// Units    metres, radians, seconds, Hz.
// Frames   base frame of the arm.
// Arrays   one entry a joint, base to wrist 3.
// Memory   struct lw_scene is plain data; reading a file uses the heap and frees it.
// Errors   LW_E_SCENE with one line of text that says where, what was expected and what was found.
#ifndef LW_SCENE_SCENE_H
#define LW_SCENE_SCENE_H

#include "arm/arm.h"               // LW_NJ, enum lw_robot
#include "base/schema.h"           // struct lw_error, struct lw_key
#include "collision/body.h"        // enum lw_body_model, struct lw_tool
#include "scene/scene_obstacles.h" // struct lw_scene_obstacle, struct lw_sensor_config, struct lw_scene_tool

#include <stdint.h> // int64_t

// Limits of the guard, the last stage before a command leaves the controller. Infinite = off.
struct lw_limits {
    double position_min[LW_NJ]; // rad
    double position_max[LW_NJ]; // rad
    double velocity[LW_NJ];     // rad/s
    double acceleration[LW_NJ]; // rad/s^2
    double clearance;           // m, to keep from obstacles and between links
};

// The kinematic plant.
struct lw_plant_config {
    double rate_hz;             // a whole multiple of the controller's rate; 0 in a file = the controller's rate
    double timeout_s;           // without a command for this long it ramps to rest
    double velocity[LW_NJ];     // rad/s, infinite = off
    double acceleration[LW_NJ]; // rad/s^2, infinite = off
};

enum lw_law_name { LW_LAW_APF };
enum lw_attraction { LW_ATTRACTION_CONE, LW_ATTRACTION_CONE_PAR };
enum lw_remedy { LW_REMEDY_NONE, LW_REMEDY_VORTEX, LW_REMEDY_ROLLOUT };

// Potential field (Tezak & Truntic 2020, equations 1 to 6).
struct lw_apf_params {
    int attraction;      // enum lw_attraction
    int gamma;           // exponent of the repulsive potential, 1 or 2
    double k_a;          // rad/s per m of lever arm, gain of the attraction
    double r0;           // m, cone_par pulls proportionally within this distance of the goal
    double eta;          // gain of the repulsion
    double rho_rep;      // m, reach of the repulsion
    double distance_min; // m, smaller distances count as this: bounds the force
    double approach_s;   // s, an obstacle that comes is taken to be nearer by its way in this time
    double eta_self;     // gain of the repulsion between links
    double rho_self;     // m, its reach
};

// What to do about standing still away from the goal.
struct lw_remedy_params {
    int kind;           // enum lw_remedy
    double axis[3];     // of the vortex; not normalised
    double circulation; // strength of the circulation, as a part of the repulsion
};

struct lw_law_params {
    int name;           // enum lw_law_name
    int control_points; // enum lw_body_model
    struct lw_apf_params apf;
    struct lw_remedy_params remedy;
};

struct lw_scene {
    int robot; // enum lw_robot
    double rate_hz;
    double duration_s;
    double q0[LW_NJ];
    struct lw_limits limits;
    struct lw_plant_config plant;
    struct lw_law_params law;
    double goal[3];                 // m
    int seed;                       // of everything that is drawn
    struct lw_scene_tool tool_told; // as a file tells it
    struct lw_tool tool;            // on the flange, made of that
    struct lw_sensor_config sensor;
    int obstacle_count;
    struct lw_scene_obstacle obstacle[LW_SCENE_OBSTACLES];
    int number_count;
    double number[LW_SCENE_NUMBERS]; // of all struct lw_rows
};

// Leeway's defaults for a robot: the values of every key that a scene leaves out.
struct lw_scene lw_scene_defaults(enum lw_robot robot);

// Reads a scene from text; `source` also carries the overrides.
LW_MUST_CHECK enum lw_status lw_scene_read(const struct lw_source *source, struct lw_scene *scene,
                                           struct lw_error *error);

// Reads a scene from a file. Fails also LW_E_IO (error text set).
LW_MUST_CHECK enum lw_status lw_scene_load(const char *path, const char *const *set, int set_count,
                                           struct lw_scene *scene, struct lw_error *error);

// Writes the whole scene as YAML, every key, exact to the last bit.
void lw_scene_write(const struct lw_scene *scene, FILE *to);

// Digest of everything a scene says (of what lw_scene_write writes); 0 when there is no memory. Uses the heap.
int64_t lw_scene_digest(const struct lw_scene *scene);

// Writes the reference of all keys.
void lw_scene_describe(FILE *to);

// Top-level table of keys, for other languages' bindings.
const struct lw_key *lw_scene_keys(void);

// Number of controller periods the scene lasts: round(duration_s * rate_hz).
int64_t lw_scene_steps(const struct lw_scene *scene);

// Plant periods in one controller period.
int lw_scene_plant_ratio(const struct lw_scene *scene);

// Nominal periods, ns, rounded.
int64_t lw_scene_period_ns(double rate_hz);

#endif
