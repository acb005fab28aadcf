// SPDX-License-Identifier: BSD-3-Clause
// Tests of what items of a list may hold: rows of numbers in a pool, sections, and keys that belong to a choice.
//
// Units    none.
// Frames   none.
// Arrays   none.
// Memory   stack; streams are freed here.
// Errors   cmocka's.
#define _GNU_SOURCE // open_memstream
#include "base/schema.h"
#include "helpers.h"

// --- a table ---

enum { POOL = 12 };

struct thing {
    int shape, line;
    double size, turn;
    struct lw_rows corners, times;
};

struct world {
    int used, count;
    double pool[POOL];
    struct thing thing[3];
};

static const char *const shapes[] = {"ball", "box", "star", NULL};
static const struct lw_pool pool = {
    .offset = offsetof(struct world, pool), .used_offset = offsetof(struct world, used), .capacity = POOL};

#define OF(field) .offset = offsetof(struct thing, field)
static const struct lw_key turn_keys[] = {
    {.name = "turn", .kind = LW_NUMBER, OF(turn), .min = 0, .max = 1, .help = "a number in a section of an item"},
    {.name = "times",
     .kind = LW_ROWS,
     OF(times),
     .count = 4,
     .width = 1,
     .pool = &pool,
     .min = 0,
     .above_min = true,
     .max = HUGE_VAL,
     .unit = "s",
     .help = "plain numbers"},
    {.name = NULL}};
static const struct lw_key thing_keys[] = {
    {.name = "shape", .kind = LW_CHOICE, OF(shape), .names = shapes, .help = "a choice"},
    {.name = "size",
     .kind = LW_NUMBER,
     OF(size),
     .max = 9,
     .choice = &thing_keys[0],
     .choices = 1U << 0 | 1U << 1,
     .help = "of a ball or box"},
    {.name = "corners",
     .kind = LW_ROWS,
     OF(corners),
     .required = true,
     .count = 3,
     .width = 2,
     .pool = &pool,
     .min = -1,
     .max = 1,
     .choice = &thing_keys[0],
     .choices = 1U << 2,
     .help = "of a star"},
    {.name = "more", .kind = LW_SECTION, .keys = turn_keys, .help = "a section"},
    {.name = NULL}};
static const struct lw_key world_keys[] = {{.name = "things",
                                            .kind = LW_LIST,
                                            .offset = offsetof(struct world, thing),
                                            .count = 3,
                                            .keys = thing_keys,
                                            .stride = sizeof(struct thing),
                                            .count_offset = offsetof(struct world, count),
                                            .line_offset = offsetof(struct thing, line),
                                            .help = "a list"},
                                           {.name = NULL}};

static enum lw_status read_world(const char *text, const char *set, struct world *out, struct lw_error *error)
{
    const struct lw_source source = {.name = "f.yaml", .text = text, .set = &set, .set_count = set != NULL};
    return lw_schema_read(world_keys, &source, out, sizeof *out, error);
}

static struct world accept(const char *text, const char *set)
{
    struct world world = {.used = 0};
    struct lw_error error = {""};
    if (read_world(text, set, &world, &error) != LW_OK)
        fail_msg("refused: %s", error.text);
    return world;
}

static void refuse(const char *text, const char *set, const char *words)
{
    struct world world = {.used = 0}, before = {.used = 0};
    struct lw_error error = {""};
    assert_int_equal(read_world(text, set, &world, &error), LW_E_SCENE);
    assert_string_equal(error.text, words);
    assert_same_bits(&world, &before, sizeof world);
}

// --- rows ---

static const double *row(const struct world *world, const struct lw_rows *rows, int width, int i)
{
    return &world->pool[rows->first + width * i];
}

// Rows of several items lie behind each other in the pool, each list knows its own.
static void rows_share_a_pool(void **state)
{
    (void)state;
    const struct world w = accept("things:\n  - {shape: star, corners: [[0, 1], [-1, 0.5]], more: {times: [4]}}\n"
                                  "  - {shape: star, corners: []}\n"
                                  "  - {shape: star, corners: [[0.25, 0]], more: {times: [1, 2, 3]}}\n",
                                  NULL);
    const double corners[] = {0, 1, -1, 0.5}, last[] = {0.25, 0}, times[] = {1, 2, 3};
    assert_int_equal(w.used, 4 + 1 + 2 + 3);
    assert_int_equal(w.thing[0].corners.count, 2);
    assert_all_near(row(&w, &w.thing[0].corners, 2, 0), corners, 4, 0);
    assert_near(*row(&w, &w.thing[0].times, 1, 0), 4, 0);
    assert_int_equal(w.thing[1].corners.count, 0);
    assert_all_near(row(&w, &w.thing[2].corners, 2, 0), last, 2, 0);
    assert_int_equal(w.thing[2].times.count, 3);
    assert_all_near(row(&w, &w.thing[2].times, 1, 0), times, 3, 0);
}

// What is wrong is named by the line of its row and by the entry.
static void wrong_rows_are_refused(void **state)
{
    (void)state;
    static const char stars[] = "things:\n  - shape: star\n    corners:\n      - [0, 0]\n      - %s\n";
    static const struct {
        const char *row, *found;
    } bad[] = {{"[0]", "a list of 1"}, {"[0, 0, 0]", "a list of 3"}, {"[0, 1.5]", "\"1.5\""},    {"[x, 0]", "\"x\""},
               {"5", "\"5\""},         {"{a: 1}", "a mapping"},      {"[[0], 0]", "a list of 1"}};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        char text[128], words[200];
        snprintf(text, sizeof text, stars, bad[i].row);
        snprintf(words, sizeof words,
                 "f.yaml:5: things.0.corners: expected a list of at most 3 lists of 2 numbers >= -1 and <= 1, found %s",
                 bad[i].found);
        refuse(text, NULL, words);
    }
    refuse("things: [{shape: star, corners: 5}]", NULL,
           "f.yaml:1: things.0.corners: expected a list of at most 3 lists of 2 numbers >= -1 and <= 1, found \"5\"");
    refuse("things: [{shape: star, corners: [[0, 0], [0, 0], [0, 0], [0, 0]]}]", NULL,
           "f.yaml:1: things.0.corners: expected a list of at most 3 lists of 2 numbers >= -1 and <= 1, "
           "found a list of 4");
    refuse("things: [{more: {times: [1, 0]}}]", NULL,
           "f.yaml:1: things.0.more.times: expected a list of at most 4 numbers > 0 (s), found \"0\"");
}

