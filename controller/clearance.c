// SPDX-License-Identifier: BSD-3-Clause
// Scaling velocities to the room that is left.
//
// Units    metres, radians, seconds.
// Frames   base frame of the arm.
// Arrays   one entry a joint.
// Memory   none.
// Errors   none.
#include "controller/clearance.h"

#include "arm/joint.h" // enum lw_flag
#include "base/vec.h"  // lw_vec_dot

#include <math.h>   // fmax, sqrt
#include <string.h> // memcpy

enum { SWEEPS = 10, HALVINGS = 30 };
static const double rounding = 1e-9;        // a wish scaled to its part need not come out as wholly allowed
static const double rounding_lever = 1e-12; // m/rad, what moves less does not move

// Time to come to rest along a straight line in joint space.
static double braking_time(const struct lw_limits *limits, const double velocity[LW_NJ])
{
    double longest = 0;
    for (int j = 0; j < LW_NJ; j++)
        longest = fmax(longest, fabs(velocity[j]) / limits->acceleration[j]);
    return longest;
}

struct lw_law_reach lw_clearance_reach(const struct lw_guard_input *in, const struct lw_body *body,
                                       const struct lw_surroundings *s, double obstacle_speed)
{
    const struct lw_limits *limits = in->limits;
    if (isinf(limits->clearance))
        return (struct lw_law_reach){0, 0};
    // The fastest that the next tick can make it, as far as the speed limits allow.
    double next[LW_NJ], faster = 0;
    for (int j = 0; j < LW_NJ; j++) {
        next[j] = fmin(fabs(in->velocity[j]) + limits->acceleration[j] * in->period_s, limits->velocity[j]);
        faster += fmax(next[j] - fabs(in->velocity[j]), 0) * body->lever[j];
    }
    const double time = braking_time(limits, next);
    const double speed = lw_surroundings_speed(s, body, in->velocity) + faster;
    double turning = 0, apart = 0;
    for (int j = 0; j < LW_NJ; j++) {
        turning += next[j];
        apart += next[j] * body->lever[j];
    }
    const double per_speed = time / 2 + in->period_s + turning * time * time / 4;
    const double coming = obstacle_speed * (time + in->period_s);
    return (struct lw_law_reach){.obstacles = limits->clearance + speed * per_speed + coming,
                                 .self = limits->clearance + apart * per_speed};
}

// Adds the room of a point of a part: it moves along n with its link. The plane stands with the obstacle; between links
// it turns with the other one, so that what moves both alike changes nothing.
static void add_room(struct lw_rooms *rooms, const struct lw_near *pair, int part, const double point[3],
                     double clearance)
{
    const struct lw_distance *d = &pair->distance;
    const bool first = part == pair->part;
    const double *nearest = first ? d->pa : d->pb;
    const double r = rooms->around->placed.capsule[part].r;
    double n[3], between[3], other[LW_NJ];
    struct lw_room *room = &rooms->room[rooms->count++];
    for (int k = 0; k < 3; k++) {
        n[k] = first ? d->n[k] : -d->n[k];
        between[k] = point[k] - (nearest[k] + r * n[k]);
    }
    room->room = d->d + lw_vec_dot(n, between) - clearance;
    room->approach = fmax(lw_vec_dot(d->n, pair->velocity), 0);
    room->fixed_to = 0;
    room->moved_by = rooms->body->part[part].link;
    lw_arm_point_effect(rooms->around->frame, room->moved_by, point, n, room->gradient);
    if (pair->obstacle != 0)
        return;
    room->fixed_to = rooms->body->part[first ? pair->other : pair->part].link;
    lw_arm_point_effect(rooms->around->frame, room->fixed_to, point, n, other);
    for (int j = 0; j < LW_NJ; j++)
        room->gradient[j] -= other[j];
}

// Adds the rooms of both ends of a part's axis; of a tool hull, whose capsule is wider than it, that of its nearest
// point.
static void add_rooms(struct lw_rooms *rooms, const struct lw_near *pair, int part, double clearance)
{
    const struct lw_capsule *c = &rooms->around->placed.capsule[part];
    const double *n = pair->distance.n, *nearest = part == pair->part ? pair->distance.pa : pair->distance.pb;
    if (part == rooms->body->tool_part && rooms->body->tool.kind == LW_TOOL_HULL) {
        double point[3];
        for (int k = 0; k < 3; k++)
            point[k] = nearest[k] + (part == pair->part ? c->r : -c->r) * n[k];
        add_room(rooms, pair, part, point, clearance);
        return;
    }
    add_room(rooms, pair, part, c->a, clearance);
    if (c->a[0] != c->b[0] || c->a[1] != c->b[1] || c->a[2] != c->b[2])
        add_room(rooms, pair, part, c->b, clearance);
}

