// SPDX-License-Identifier: BSD-3-Clause
// A table of keys with one of every kind, and reading by it.
//
// Units    none.
// Frames   none.
// Arrays   none.
// Memory   stack.
// Errors   cmocka's.
#ifndef LW_TESTS_SCHEMA_SAMPLE_H
#define LW_TESTS_SCHEMA_SAMPLE_H

#include "base/schema.h"
#include "helpers.h"

// --- a table with every kind ---

// No padding: samples are compared as bytes.
struct item {
    int id, unused;
    double at[2];
};

struct sample {
    double number;
    int integer;
    int choice;
    double vector[3];
    double limits[2];
    double inner;
    int count, unused;
    struct item item[3];
};

static const char *const colours[] = {"red", "green", "blue", NULL};

static const struct lw_key inner_keys[] = {{.name = "inner",
                                            .kind = LW_NUMBER,
                                            .offset = offsetof(struct sample, inner),
                                            .min = 0,
                                            .max = HUGE_VAL,
                                            .unit = "m",
                                            .above_min = true,
                                            .help = "a number in a section"},
                                           {.name = NULL}};
static const struct lw_key item_keys[] = {{.name = "id",
                                           .kind = LW_INTEGER,
                                           .offset = offsetof(struct item, id),
                                           .min = 0,
                                           .max = 9,
                                           .help = "number of an item"},
                                          {.name = "at",
                                           .kind = LW_VECTOR,
                                           .offset = offsetof(struct item, at),
                                           .required = true,
                                           .count = 2,
                                           .min = -1,
                                           .max = 1,
                                           .help = "place of an item"},
                                          {.name = NULL}};
static const struct lw_key sample_keys[] = {
    {.name = "number",
     .kind = LW_NUMBER,
     .offset = offsetof(struct sample, number),
     .required = true,
     .min = -10,
     .max = 10,
     .help = "a number"},
    {.name = "integer",
     .kind = LW_INTEGER,
     .offset = offsetof(struct sample, integer),
     .min = 1,
     .max = 4,
     .help = "an integer"},
    {.name = "choice",
     .kind = LW_CHOICE,
     .offset = offsetof(struct sample, choice),
     .names = colours,
     .help = "a colour"},
    {.name = "vector",
     .kind = LW_VECTOR,
     .offset = offsetof(struct sample, vector),
     .count = 3,
     .min = -HUGE_VAL,
     .max = HUGE_VAL,
     .help = "a vector"},
    {.name = "limits",
     .kind = LW_LIMITS,
     .offset = offsetof(struct sample, limits),
     .count = 2,
     .min = 0,
     .max = HUGE_VAL,
     .above_min = true,
     .help = "two limits"},
    {.name = "section", .kind = LW_SECTION, .keys = inner_keys, .help = "a section"},
    {.name = "items",
     .kind = LW_LIST,
     .offset = offsetof(struct sample, item),
     .count = 3,
     .keys = item_keys,
     .stride = sizeof(struct item),
     .count_offset = offsetof(struct sample, count),
     .help = "a list"},
    {.name = NULL}};

static inline struct sample defaults(void)
{
    return (struct sample){.integer = 2, .vector = {0, -0.5, 0}, .limits = {3, 3}, .inner = 0.25};
}

static inline enum lw_status read_with(const char *text, const char *const *set, int set_count, struct sample *out,
                                       struct lw_error *error)
{
    const struct lw_source source = {.name = "f.yaml", .text = text, .set = set, .set_count = set_count};
    return lw_schema_read(sample_keys, &source, out, sizeof *out, error);
}

static inline struct sample accept_with(const char *text, const char *const *set, int set_count)
{
    struct sample s = defaults();
    struct lw_error error = {""};
    if (read_with(text, set, set_count, &s, &error) != LW_OK)
        fail_msg("refused: %s", error.text);
    return s;
}

static inline struct sample accept(const char *text)
{
    return accept_with(text, NULL, 0);
}

#endif
