// SPDX-License-Identifier: BSD-3-Clause
// Bodies of UR5 and UR10: tables of capsules around the meshes of their links, and what is made of them.
//
// Units    metres.
// Frames   see body.h.
// Arrays   a row of a table: link, one end, other end, radius.
// Memory   constants.
// Errors   see body.h.
#include "collision/body.h"

#include "base/vec.h" // lw_vec_*, lw_all_finite

#include <math.h>    // sqrt, NAN
#include <stdbool.h> // bool
#include <stddef.h>  // NULL
#include <string.h>  // memcpy

enum { SINGLE = 6, FINE = 10, POINTS = 5 };

// Least capsules around each link.
static const struct lw_body_part single[LW_ROBOT_COUNT][SINGLE] = {
    [LW_UR5] =
        {
            {1, {{0, 0, .013}, {0, -.009, 0}, .082}},
            {2, {{.424, .002, .131}, {.001, -.002, .131}, .086}},
            {3, {{.003, .001, .014}, {.392, 0, .045}, .065}},
            {4, {{.001, -.007, -.016}, {-.002, -.007, .018}, .055}},
            {5, {{0, .003, .009}, {0, .005, -.010}, .057}},
            {6, {{-.001, -.002, -.021}, {0, -.001, -.021}, .042}},
        },
    [LW_UR10] =
        {
            {1, {{0, -.014, .002}, {.001, 0, .012}, .108}},
            {2, {{.617, 0, .169}, {.035, -.018, .168}, .112}},
            {3, {{.573, 0, .054}, {.001, -.012, .047}, .086}},
            {4, {{0, -.007, -.001}, {0, -.002, .016}, .066}},
            {5, {{-.001, .001, .015}, {0, .007, -.002}, .066}},
            {6, {{0, -.001, -.022}, {0, -.001, -.022}, .046}},
        },
};

// Upper arm and forearm as distal hub, tube and proximal hub.
static const struct lw_body_part fine[LW_ROBOT_COUNT][FINE] = {
    [LW_UR5] =
        {
            {1, {{0, 0, .013}, {0, -.009, 0}, .082}},
            {2, {{-.003, .004, .121}, {.013, -.001, .138}, .082}},
            {2, {{.347, 0, .136}, {.079, 0, .136}, .060}},
            {2, {{.414, .003, .138}, {.416, 0, .116}, .082}},
            {3, {{.021, .001, .012}, {0, 0, .015}, .063}},
            {3, {{.080, .001, .017}, {.316, -.002, .017}, .040}},
            {3, {{.355, .013, .022}, {.400, -.003, .064}, .061}},
            {4, {{.001, -.007, -.016}, {-.002, -.007, .018}, .055}},
            {5, {{0, .003, .009}, {0, .005, -.010}, .057}},
            {6, {{-.001, -.002, -.021}, {0, -.001, -.021}, .042}},
        },
    [LW_UR10] =
        {
            {1, {{0, -.014, .002}, {.001, 0, .012}, .108}},
            {2, {{-.005, .004, .151}, {.007, 0, .188}, .076}},
            {2, {{.547, .003, .176}, {.095, -.010, .183}, .081}},
            {2, {{.610, 0, .122}, {.604, -.002, .215}, .087}},
            {3, {{-.003, .001, .058}, {.016, -.002, .046}, .071}},
            {3, {{.485, 0, .049}, {.078, 0, .048}, .044}},
            {3, {{.556, -.001, .047}, {.568, -.010, .072}, .083}},
            {4, {{0, -.007, -.001}, {0, -.002, .016}, .066}},
            {5, {{-.001, .001, .015}, {0, .007, -.002}, .066}},
            {6, {{0, -.001, -.022}, {0, -.001, -.022}, .046}},
        },
};

// Links that may meet. Neighbours always touch; 3-5 and 4-6 are nearly constant and near 0, so they tell nothing.
static const int meeting[][2] = {{1, 3}, {1, 4}, {1, 5}, {1, 6}, {2, 4}, {2, 5}, {2, 6}, {3, 6}};
enum { MEETING = sizeof meeting / sizeof meeting[0] };

// --- tools ---

static enum lw_status refuse(enum lw_status status, const char *why, const char **reason)
{
    if (reason != NULL)
        *reason = why;
    return status;
}

