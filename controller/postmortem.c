// SPDX-License-Identifier: BSD-3-Clause
// Writing the post-mortem log.
//
// Units    see postmortem.h.
// Frames   see postmortem.h.
// Arrays   none.
// Memory   see postmortem.h.
// Errors   see postmortem.h.
#define _GNU_SOURCE // strerrordesc_np
#include "controller/postmortem.h"

#include "base/clock.h" // lw_clock_mono_ns
#include "bus/log.h"    // lw_log_*

#include <errno.h>    // errno
#include <string.h>   // strerrordesc_np
#include <sys/stat.h> // mkdir
#include <time.h>     // strftime
#include <unistd.h>   // getpid

enum { PATH_MAX_BYTES = 512, FOLDER_MODE = 0777 };
enum { FILES_MAX = 20 };
static const int64_t aftermath_ns = LW_NS_PER_S / 5;
static const int64_t forget_ns = 10 * LW_NS_PER_S; // without any fault: the next one is news again

// --- what was heard ---

void lw_heard_init(struct lw_heard *heard)
{
    pthread_mutex_init(&heard->lock, NULL);
}

void lw_heard_note(struct lw_heard *heard, enum lw_channel channel, const union lw_message *message)
{
    struct lw_heard_past *past = &heard->past;
    pthread_mutex_lock(&heard->lock);
    struct lw_heard_message *slot = &past->newest[past->next];
    // The oldest makes room: what it changed stays in the world before.
    if (past->count == LW_HEARD_MAX && (slot->channel == LW_CHANNEL_OBSTACLES || slot->channel == LW_CHANNEL_HULL))
        (void)(lw_world_apply(&past->before, &slot->message.obstacles) == LW_OK); // it was taken once already
    *slot = (struct lw_heard_message){.channel = (int)channel, .message = *message, .time_ns = lw_clock_mono_ns()};
    past->next = (past->next + 1) % LW_HEARD_MAX;
    past->count += past->count < LW_HEARD_MAX;
    pthread_mutex_unlock(&heard->lock);
}

// Only what is used: the world is large.
static void copy_past(const struct lw_heard_past *from, struct lw_heard_past *to)
{
    lw_world_copy(&from->before, &to->before);
    memcpy(to->newest, from->newest, (size_t)from->count * sizeof from->newest[0]);
    to->count = from->count;
    to->next = from->next;
}

// --- writing ---

struct writer {
    struct lw_log *log;
    int64_t utime_offset_us; // wall clock minus CLOCK_MONOTONIC
};

static void write_at(struct writer *w, enum lw_channel channel, const union lw_message *message, int64_t time_ns)
{
    lw_log_write(w->log, channel, message, time_ns / 1000 + w->utime_offset_us);
}

// Number of the newest message of a sender on a channel, 0 = not known any more.
static int64_t newest_seq(const struct lw_world *world, int64_t session, enum lw_world_channel channel)
{
    for (int i = 0; i < LW_SENDERS_MAX; i++)
        if (world->sender[i].session == session && world->sender[i].channel == (int)channel)
            return world->sender[i].seq;
    return 0;
}

// Messages that follow one of an owner on its channel, of the same.
static int count_more(struct lw_tell *tell, const struct lw_world *world, const struct lw_obstacle_change *first)
{
    struct lw_obstacle_change next;
    const int at = tell->next;
    int n = 0;
    while (lw_tell_next(tell, world, &next) && next.owner == first->owner &&
           lw_change_channel(&next) == lw_change_channel(first))
        n++;
    tell->next = at;
    return n;
}

// The obstacles known before the messages that follow; numbered so that an owner's next message is newer.
static void write_before(struct writer *w, struct lw_tell *tell, const struct lw_world *world, int64_t time_ns)
{
    union lw_message message;
    struct lw_obstacle_change *change = &message.obstacles;
    int left = 0; // messages of this owner on this channel
    lw_tell_begin(tell, world, 0);
    while (lw_tell_next(tell, world, change)) {
        const enum lw_world_channel channel = lw_change_channel(change);
        left = left > 0 ? left : 1 + count_more(tell, world, change);
        const int64_t newest = newest_seq(world, change->owner, channel);
        change->stamp = (struct lw_stamp){.session = change->owner, .seq = (newest > left ? newest : left) - left + 1};
        change->owner = 0;
        left--;
        write_at(w, channel == LW_WORLD_HULL ? LW_CHANNEL_HULL : LW_CHANNEL_OBSTACLES, &message, time_ns);
    }
}

// Messages heard up to a time, from the one numbered `from` on. Returns the number of the next.
static int write_heard(struct writer *w, const struct lw_heard_past *heard, int from, int64_t until_ns)
{
    for (; from < heard->count; from++) {
        const int oldest = heard->count < LW_HEARD_MAX ? 0 : heard->next;
        const struct lw_heard_message *m = &heard->newest[(oldest + from) % LW_HEARD_MAX];
        if (m->time_ns > until_ns)
            break;
        write_at(w, (enum lw_channel)m->channel, &m->message, m->time_ns);
    }
    return from;
}

