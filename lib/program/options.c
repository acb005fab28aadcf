// SPDX-License-Identifier: BSD-3-Clause
// Command line by argp, and the scene it names.
//
// Units    none.
// Frames   none.
// Arrays   none.
// Memory   see program.h.
// Errors   see program.h.
#define _GNU_SOURCE          // argp, open_memstream
#include "base/build.h"      // LW_BUILD
#include "base/clock.h"      // lw_clock_session
#include "program/program.h" // struct lw_program

#include <argp.h>   // argp_parse
#include <limits.h> // INT_MAX
#include <sched.h>  // CPU_SETSIZE
#include <stdlib.h> // exit
#include <string.h> // strspn

enum { EXIT_FAILED = 1, EXIT_USAGE = 2 };
enum {
    KEY_URL = 256,
    KEY_HELP_SCENE,
    KEY_UNTIL_DONE,
    KEY_PACE,
    KEY_REALTIME,
    KEY_CPU,
    KEY_PRIORITY,
    KEY_HISTOGRAM,
    KEY_POSTMORTEM,
    KEY_TRANSPORT
};

const char *argp_program_version = LW_BUILD;

// lcm-logger's queue holds 30 messages and drops what comes while it is full: at this pace it may sleep for 10 ms.
enum { PACE = 3000 };

// Above what a system itself runs at real-time priority, below its watchdogs.
enum { PRIORITY = 80, PRIORITY_MIN = 2, PRIORITY_MAX = 98 };

static const struct argp_option simulator_options[] = {
    {"until-done", KEY_UNTIL_DONE, NULL, 0, "End after the scene's duration_s, as lockstep does, not when stopped.", 0},
    {"pace", KEY_PACE, "N", 0, "In lockstep, N messages a second at most, so that a recorder can follow (3000).", 0},
    {0}};
static const struct argp_option controller_options[] = {
    {"post-mortem", KEY_POSTMORTEM, "DIR", 0,
     "Folder for the last two seconds before a fault that brakes the arm, as a log; none writes no file (runs).", 0},
    {0}};
static const struct argp_option common_options[] = {
    {"set", 's', "KEY=VALUE", 0, "Replace a key of the scene, as in --set law.gamma=2. Repeatable.", 0},
    {"lcm-url", KEY_URL, "URL", 0, "LCM bus. Default: $LCM_DEFAULT_URL, else multicast that stays on this host.", 0},
    {"name", 'n', "NAME", 0, "Robot's name: its channels become NAME_JOINT_STATE and so on.", 0},
    {"lockstep", 'l', NULL, 0, "Plant and controller wait for each other: as fast as possible, always the same result.",
     0},
    {"rt", KEY_REALTIME, "WISH", 0,
     "Real-time priority and locked memory: auto takes what the system grants and says what it does not, require "
     "starts only with all of it, off asks for none (auto).",
     0},
    {"cpu", KEY_CPU, "N", 0, "Bind the real-time thread to this CPU.", 0},
    {"priority", KEY_PRIORITY, "P", 0, "SCHED_FIFO priority of the real-time thread, 2 to 98 (80).", 0},
    {"transport", KEY_TRANSPORT, "HOW", 0,
     "Receive by a socket of its own for each channel in the thread that wants it (own), or by LCM's threads (lcm).",
     0},
    {"histogram", KEY_HISTOGRAM, "FILE", 0, "At the end, write the loop's timing as JSON, in bins of 1 us.", 0},
    {"quiet", 'q', NULL, 0, "Errors only.", 0},
    {"help-scene", KEY_HELP_SCENE, NULL, 0, "List every key that a scene may have.", 0},
    {0}};
enum { OPTIONS_MAX = 32 };

// NOLINTBEGIN(concurrency-mt-unsafe): argp and exit are called before any thread starts

static void parse_name(struct lw_program *program, const char *text, struct argp_state *state)
{
    const size_t length = strlen(text);
    if (length == 0 || length > LW_NAME_MAX || strspn(text, LW_NAME_LETTERS) != length)
        argp_error(state, "--name: expected 1 to %d letters, digits, _ or -, found \"%s\"", LW_NAME_MAX, text);
    else
        program->bus_config.name = text;
}

// A whole number from min to max; what is none ends the program.
static int parse_number(const char *option, const char *text, int min, int max, struct argp_state *state)
{
    char *end = NULL;
    const long number = strtol(text, &end, 10);
    if (end == text || *end != '\0' || number < min || number > max)
        argp_error(state, "--%s: expected a whole number from %d to %d, found \"%s\"", option, min, max, text);
    return (int)number;
}

// One of the words of a list that ends with NULL, as its place there.
static int parse_choice(const char *option, const char *text, const char *const *words, struct argp_state *state)
{
    char expected[100] = "";
    int found = 0;
    for (; words[found] != NULL && strcmp(words[found], text) != 0; found++)
        snprintf(expected + strlen(expected), sizeof expected - strlen(expected), "%s%s", found ? ", " : "",
                 words[found]);
    if (words[found] == NULL)
        argp_error(state, "--%s: expected one of %s, found \"%s\"", option, expected, text);
    return found;
}

static const char *const realtime_wishes[] = {
    [LW_REALTIME_AUTO] = "auto", [LW_REALTIME_REQUIRE] = "require", [LW_REALTIME_OFF] = "off", NULL};
static const char *const transports[] = {"own", "lcm", NULL};

// Options about keeping time.
static error_t parse_realtime_option(int key, char *arg, struct argp_state *state)
{
    struct lw_program *program = state->input;
    switch (key) {
    case KEY_REALTIME:
        program->realtime_wish = (enum lw_realtime_wish)parse_choice("rt", arg, realtime_wishes, state);
        break;
    case KEY_TRANSPORT: program->lcm_threads = parse_choice("transport", arg, transports, state) == 1; break;
    case KEY_CPU: program->cpu = parse_number("cpu", arg, 0, CPU_SETSIZE - 1, state); break;
    case KEY_PRIORITY: program->priority = parse_number("priority", arg, PRIORITY_MIN, PRIORITY_MAX, state); break;
    case KEY_POSTMORTEM: program->postmortem = strcmp(arg, "none") == 0 ? NULL : arg; break;
    case KEY_HISTOGRAM: program->histogram = arg; break;
    default: return ARGP_ERR_UNKNOWN;
    }
    return 0;
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
    case KEY_PACE: program->pace = parse_number("pace", arg, 1, INT_MAX, state); break;
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
    default: return parse_realtime_option(key, arg, state);
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

// Appends a table that ends with an empty row; returns the number of rows so far.
static size_t append(struct argp_option *table, size_t count, const struct argp_option *rows)
{
    for (; rows->name != NULL; rows++)
        table[count++] = *rows;
    return count;
}

static void parse_command_line(struct lw_program *program, int argc, char **argv)
{
    struct argp_option table[OPTIONS_MAX] = {0};
    const size_t own = append(table, 0, program->is_simulator ? simulator_options : controller_options);
    (void)append(table, own, common_options);
    const struct argp argp = {.options = table, .parser = parse_option, .args_doc = "SCENE", .doc = program->summary};
    argp_err_exit_status = EXIT_USAGE;
    program->pace = PACE;
    program->priority = PRIORITY;
    program->cpu = -1;
    program->postmortem = "runs";
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
    program->bus_config.refusals = &program->refusals;
}

// NOLINTEND(concurrency-mt-unsafe)
