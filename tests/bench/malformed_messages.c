// SPDX-License-Identifier: BSD-3-Clause
// Malformed short messages: what comes before the payload, its size and type, and its values.
//
// Units    bytes.
// Frames   none.
// Arrays   none.
// Memory   the caller's.
// Errors   none.
#include "bus/wire.h" // lw_wire_encode
#include "malformed.h"

#include <math.h>   // HUGE_VAL
#include <stdio.h>  // snprintf
#include <string.h> // memcpy

enum {
    HEAD = 8,
    NAME_MAX_BYTES = 200,
    FINGERPRINT_BYTES = 8,
    PLACE_OF_OP = 60,
    PLACE_OF_N = 61,
    PLACE_OF_IDS = 65,
    PLACE_OF_VERTICES = 201
};
enum { OBSTACLE_BYTES = 141, NOISE_MAX = 1500, PAYLOAD_MAX = LW_WIRE_MAX };

// What controller and plant listen to.
static const enum lw_channel heard[] = {LW_CHANNEL_JOINT_STATE, LW_CHANNEL_JOINT_COMMAND, LW_CHANNEL_OBSTACLES,
                                        LW_CHANNEL_HULL,        LW_CHANNEL_GOAL,          LW_CHANNEL_STOP};
enum { HEARD = sizeof heard / sizeof heard[0] };

static enum lw_channel any_channel(struct malformer *m)
{
    return heard[random_below(&m->random, HEARD)];
}

// --- a message that only lacks being wrong ---

// Senders are those under attack, and numbers are the highest: whoever takes such a message takes no other after it.
static union lw_message rightful(const struct malformer *m, enum lw_channel channel)
{
    union lw_message message;
    memset(&message, 0, sizeof message);
    message.stamp = (struct lw_stamp){.session = m->plant_session, .seq = INT64_MAX};
    if (channel == LW_CHANNEL_JOINT_STATE) {
        message.joint_state.mode = LW_PLANT_MOVING;
        message.joint_state.period_ns = 2000000;
    } else if (channel == LW_CHANNEL_JOINT_COMMAND) {
        message.stamp.session = m->controller_session;
        message.joint_command.mode = LW_COMMAND_VELOCITY;
        message.joint_command.plant_session = m->plant_session;
    } else if (channel == LW_CHANNEL_OBSTACLES) {
        message.obstacles.count = 3;
        for (int i = 0; i < 3; i++)
            message.obstacles.obstacle[i] =
                (struct lw_obstacle){.id = 1000 + i, .p = {0.3, 0.3, 0.3}, .quat = {1}, .radius = 0.1};
    } else if (channel == LW_CHANNEL_HULL) {
        message.obstacles.count = 1;
        message.obstacles.obstacle[0] =
            (struct lw_obstacle){.id = 1003, .shape = LW_HULL, .p = {0.3, 0.3, 0.3}, .quat = {1}, .radius = 0.1};
        message.obstacles.vertex_count = 8;
    }
    return message;
}

static union lw_message from_nobody(struct malformer *m, enum lw_channel channel)
{
    union lw_message message = rightful(m, channel);
    message.stamp.session = 1 + (int64_t)(random_bits(&m->random) >> 2);
    return message;
}

// --- packets ---

static void start(struct malformer *m, const char *channel, struct packet *out)
{
    memcpy(out->bytes, "LC02", 4);
    put(out->bytes + 4, random_bits(&m->random), 4);
    out->size = HEAD + strlen(channel) + 1;
    memcpy(out->bytes + HEAD, channel, strlen(channel) + 1);
}

static void add(const void *bytes, size_t size, struct packet *out)
{
    memcpy(out->bytes + out->size, bytes, size);
    out->size += size;
}

static void add_noise(struct malformer *m, int size, struct packet *out)
{
    for (int i = 0; i < size; i++)
        out->bytes[out->size++] = (unsigned char)(random_bits(&m->random) >> 40);
}

static size_t payload_of(enum lw_channel channel)
{
    return HEAD + strlen(lw_wire_channel_name(channel)) + 1;
}

static void pack(struct malformer *m, enum lw_channel channel, const union lw_message *message, struct packet *out)
{
    unsigned char payload[PAYLOAD_MAX];
    const uint32_t size = lw_wire_encode(channel, message, payload);
    start(m, lw_wire_channel_name(channel), out);
    add(payload, size, out);
}