// Every tick: its state when it is a new one, then its command.
static void write_ticks(struct writer *w, const struct lw_health *health, const struct lw_heard_past *heard,
                        struct lw_tell *tell)
{
    int back = 0, next = 0;
    while (lw_health_past(health, back) != NULL)
        back++;
    if (back > 0)
        write_before(w, tell, &heard->before, lw_health_past(health, back - 1)->time_ns);
    while (--back >= 0) {
        const struct lw_record *record = lw_health_past(health, back);
        next = write_heard(w, heard, next, record->time_ns);
        union lw_message message = {.joint_state = record->state};
        if (record->fresh)
            write_at(w, LW_CHANNEL_JOINT_STATE, &message, record->time_ns - record->age_ns);
        message.joint_command = record->command;
        write_at(w, LW_CHANNEL_JOINT_COMMAND, &message, record->time_ns + record->exec_ns);
    }
}

static const char *fault_name(unsigned fault)
{
    return fault & LW_FAULT_PEER_TIMEOUT ? "peer-timeout" : fault & LW_FAULT_LEASE ? "lease" : "bad-input";
}

// The process id tells the files of two controllers apart that lost their plants in the same second.
static void make_path(const struct lw_program *program, unsigned fault, char path[PATH_MAX_BYTES])
{
    char when[32];
    const time_t now = time(NULL);
    struct tm local;
    (void)strftime(when, sizeof when, "%Y%m%d-%H%M%S", localtime_r(&now, &local));
    snprintf(path, PATH_MAX_BYTES, "%s/postmortem-%s-%s-%d.lcm", program->postmortem, when, fault_name(fault),
             (int)getpid());
}

static void write_file(struct lw_postmortem *postmortem, const struct lw_program *program, struct lw_bus *bus,
                       const struct lw_health *health, struct lw_heard *heard)
{
    char path[PATH_MAX_BYTES];
    struct writer w = {.utime_offset_us = lw_clock_utime() - lw_clock_mono_ns() / 1000};
    make_path(program, postmortem->fault, path);
    enum lw_status status = LW_E_IO;
    if (mkdir(program->postmortem, FOLDER_MODE) == 0 || errno == EEXIST)
        status = lw_log_open(path, bus, &w.log);
    if (status == LW_OK) {
        // A copy, so that the world thread need not wait for the disk: obstacles and STOP go on being heard.
        pthread_mutex_lock(&heard->lock);
        copy_past(&heard->past, &postmortem->heard);
        pthread_mutex_unlock(&heard->lock);
        const struct lw_bus_scene scene = lw_program_scene(program);
        lw_log_write_scene(w.log, &scene, lw_clock_utime());
        write_ticks(&w, health, &postmortem->heard, &postmortem->tell);
        status = lw_log_close(w.log);
    }
    if (status == LW_OK)
        lw_program_say(program, "fault %s braked the arm; the last %d s: leeway report %s",
                       fault_name(postmortem->fault), LW_HEALTH_PAST_S, path);
    else
        lw_program_fail(program, "%s: cannot be written: %s", path, strerrordesc_np(errno));
}

// Faults, not seen before, of the ticks since the last look; a short one is gone in the newest.
//   first_ns  out  when the first of them was
static unsigned find_faults(struct lw_postmortem *postmortem, const struct lw_health *health, int64_t *first_ns)
{
    unsigned faults = 0;
    const int64_t looked_ns = postmortem->looked_ns;
    const struct lw_record *record = lw_health_past(health, 0);
    for (int back = 0; record != NULL && record->time_ns > looked_ns; record = lw_health_past(health, ++back)) {
        if (back == 0)
            postmortem->looked_ns = record->time_ns;
        // An idle controller has no arm to brake.
        if (record->faults == 0 || record->command.mode == LW_COMMAND_IDLE)
            continue;
        if (record->time_ns > postmortem->faulty_ns)
            postmortem->faulty_ns = record->time_ns;
        if ((record->faults & ~postmortem->seen) == 0)
            continue;
        faults |= record->faults & ~postmortem->seen;
        *first_ns = record->time_ns;
    }
    return faults;
}

void lw_postmortem_watch(struct lw_postmortem *postmortem, const struct lw_program *program, struct lw_bus *bus,
                         const struct lw_health *health, struct lw_heard *heard, int64_t now_ns)
{
    int64_t first_ns = 0;
    if (postmortem->looked_ns - postmortem->faulty_ns > forget_ns)
        postmortem->seen = 0;
    const unsigned faults = find_faults(postmortem, health, &first_ns);
    if (faults != 0 && postmortem->fault == 0)
        postmortem->due_ns = first_ns + aftermath_ns;
    postmortem->seen |= faults;
    postmortem->fault |= faults;
    if (postmortem->fault == 0 || now_ns < postmortem->due_ns)
        return;
    if (postmortem->written++ < FILES_MAX)
        write_file(postmortem, program, bus, health, heard);
    postmortem->fault = 0;
}
