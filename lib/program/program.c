// SPDX-License-Identifier: BSD-3-Clause
// Command line by argp, scene, bus connections and messages of a program.
//
// Units    none.
// Frames   none.
// Arrays   none.
// Memory   see program.h.
// Errors   see program.h.
#define _GNU_SOURCE // argp, open_memstream
#include "program/program.h"

#include "base/build.h"  // LW_BUILD
#include "base/clock.h"  // lw_clock_session
#include "base/thread.h" // lw_thread_*

#include <argp.h>   // argp_parse
#include <limits.h> // INT_MAX
#include <stdarg.h> // va_list
#include <stdlib.h> // exit
#include <string.h> // strspn

enum { EXIT_FAILED = 1, EXIT_USAGE = 2, KEY_URL = 256, KEY_HELP_SCENE, KEY_UNTIL_DONE, KEY_PACE };

const char *argp_program_version = LW_BUILD;

// lcm-logger's queue holds 30 messages and drops what comes while it is full: at this pace it may sleep for 10 ms.
enum { PACE = 3000 };

// The first two are the simulator's alone: the controller's table starts behind them.
enum { SIMULATOR_OPTIONS = 2 };
static const struct argp_option argp_options[] = {
    {"until-done", KEY_UNTIL_DONE, NULL, 0, "End after the scene's duration_s, as lockstep does, not when stopped.", 0},
    {"pace", KEY_PACE, "N", 0, "In lockstep, N messages a second at most, so that a recorder can follow (3000).", 0},
    {"set", 's', "KEY=VALUE", 0, "Replace a key of the scene, as in --set law.gamma=2. Repeatable.", 0},
    {"lcm-url", KEY_URL, "URL", 0, "LCM bus. Default: $LCM_DEFAULT_URL, else multicast that stays on this host.", 0},
    {"name", 'n', "NAME", 0, "Robot's name: its channels become NAME_JOINT_STATE and so on.", 0},
    {"lockstep", 'l', NULL, 0, "Plant and controller wait for each other: as fast as possible, always the same result.",
     0},
    {"quiet", 'q', NULL, 0, "Errors only.", 0},
    {"help-scene", KEY_HELP_SCENE, NULL, 0, "List every key that a scene may have.", 0},
    {0}};

// NOLINTBEGIN(concurrency-mt-unsafe): argp and exit are called before any thread starts

static void parse_name(struct lw_program *program, const char *text, struct argp_state *state)
{
    const size_t length = strlen(text);
    if (length == 0 || length > LW_NAME_MAX || strspn(text, LW_NAME_LETTERS) != length)
        argp_error(state, "--name: expected 1 to %d letters, digits, _ or -, found \"%s\"", LW_NAME_MAX, text);
    else
        program->bus_config.name = text;
}

static void parse_pace(struct lw_program *program, const char *text, struct argp_state *state)
{
    char *end = NULL;
    const long pace = strtol(text, &end, 10);
    if (end == text || *end != '\0' || pace < 1 || pace > INT_MAX)
        argp_error(state, "--pace: expected a whole number > 0, found \"%s\"", text);
    else
        program->pace = (int)pace;
}

static error_t parse_option(int key, char *arg, struct argp_state *state)
{
    struct lw_program *program = state->input;
    switch (key) {
    case 's':
        if (program->set_count < LW_SETS_MAX)
            program->set[program->set_count++] = arg;
        else
            argp_error(state, "more than %d --set", LW_SETS_MAX);
        break;
    case KEY_URL: program->bus_config.url = arg; break;
    case 'n': parse_name(program, arg, state); break;
    case 'l': program->lockstep = true; break;
    case 'q': program->quiet = true; break;
    case KEY_UNTIL_DONE: program->until_done = true; break;
    case KEY_PACE: parse_pace(program, arg, state); break;
    case KEY_HELP_SCENE: lw_scene_describe(stdout); exit(0);
    case ARGP_KEY_ARG:
        if (program->path != NULL)
            argp_error(state, "expected one SCENE, found also %s", arg);
        program->path = arg;
        break;
    case ARGP_KEY_END:
        if (program->path == NULL)
            argp_error(state, "expected a SCENE, as in %s scenarios/c1.yaml", state->name);
        break;
    default: return ARGP_ERR_UNKNOWN;
    }
    return 0;
}

