// SPDX-License-Identifier: BSD-3-Clause
// LCM logs by LCM's own writer.
//
// Units    see log.h.
// Frames   none.
// Arrays   none.
// Memory   see log.h.
// Errors   see log.h.
#include "bus/log.h"

#include "bus/connection.h" // struct lw_bus

#include <lcm/eventlog.h> // lcm_eventlog_*
#include <stdlib.h>       // calloc
#include <string.h>       // strlen

struct lw_log {
    lcm_eventlog_t *file;
    struct lw_bus *bus;
    bool failed;
};

enum lw_status lw_log_open(const char *path, struct lw_bus *bus, struct lw_log **out)
{
    struct lw_log *log = calloc(1, sizeof *log);
    if (log == NULL)
        return LW_E_IO;
    *log = (struct lw_log){.file = lcm_eventlog_create(path, "w"), .bus = bus};
    if (log->file == NULL) {
        free(log);
        return LW_E_IO;
    }
    *out = log;
    return LW_OK;
}

static void append(struct lw_log *log, char *channel, void *data, int size, int64_t utime)
{
    lcm_eventlog_event_t event = {
        .timestamp = utime, .channellen = (int32_t)strlen(channel), .datalen = size, .channel = channel, .data = data};
    log->failed |= lcm_eventlog_write_event(log->file, &event) != 0;
}

void lw_log_write(struct lw_log *log, enum lw_channel channel, const union lw_message *message, int64_t utime)
{
    unsigned char data[LW_WIRE_MAX];
    const uint32_t size = lw_wire_encode(channel, message, data);
    append(log, log->bus->channel_name[channel], data, (int)size, utime);
}

void lw_log_write_scene(struct lw_log *log, const struct lw_bus_scene *scene, int64_t utime)
{
    const leeway_scene_t w = lw_bus_scene_wire(log->bus, scene);
    const int size = leeway_scene_t_encoded_size(&w);
    void *data = malloc((size_t)size);
    if (data != NULL && leeway_scene_t_encode(data, 0, size, &w) == size)
        append(log, log->bus->scene_channel, data, size, utime);
    else
        log->failed = true;
    free(data);
}

enum lw_status lw_log_close(struct lw_log *log)
{
    bool ok = !log->failed && fflush(log->file->f) == 0;
    ok = ok && ferror(log->file->f) == 0;
    lcm_eventlog_destroy(log->file);
    free(log);
    return ok ? LW_OK : LW_E_IO;
}