// The part whose ends are kept behind the plane: of two links the shorter one, whose turning about itself takes least.
// A tool hull has no ends, so it is never that one of two links.
static int kept_behind(const struct lw_body *body, const struct lw_near *pair)
{
    const bool hull = pair->other == body->tool_part && body->tool.kind == LW_TOOL_HULL;
    if (pair->obstacle != 0 || hull || body->length[pair->part] <= body->length[pair->other])
        return pair->part;
    return pair->other;
}

void lw_clearance_rooms(const struct lw_limits *limits, struct lw_law_reach reach, const struct lw_body *body,
                        const struct lw_surroundings *s, struct lw_rooms *rooms)
{
    rooms->count = 0;
    rooms->around = s;
    rooms->body = body;
    if (isinf(limits->clearance))
        return;
    for (int i = 0; i < s->near.count; i++) {
        const struct lw_near *pair = &s->near.pair[i];
        if (pair->fixed || pair->distance.d > (pair->obstacle != 0 ? reach.obstacles : reach.self))
            continue;
        add_rooms(rooms, pair, kept_behind(body, pair), limits->clearance);
    }
}

// Zero where rounding alone closes in: who goes along a room that is used up must not be stopped by it.
static double closing_speed(const struct lw_room *room, const double velocity[LW_NJ])
{
    double closing = 0, turning = 0;
    for (int j = 0; j < LW_NJ; j++) {
        closing -= room->gradient[j] * velocity[j];
        turning += fabs(velocity[j]);
    }
    return fabs(closing) > rounding_lever * turning ? closing : 0;
}

// How far points leave their straight way until they rest.
static double curve(const struct lw_rooms *rooms, const double velocity[LW_NJ], double time)
{
    double turning = 0;
    if (rooms->around == NULL)
        return 0;
    for (int j = 0; j < LW_NJ; j++)
        turning += fabs(velocity[j]);
    return turning * lw_surroundings_speed(rooms->around, rooms->body, velocity) * time * time / 4;
}

// The same of the points of one link as another one sees them: only the joints between the two turn them.
static double curve_between(const struct lw_rooms *rooms, const struct lw_room *room, const double velocity[LW_NJ],
                            double time)
{
    const bool ahead = room->fixed_to < room->moved_by;
    const int first = ahead ? room->fixed_to : room->moved_by, last = ahead ? room->moved_by : room->fixed_to;
    double turning = 0, speed = 0;
    for (int j = first; j < last; j++) {
        turning += fabs(velocity[j]);
        speed += fabs(velocity[j]) * rooms->body->lever[j];
    }
    return rooms->around == NULL ? 0 : turning * speed * time * time / 4;
}

// What a part of a velocity needs of a room.
static double need(double part, double closing, double time, double period_s, double curve)
{
    const double square = part * part;
    return closing * part * (part * time / 2 + period_s) + curve * square * square;
}

// Part of a velocity that one room allows.
//   time   in  s, braking time of the whole velocity
//   curve  in  m, of the whole velocity
static double part_of(const struct lw_room *room, double closing, double time, double period_s, double curve)
{
    const double left = room->room - room->approach * (time + period_s), rate = fmax(closing, 0);
    if (left <= 0)
        return closing > 0 ? 0 : 1;
    if (need(1, rate, time, period_s, curve) <= left)
        return 1;
    // Without the curve it is the larger root of a square; with it the way there is halved until nothing changes.
    if (curve == 0) {
        const double at_once = rate * period_s;
        return 2 * left / (at_once + sqrt(at_once * at_once + 2 * rate * time * left));
    }
    double low = 0, high = 1;
    for (int i = 0; i < HALVINGS; i++) {
        const double middle = (low + high) / 2;
        if (need(middle, rate, time, period_s, curve) <= left)
            low = middle;
        else
            high = middle;
    }
    return low;
}

double lw_clearance_part(const struct lw_limits *limits, double period_s, const struct lw_rooms *rooms,
                         const double velocity[LW_NJ])
{
    if (rooms->count == 0)
        return 1;
    const double time = braking_time(limits, velocity), bend = curve(rooms, velocity, time);
    double part = 1;
    for (int i = 0; i < rooms->count; i++) {
        const struct lw_room *room = &rooms->room[i];
        const double closing = closing_speed(room, velocity);
        const double bent = room->fixed_to == 0 ? bend : curve_between(rooms, room, velocity, time);
        if (closing > 0 || bent > 0)
            part = fmin(part, part_of(room, closing, time, period_s, bent));
    }
    return part;
}