enum lw_status lw_tool_check(const struct lw_tool *tool, const char **reason)
{
    static const struct lw_pose flange = {.r = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
    struct lw_solid solid = {.kind = LW_HULL, .radius = tool->radius, .count = tool->count, .vertex = tool->vertex};
    double room[LW_HULL_ROOM];
    struct lw_shape shape;
    switch (tool->kind) {
    case LW_TOOL_NONE: return LW_OK;
    case LW_TOOL_CAPSULE:
        if (!lw_all_finite(tool->capsule.a, 3) || !lw_all_finite(tool->capsule.b, 3) ||
            !lw_all_finite(&tool->capsule.r, 1))
            return refuse(LW_E_NOT_FINITE, "a value is not a finite number", reason);
        if (!(tool->capsule.r > 0))
            return refuse(LW_E_ARGUMENT, "the radius of a tool is not positive", reason);
        return LW_OK;
    case LW_TOOL_HULL: return lw_shape_make(&solid, &flange, room, &shape, reason);
    default: return refuse(LW_E_ARGUMENT, "there is no such kind of tool", reason);
    }
}

// Two vertices far from each other: the farthest from the first, and the farthest from that.
static void far_vertices(const struct lw_tool *tool, const double **one, const double **other)
{
    *other = tool->vertex;
    for (int pass = 0; pass < 2; pass++) {
        double most = -1;
        *one = *other;
        for (int i = 0; i < tool->count; i++) {
            double apart[3];
            lw_vec_sub(&tool->vertex[3 * i], *one, apart);
            if (lw_vec_dot(apart, apart) > most) {
                most = lw_vec_dot(apart, apart);
                *other = &tool->vertex[3 * i];
            }
        }
    }
}

// A capsule that holds a hull: the line through two far vertices, moved to the centre.
static struct lw_capsule around(const struct lw_tool *tool, const double centre[3])
{
    struct lw_capsule capsule = {.r = 0};
    const double *one, *other;
    double axis[3], from[3], low = 0, high = 0, square = 0;
    far_vertices(tool, &one, &other);
    lw_vec_sub(other, one, axis);
    const double length = lw_vec_norm(axis);
    for (int k = 0; k < 3; k++)
        axis[k] = length > 0 ? axis[k] / length : 0;
    for (int i = 0; i < tool->count; i++) {
        lw_vec_sub(&tool->vertex[3 * i], centre, from);
        const double along = lw_vec_dot(from, axis);
        low = along < low ? along : low;
        high = along > high ? along : high;
        lw_vec_add_scaled(-along, axis, from);
        square = lw_vec_dot(from, from) > square ? lw_vec_dot(from, from) : square;
    }
    for (int k = 0; k < 3; k++) {
        capsule.a[k] = centre[k] + low * axis[k];
        capsule.b[k] = centre[k] + high * axis[k];
    }
    capsule.r = (sqrt(square) + tool->radius) * (1 + 1e-9) + 1e-9; // rounding
    return capsule;
}

// Centre and vertices of a tool hull, by the code that places obstacles.
static struct lw_body_hull hull_of(const struct lw_tool *tool)
{
    static const struct lw_pose flange = {.r = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
    const struct lw_solid solid = {
        .kind = LW_HULL, .radius = tool->radius, .count = tool->count, .vertex = tool->vertex};
    struct lw_body_hull hull = {
        .count = 1, .padded = 4, .centre = {(double)NAN, (double)NAN, (double)NAN}, .reach = (double)NAN};
    struct lw_shape shape;
    if (lw_shape_make(&solid, &flange, hull.vertex, &shape, NULL) != LW_OK)
        return hull; // it was not checked: its distances are no numbers
    hull.count = shape.hull.count;
    hull.padded = shape.hull.padded;
    hull.reach = shape.hull.reach;
    memcpy(hull.centre, shape.c, sizeof hull.centre);
    return hull;
}

// --- bodies ---

static void add_tool(const struct lw_tool *tool, struct lw_body *body)
{
    struct lw_body_part *part = &body->part[body->count];
    body->tool = *tool;
    body->tool_part = body->count++;
    part->link = LW_NJ;
    part->capsule = tool->capsule;
    if (tool->kind == LW_TOOL_HULL) {
        body->hull = hull_of(tool);
        part->capsule = around(tool, body->hull.centre);
    }
}

static void add_pairs(struct lw_body *body)
{
    for (int m = 0; m < MEETING; m++)
        for (int i = 0; i < body->count; i++)
            for (int j = i + 1; j < body->count; j++)
                if (body->part[i].link == meeting[m][0] && body->part[j].link == meeting[m][1])
                    body->pair[body->pair_count++] = (struct lw_body_pair){(uint8_t)i, (uint8_t)j};
}

static void find_lengths(struct lw_body *body)
{
    for (int i = 0; i < body->count; i++) {
        double axis[3];
        lw_vec_sub(body->part[i].capsule.b, body->part[i].capsule.a, axis);
        body->length[i] = lw_vec_norm(axis);
    }
}

// A part is within its own size of its frame's origin, and each link within its DH lengths of the one before.
static void find_levers(enum lw_robot robot, struct lw_body *body)
{
    const struct lw_arm *arm = lw_arm_get(robot);
    for (int i = 0; i < body->count; i++) {
        const struct lw_capsule *c = &body->part[i].capsule;
        const double a = lw_vec_norm(c->a), b = lw_vec_norm(c->b);
        double reach = (a > b ? a : b) + c->r;
        for (int j = body->part[i].link - 1; j >= 0; j--) {
            const double lever = reach + fabs(arm->a[j]); // d is along the joint's own axis
            body->lever[j] = lever > body->lever[j] ? lever : body->lever[j];
            reach += hypot(arm->a[j], arm->d[j]);
        }
    }
}

void lw_body_make(enum lw_robot robot, enum lw_body_model model, const struct lw_tool *tool, struct lw_body *body)
{
    *body = (struct lw_body){.tool_part = -1};
    switch (model) {
    case LW_BODY_CAPSULES:
        body->count = SINGLE;
        memcpy(body->part, single[robot], sizeof single[robot]);
        break;
    case LW_BODY_CAPSULES_FINE:
        body->count = FINE;
        memcpy(body->part, fine[robot], sizeof fine[robot]);
        break;
    default:
        body->count = POINTS;
        for (int i = 0; i < POINTS; i++)
            body->part[i].link = i + 2;
        break;
    }
    if (tool != NULL && tool->kind != LW_TOOL_NONE)
        add_tool(tool, body);
    if (model != LW_BODY_JOINTS)
        add_pairs(body);
    find_lengths(body);
    find_levers(robot, body);
}

// --- placing ---

// R x + p; the origin of a frame is p itself, bit for bit.
static void place_point(const struct lw_pose *frame, const double x[3], double out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = lw_vec_dot(&frame->r[3 * k], x) + frame->p[k];
}

void lw_body_mark(struct lw_placed *placed, int part, double length)
{
    placed->cull[part] = lw_cull_link(&placed->capsule[part], length);
}

void lw_body_place(const struct lw_body *body, const struct lw_pose frame[LW_NJ], struct lw_placed *placed)
{
    for (int i = 0; i < body->count; i++) {
        const struct lw_body_part *part = &body->part[i];
        place_point(&frame[part->link - 1], part->capsule.a, placed->capsule[i].a);
        place_point(&frame[part->link - 1], part->capsule.b, placed->capsule[i].b);
        placed->capsule[i].r = part->capsule.r;
        lw_body_mark(placed, i, body->length[i]);
    }
    if (body->tool.kind != LW_TOOL_HULL)
        return;
    const struct lw_pose *flange = &frame[LW_NJ - 1];
    const int padded = body->hull.padded;
    place_point(flange, body->hull.centre, placed->tool_centre);
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < padded; i++)
            placed->tool_vertex[k * padded + i] = flange->r[3 * k] * body->hull.vertex[i] +
                                                  flange->r[3 * k + 1] * body->hull.vertex[padded + i] +
                                                  flange->r[3 * k + 2] * body->hull.vertex[2 * padded + i];
}

struct lw_shape lw_body_tool_shape(const struct lw_body *body, const struct lw_placed *placed)
{
    struct lw_shape shape = {.kind = LW_HULL, .r = body->tool.radius};
    memcpy(shape.c, placed->tool_centre, sizeof shape.c);
    shape.bound = body->hull.reach + shape.r;
    shape.hull = (struct lw_core_hull){body->hull.count, body->hull.padded, body->hull.reach, placed->tool_vertex};
    return shape;
}