// The merged scene as text: it goes into the log.
static char *scene_text(const struct lw_scene *scene)
{
    char *text = NULL;
    size_t size = 0;
    FILE *to = open_memstream(&text, &size);
    if (to == NULL)
        return NULL;
    lw_scene_write(scene, to);
    return fclose(to) == 0 ? text : NULL;
}

static void parse_command_line(struct lw_program *program, int argc, char **argv)
{
    const struct argp argp = {argp_options + (program->is_simulator ? 0 : SIMULATOR_OPTIONS),
                              parse_option,
                              "SCENE",
                              program->summary,
                              NULL,
                              NULL,
                              NULL};
    argp_err_exit_status = EXIT_USAGE;
    program->pace = PACE;
    argp_parse(&argp, argc, argv, 0, NULL, program);
}

void lw_program_start(struct lw_program *program, int argc, char **argv)
{
    parse_command_line(program, argc, argv);
    struct lw_error error;
    if (lw_scene_load(program->path, program->set, program->set_count, &program->scene, &error) != LW_OK) {
        lw_program_fail(program, "%s", error.text);
        exit(EXIT_USAGE);
    }
    program->yaml = scene_text(&program->scene);
    if (program->yaml == NULL) {
        lw_program_fail(program, "out of memory");
        exit(EXIT_FAILED);
    }
    program->bus_config.session = lw_clock_session();
}

// NOLINTEND(concurrency-mt-unsafe)

// --- words ---

static void print(const struct lw_program *program, const char *format, va_list args)
    __attribute__((format(printf, 2, 0)));

static void print(const struct lw_program *program, const char *format, va_list args)
{
    char text[600];
    vsnprintf(text, sizeof text, format, args);
    fprintf(stderr, "%s: %s\n", program->name, text);
}

void lw_program_say(const struct lw_program *program, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    if (!program->quiet)
        print(program, format, args);
    va_end(args);
}

void lw_program_fail(const struct lw_program *program, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    print(program, format, args);
    va_end(args);
}

// --- bus ---

enum lw_status lw_program_open(const struct lw_program *program, struct lw_bus **bus)
{
    struct lw_error error;
    const enum lw_status status = lw_bus_open(&program->bus_config, bus, &error);
    if (status != LW_OK)
        lw_program_fail(program, "%s", error.text);
    return status;
}

enum lw_status lw_program_subscribe(const struct lw_program *program, struct lw_bus *bus, enum lw_channel channel,
                                    lw_bus_handler handler, void *user)
{
    struct lw_error error;
    const enum lw_status status = lw_bus_subscribe(bus, channel, handler, user, &error);
    if (status != LW_OK)
        lw_program_fail(program, "%s", error.text);
    return status;
}

void lw_program_announce(const struct lw_program *program, struct lw_bus *bus, int64_t *due_ns)
{
    const int64_t now_ns = lw_clock_mono_ns();
    if (now_ns < *due_ns)
        return;
    *due_ns = now_ns + LW_NS_PER_S;
    const struct lw_bus_scene scene = {.program = program->name,
                                       .mode = program->lockstep ? "lockstep" : "realtime",
                                       .file = program->path,
                                       .yaml = program->yaml};
    if (lw_bus_publish_scene(bus, &scene) != LW_OK)
        lw_program_say(program, "SCENE could not be sent; a log may lack it");
}

void lw_program_go_realtime(const struct lw_program *program, int priority)
{
    const bool locked = lw_thread_lock_memory(), prioritised = lw_thread_set_priority(priority);
    if (!locked || !prioritised)
        lw_program_say(program, "no real-time priority or locked memory (needs root, or limits rtprio and memlock): "
                                "deadlines depend on what else this machine does");
}

bool lw_program_thread(const struct lw_program *program, pthread_t *thread, void *(*run)(void *), void *user)
{
    if (lw_thread_start(thread, run, user))
        return true;
    lw_program_fail(program, "cannot start a thread");
    return false;
}