static void pack_rightful(struct malformer *m, enum lw_channel channel, struct packet *out)
{
    const union lw_message message = rightful(m, channel);
    pack(m, channel, &message, out);
}

// --- no message at all ---

void make_noise(struct malformer *m, struct packet *out)
{
    out->size = 0;
    add_noise(m, random_below(&m->random, NOISE_MAX), out);
}

void make_noise_behind_magic(struct malformer *m, struct packet *out)
{
    out->size = 0;
    add("LC02", 4, out);
    out->bytes[3] = (unsigned char)('2' + random_below(&m->random, 2));
    add_noise(m, random_below(&m->random, NOISE_MAX), out);
}

void make_no_nul(struct malformer *m, struct packet *out)
{
    const char *name = lw_wire_channel_name(any_channel(m));
    start(m, name, out);
    out->size = HEAD + (size_t)random_below(&m->random, (int)strlen(name) + 1);
    // The name itself, or one as long as the longest.
    if (out->size == HEAD + strlen(name) && random_below(&m->random, 2))
        for (int i = random_below(&m->random, NAME_MAX_BYTES); i > 0; i--)
            add("X", 1, out);
}

void make_long_name(struct malformer *m, struct packet *out)
{
    char name[NAME_MAX_BYTES + 1];
    const int lengths[] = {62, 63, 64, 65, 128, NAME_MAX_BYTES};
    const int length = lengths[random_below(&m->random, 6)];
    snprintf(name, sizeof name, "%s_", lw_wire_channel_name(any_channel(m)));
    for (int i = (int)strlen(name); i < length; i++)
        name[i] = 'X';
    name[length] = '\0';
    start(m, name, out);
    add_noise(m, 64, out);
}

void make_new_name(struct malformer *m, struct packet *out)
{
    char name[NAME_MAX_BYTES];
    snprintf(name, sizeof name, "NAME_%lld", (long long)m->made);
    start(m, name, out);
    add_noise(m, 16, out);
}

// --- size and type ---

void make_truncated(struct malformer *m, struct packet *out)
{
    const enum lw_channel channel = any_channel(m);
    pack_rightful(m, channel, out);
    out->size = payload_of(channel) + (size_t)random_below(&m->random, (int)lw_wire_size(channel));
}

void make_overlong(struct malformer *m, struct packet *out)
{
    pack_rightful(m, any_channel(m), out);
    add_noise(m, 1 + random_below(&m->random, 100), out);
}

// A fingerprint of another version, or another channel's whole message.
void make_other_type(struct malformer *m, struct packet *out)
{
    const enum lw_channel channel = any_channel(m);
    pack_rightful(m, channel, out);
    if (random_below(&m->random, 2)) {
        out->bytes[payload_of(channel) + (size_t)random_below(&m->random, FINGERPRINT_BYTES)] ^= 0x40;
        return;
    }
    struct packet other;
    const enum lw_channel from = channel == LW_CHANNEL_JOINT_STATE ? LW_CHANNEL_JOINT_COMMAND : LW_CHANNEL_JOINT_STATE;
    pack_rightful(m, from, &other);
    out->size = payload_of(channel);
    add(other.bytes + payload_of(from), lw_wire_size(from), out);
}

// --- values ---

// Any number of an obstacle that its receiver looks at.
static double *double_of(struct malformer *m, struct lw_obstacle *o)
{
    double *const places[] = {&o->p[2], &o->quat[1], &o->radius, &o->v[0], &o->omega[1]};
    return places[random_below(&m->random, 5)];
}

// Puts a number in place of one of a message that only lacks being wrong.
static void make_with(struct malformer *m, double bad, struct packet *out)
{
    static const enum lw_channel with_doubles[] = {LW_CHANNEL_JOINT_STATE, LW_CHANNEL_JOINT_COMMAND,
                                                   LW_CHANNEL_OBSTACLES, LW_CHANNEL_HULL, LW_CHANNEL_GOAL};
    const enum lw_channel channel = with_doubles[random_below(&m->random, 5)];
    const int j = random_below(&m->random, LW_NJ), axis = j % 3;
    union lw_message message = rightful(m, channel);
    switch (channel) {
    case LW_CHANNEL_JOINT_STATE:
        *(random_below(&m->random, 2) ? &message.joint_state.q[j] : &message.joint_state.qd[j]) = bad;
        break;
    case LW_CHANNEL_JOINT_COMMAND: message.joint_command.qd[j] = bad; break;
    case LW_CHANNEL_OBSTACLES: *double_of(m, &message.obstacles.obstacle[axis]) = bad; break;
    case LW_CHANNEL_HULL:
        *(j < 3 ? double_of(m, &message.obstacles.obstacle[0]) : &message.obstacles.vertex[4 * j]) = bad;
        break;
    default: message.request.goal[axis] = bad;
    }
    pack(m, channel, &message, out);
}