// How much too fast a wish closes in on a room.
//   time  in  s, braking time of the wish
static double excess_of(const struct lw_guard_input *in, const struct lw_room *room, const double wish[LW_NJ],
                        double time)
{
    const double left = room->room - room->approach * (time + in->period_s);
    return closing_speed(room, wish) - fmax(left, 0) / (time / 2 + in->period_s);
}

static double product(const double a[LW_NJ], const double b[LW_NJ])
{
    double sum = 0;
    for (int j = 0; j < LW_NJ; j++)
        sum += a[j] * b[j];
    return sum;
}

static void add_scaled(double scale, const double a[LW_NJ], double out[LW_NJ])
{
    for (int j = 0; j < LW_NJ; j++)
        out[j] += scale * a[j];
}

// One sweep: each room in turn takes its excess out. Returns whether there was none.
static bool sweep(const struct lw_guard_input *in, const struct lw_rooms *rooms, double time, double wish[LW_NJ])
{
    bool fits = true;
    for (int i = 0; i < rooms->count; i++) {
        const struct lw_room *room = &rooms->room[i];
        const double excess = excess_of(in, room, wish, time), square = product(room->gradient, room->gradient);
        if (excess <= 0 || square == 0)
            continue;
        fits = false;
        add_scaled(excess / square, room->gradient, wish);
    }
    return fits;
}

// The room a wish closes in on too fast most of all, NULL = none.
static const struct lw_room *tightest(const struct lw_guard_input *in, const struct lw_rooms *rooms, double time,
                                      const double wish[LW_NJ])
{
    const struct lw_room *found = NULL;
    double most = 0;
    for (int i = 0; i < rooms->count; i++) {
        const double excess = excess_of(in, &rooms->room[i], wish, time);
        if (excess > most) {
            most = excess;
            found = &rooms->room[i];
        }
    }
    return found;
}

// Between rooms at acute angles sweeps come to no end: the directions of those that a wish still closes in on are taken
// out whole, one orthogonal to the others at a time.
static void give_way(const struct lw_guard_input *in, const struct lw_rooms *rooms, double time, double wish[LW_NJ])
{
    double direction[LW_NJ][LW_NJ];
    for (int n = 0; n < LW_NJ; n++) {
        const struct lw_room *room = tightest(in, rooms, time, wish);
        if (room == NULL)
            return;
        double *d = direction[n];
        memcpy(d, room->gradient, sizeof direction[n]);
        for (int k = 0; k < n; k++)
            add_scaled(-product(d, direction[k]), direction[k], d);
        const double square = product(d, d);
        if (square <= rounding * product(room->gradient, room->gradient))
            return;
        for (int j = 0; j < LW_NJ; j++)
            d[j] /= sqrt(square);
        add_scaled(-product(wish, d), d, wish);
    }
}

// Takes out of a wish what closes in too fast, room by room, and leaves what goes along: the arm slides past an
// obstacle instead of standing before it. Several rooms in turn come close to the nearest allowed wish; what is left
// over is for the scaling. Returns whether anything was taken.
static bool slide(const struct lw_guard_input *in, const struct lw_rooms *rooms, double wish[LW_NJ])
{
    const double time = braking_time(in->limits, wish);
    for (int n = 0; n < SWEEPS; n++)
        if (sweep(in, rooms, time, wish))
            return n > 0;
    give_way(in, rooms, time, wish);
    return true;
}

unsigned lw_clearance_command(const struct lw_guard_input *in, const struct lw_rooms *rooms, double command[LW_NJ])
{
    static const double rest[LW_NJ] = {0};
    struct lw_guard_input scaled = *in;
    double wish[LW_NJ];
    unsigned flags = 0;
    if (rooms->count > 0) {
        // Within the other limits first: who wishes for more than the joints can would be taken to brake for longer.
        flags = lw_guard_wish(in, wish);
        const bool slid = slide(in, rooms, wish);
        const double part = lw_clearance_part(in->limits, in->period_s, rooms, wish);
        for (int j = 0; part < 1 && j < LW_NJ; j++)
            wish[j] *= part;
        flags |= slid || part < 1 ? LW_LIMIT_CLEARANCE : 0u;
        scaled.wish = wish;
    }
    flags |= lw_guard_shape(&scaled, command);
    if (rooms->count == 0 || lw_clearance_part(in->limits, in->period_s, rooms, command) > 1 - rounding)
        return flags;
    scaled.wish = rest;
    return flags | lw_guard_shape(&scaled, command) | LW_LIMIT_CLEARANCE;
}