// The pool holds twelve numbers: six rows of two, not one more.
static void a_full_pool_is_refused(void **state)
{
    (void)state;
    static const char two[] = "things:\n  - {shape: star, corners: [[0, 0], [0, 0], [0, 0]]}\n"
                              "  - {shape: star, corners: [[0, 0], [0, 0], [0, 0]]}\n";
    char text[256];
    assert_int_equal(accept(two, NULL).used, POOL);
    snprintf(text, sizeof text, "%s  - {more: {times: [1]}}\n", two);
    refuse(text, NULL, "f.yaml:4: things.2.more.times: expected at most 12 numbers in all lists of lists, found more");
}

// --- keys that belong to a choice ---

static void a_key_of_another_choice_is_refused(void **state)
{
    (void)state;
    assert_near(accept("things: [{shape: box, size: 3}]", NULL).thing[0].size, 3, 0);
    assert_near(accept("things: [{size: 3}]", NULL).thing[0].size, 3, 0);
    refuse("things:\n  - shape: star\n    size: 3\n    corners: []\n", NULL,
           "f.yaml:3: things.0.size: expected this key with shape ball, box only, found star");
    refuse("things:\n  - corners: []\n", NULL,
           "f.yaml:2: things.0.corners: expected this key with shape star only, found ball");
    refuse("things: [{}]", "things.0.corners=[]",
           "--set things.0.corners=[]: things.0.corners: expected this key with shape star only, found ball");
    refuse("things: [{size: 3}]", "things.0.shape=star",
           "f.yaml:1: things.0.size: expected this key with shape ball, box only, found star");
}

// A required key is required with its choice alone.
static void a_missing_key_of_the_choice_is_refused(void **state)
{
    (void)state;
    assert_int_equal(accept("things: [{}, {shape: box}]", NULL).count, 2);
    refuse("things:\n  - {}\n  - shape: star\n", NULL,
           "f.yaml:3: things.1.corners: missing key: expected a list of at most 3 lists of 2 numbers >= -1 and <= 1");
}

// --- lines ---

static void items_know_their_lines(void **state)
{
    (void)state;
    const struct world w = accept("things:\n  - {}\n\n  - shape: box\n    size: 1\n  - {}\n", "things.1.size=2");
    assert_int_equal(w.thing[0].line, 2);
    assert_int_equal(w.thing[1].line, 4);
    assert_int_equal(w.thing[2].line, 6);
    assert_int_equal(accept("things: [{}]", "things=[{size: 2}]").thing[0].line, 0);
}

// --- writing ---

static char *print(const struct world *world)
{
    char *text = NULL;
    size_t size = 0;
    FILE *to = open_memstream(&text, &size);
    assert_non_null(to);
    if (world != NULL)
        lw_schema_write(world_keys, world, to);
    else
        lw_schema_describe(world_keys, &(const struct world){.used = 0}, to);
    assert_int_equal(fclose(to), 0);
    return text;
}

// Only keys of the item's choice are written, and what is written is what was read.
static void items_are_written_as_they_were_read(void **state)
{
    (void)state;
    static const char text[] = "things:\n"
                               "  - {shape: ball, size: 0.1, more: {turn: 0, times: []}}\n"
                               "  - {shape: star, corners: [[0.1, -1], [0, 1e-300]], more: {turn: 1, times: [2, 3]}}\n"
                               "  - {shape: star, corners: [], more: {turn: 0, times: [0.25]}}\n";
    const struct world world = accept(text, NULL);
    char *written = print(&world);
    assert_string_equal(written, text);
    free(written);
}

static void the_reference_says_what_a_key_belongs_to(void **state)
{
    (void)state;
    char *text = print(NULL);
    assert_string_equal(
        text, "things: a list of at most 3 entries\n    a list\n"
              "  shape: one of ball, box, star\n      a choice\n      default ball\n"
              "  size: a number >= 0 and <= 9\n      of a ball or box\n      with shape ball, box\n      default 0\n"
              "  corners: a list of at most 3 lists of 2 numbers >= -1 and <= 1\n      of a star\n"
              "      with shape star\n      required\n"
              "  more: keys with values\n      a section\n"
              "    turn: a number >= 0 and <= 1\n        a number in a section of an item\n        default 0\n"
              "    times: a list of at most 4 numbers > 0 (s)\n        plain numbers\n        default []\n");
    free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rows_share_a_pool),
        cmocka_unit_test(wrong_rows_are_refused),
        cmocka_unit_test(a_full_pool_is_refused),
        cmocka_unit_test(a_key_of_another_choice_is_refused),
        cmocka_unit_test(a_missing_key_of_the_choice_is_refused),
        cmocka_unit_test(items_know_their_lines),
        cmocka_unit_test(items_are_written_as_they_were_read),
        cmocka_unit_test(the_reference_says_what_a_key_belongs_to),
    };
    return cmocka_run_group_tests_name("schema_rows", tests, NULL, NULL);
}