void make_not_finite(struct malformer *m, struct packet *out)
{
    const double bad[] = {(double)NAN, -(double)NAN, HUGE_VAL, -HUGE_VAL};
    make_with(m, bad[random_below(&m->random, 4)], out);
}

void make_huge(struct malformer *m, struct packet *out)
{
    const double bad[] = {1.1e6, -1e9, 1e300, -1.7e308};
    make_with(m, bad[random_below(&m->random, 4)], out);
}

// Counts that lie, and ids that are none or stand twice.
void make_count(struct malformer *m, struct packet *out)
{
    static const int32_t counts[] = {-1, INT32_MIN, LW_HULL_MAX + 1, 1000000, INT32_MAX};
    static const int32_t ids[] = {0, -1, INT32_MIN, 1001};
    if (random_below(&m->random, 3) == 0) {
        pack_rightful(m, LW_CHANNEL_HULL, out);
        put(out->bytes + payload_of(LW_CHANNEL_HULL) + PLACE_OF_VERTICES, (uint32_t)counts[random_below(&m->random, 5)],
            4);
        return;
    }
    pack_rightful(m, LW_CHANNEL_OBSTACLES, out);
    unsigned char *payload = out->bytes + payload_of(LW_CHANNEL_OBSTACLES);
    const int which = random_below(&m->random, 9);
    if (which < 5)
        put(payload + PLACE_OF_N, (uint32_t)counts[which], 4);
    else
        put(payload + PLACE_OF_IDS + (which == 8 ? 2 : random_below(&m->random, 3)) * OBSTACLE_BYTES,
            (uint32_t)ids[which - 5], 4);
}

static void put_state_out_of_range(struct malformer *m, struct lw_joint_state *s)
{
    switch (random_below(&m->random, 4)) {
    case 0: s->mode = (enum lw_plant_mode)(4 + random_below(&m->random, 100)); break;
    case 1: s->tick = -1; break;
    case 2: s->period_ns = -random_below(&m->random, 2); break;
    default: s->tick = INT64_MAX;
    }
}

// Sessions, numbers, modes and times outside their range.
void make_out_of_range(struct malformer *m, struct packet *out)
{
    const enum lw_channel channel = any_channel(m);
    union lw_message message = rightful(m, channel);
    const int which = random_below(&m->random, 3);
    if (which == 0)
        message.stamp.session = -(int64_t)(random_bits(&m->random) >> 2);
    else if (which == 1 || channel == LW_CHANNEL_GOAL || channel == LW_CHANNEL_STOP)
        message.stamp.seq = -(int64_t)(random_bits(&m->random) >> 2);
    else if (channel == LW_CHANNEL_JOINT_STATE)
        put_state_out_of_range(m, &message.joint_state);
    else if (channel == LW_CHANNEL_JOINT_COMMAND)
        message.joint_command.state_tick = INT64_MIN;
    else if (channel == LW_CHANNEL_HULL)
        message.obstacles.valid_for_ms = 100; // since when?
    pack(m, channel, &message, out);
    if (which == 2 && channel == LW_CHANNEL_OBSTACLES)
        out->bytes[payload_of(channel) + PLACE_OF_OP] = (unsigned char)(4 + random_below(&m->random, 250));
}

// Well-formed, but its sender has no say: the plant obeys one controller, and the controller hears one plant.
void make_foreign(struct malformer *m, struct packet *out)
{
    const enum lw_channel channel = random_below(&m->random, 2) ? LW_CHANNEL_JOINT_STATE : LW_CHANNEL_JOINT_COMMAND;
    union lw_message message = from_nobody(m, channel);
    if (channel == LW_CHANNEL_JOINT_COMMAND && random_below(&m->random, 2))
        message.joint_command.plant_session ^= 1;
    pack(m, channel, &message, out);
}

// A foreign message with a few bytes changed.
void make_damaged(struct malformer *m, struct packet *out)
{
    make_foreign(m, out);
    for (int n = 1 + random_below(&m->random, 6); n > 0; n--)
        out->bytes[(size_t)random_below(&m->random, (int)out->size)] = (unsigned char)(random_bits(&m->random) >> 40);
}
