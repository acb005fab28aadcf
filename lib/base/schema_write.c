// SPDX-License-Identifier: BSD-3-Clause
// Writing by a table of keys: the values as YAML, the table as a reference for people, what one key accepts.
//
// Units    none.
// Frames   none.
// Arrays   see schema.h.
// Memory   none beyond stdio's.
// Errors   none here; the caller checks its stream.
#include "base/schema.h"

#include <math.h>   // isinf
#include <stdlib.h> // strtod
#include <string.h> // memcpy, strlen

enum { INDENT = 2 };

// --- values ---

// The shortest decimal that reads back to the same bits; 17 digits always do.
static void write_number(double number, FILE *to)
{
    char text[32];
    int digits = 6;
    do
        snprintf(text, sizeof text, "%.*g", digits, number);
    while (strtod(text, NULL) != number && digits++ < 17);
    fputs(isinf(number) ? "off" : text, to); // only limits can be infinite
}

static void write_numbers(const double *numbers, int count, FILE *to)
{
    fputc('[', to);
    for (int i = 0; i < count; i++) {
        fputs(i ? ", " : "", to);
        write_number(numbers[i], to);
    }
    fputc(']', to);
}

static int read_int(const void *at)
{
    int value;
    memcpy(&value, at, sizeof value);
    return value;
}

static void write_rows(const struct lw_key *key, const unsigned char *at, const unsigned char *root, FILE *to)
{
    struct lw_rows rows;
    memcpy(&rows, at, sizeof rows);
    const double *numbers = (const double *)(const void *)(root + key->pool->offset) + rows.first;
    fputc('[', to);
    for (int i = 0; i < rows.count; i++) {
        fputs(i ? ", " : "", to);
        if (key->width == 1)
            write_number(numbers[i], to);
        else
            write_numbers(&numbers[(ptrdiff_t)i * key->width], key->width, to);
    }
    fputc(']', to);
}

static void write_inline(const struct lw_key *keys, const unsigned char *in, const unsigned char *root, FILE *to);

// Writes a value behind its key, in one line.
static void write_value(const struct lw_key *key, const unsigned char *parent, const unsigned char *root, FILE *to)
{
    const unsigned char *at = parent + key->offset;
    const double *numbers = (const double *)(const void *)at;
    switch (key->kind) {
    case LW_NUMBER: write_number(numbers[0], to); break;
    case LW_INTEGER: fprintf(to, "%d", read_int(at)); break;
    case LW_CHOICE: fputs(key->names[read_int(at)], to); break;
    case LW_LIMITS:
    case LW_VECTOR: write_numbers(numbers, key->count, to); break;
    case LW_ROWS: write_rows(key, at, root, to); break;
    case LW_SECTION: write_inline(key->keys, at, root, to); break;
    case LW_LIST: break; // none stands in an item of another
    }
}

// A mapping in one line, as items of lists are.
static void write_inline(const struct lw_key *keys, const unsigned char *in, const unsigned char *root, FILE *to)
{
    const char *before = "{";
    for (const struct lw_key *k = keys; k->name != NULL; k++) {
        if (!lw_schema_applies(k, in))
            continue;
        fprintf(to, "%s%s: ", before, k->name);
        write_value(k, in, root, to);
        before = ", ";
    }
    fputc('}', to);
}

static void write_list(const struct lw_key *key, const unsigned char *parent, const unsigned char *root, FILE *to)
{
    const int count = read_int(parent + key->count_offset);
    fputs(count ? "\n" : " []\n", to);
    for (int i = 0; i < count; i++) {
        fputs("  - ", to);
        write_inline(key->keys, parent + key->offset + (size_t)i * key->stride, root, to);
        fputc('\n', to);
    }
}

static void write_keys(const struct lw_key *keys, const unsigned char *in, const unsigned char *root, int indent,
                       FILE *to)
{
    for (; keys->name != NULL; keys++) {
        if (!lw_schema_applies(keys, in))
            continue;
        fprintf(to, "%*s%s:", indent, "", keys->name);
        if (keys->kind == LW_SECTION) {
            fputc('\n', to);
            write_keys(keys->keys, in + keys->offset, root, indent + INDENT, to);
        } else if (keys->kind == LW_LIST) {
            write_list(keys, in, root, to);
        } else {
            fputc(' ', to);
            write_value(keys, in, root, to);
            fputc('\n', to);
        }
    }
}

void lw_schema_write(const struct lw_key *keys, const void *in, FILE *to)
{
    write_keys(keys, in, in, 0, to);
}

// --- what a key accepts ---

bool lw_schema_applies(const struct lw_key *key, const void *in)
{
    return key->choice == NULL || (key->choices >> read_int((const unsigned char *)in + key->choice->offset) & 1U) != 0;
}

void lw_schema_choices(const struct lw_key *key, char *text, size_t size)
{
    snprintf(text, size, "%s", key->choice->name);
    const char *before = " ";
    for (int i = 0; key->choice->names[i] != NULL; i++)
        if ((key->choices >> i & 1U) != 0) {
            snprintf(text + strlen(text), size - strlen(text), "%s%s", before, key->choice->names[i]);
            before = ", ";
        }
}

static void range_text(const struct lw_key *key, char *text, size_t size)
{
    const char *above = key->above_min ? "> " : ">= ";
    if (isinf(key->min) && isinf(key->max))
        text[0] = '\0';
    else if (isinf(key->max))
        snprintf(text, size, " %s%g", above, key->min);
    else
        snprintf(text, size, " %s%g and <= %g", above, key->min, key->max);
    if (key->unit != NULL)
        snprintf(text + strlen(text), size - strlen(text), " (%s)", key->unit);
}

void lw_schema_expected(const struct lw_key *key, char *text, size_t size)
{
    char range[96];
    range_text(key, range, sizeof range);
    switch (key->kind) {
    case LW_NUMBER: snprintf(text, size, "a number%s", range); break;
    case LW_INTEGER: snprintf(text, size, "an integer%s", range); break;
    case LW_VECTOR: snprintf(text, size, "a list of %d numbers%s", key->count, range); break;
    case LW_LIMITS: snprintf(text, size, "off, a number%s, or a list of %d of them", range, key->count); break;
    case LW_ROWS:
        if (key->width == 1)
            snprintf(text, size, "a list of at most %d numbers%s", key->count, range);
        else
            snprintf(text, size, "a list of at most %d lists of %d numbers%s", key->count, key->width, range);
        break;
    case LW_SECTION: snprintf(text, size, "keys with values"); break;
    case LW_LIST: snprintf(text, size, "a list of at most %d entries", key->count); break;
    case LW_CHOICE:
        snprintf(text, size, "one of");
        for (int i = 0; key->names[i] != NULL; i++)
            snprintf(text + strlen(text), size - strlen(text), "%s %s", i ? "," : "", key->names[i]);
        break;
    }
}

// --- reference ---

// What stands below a key in the reference: what it belongs to, and its default or that it is required.
static void describe_rest(const struct lw_key *key, const unsigned char *in, const unsigned char *root, int indent,
                          FILE *to)
{
    if (key->choice != NULL) {
        char choices[160];
        lw_schema_choices(key, choices, sizeof choices);
        fprintf(to, "%*s    with %s\n", indent, "", choices);
    }
    const bool nested = key->kind == LW_SECTION || key->kind == LW_LIST;
    if (key->required) {
        fprintf(to, "%*s    required\n", indent, "");
    } else if (!nested) {
        fprintf(to, "%*s    default ", indent, "");
        write_value(key, in, root, to);
        fputc('\n', to);
    }
}

static void describe_keys(const struct lw_key *keys, const unsigned char *in, const unsigned char *root, int indent,
                          FILE *to)
{
    for (; keys->name != NULL; keys++) {
        char expected[192];
        lw_schema_expected(keys, expected, sizeof expected);
        fprintf(to, "%*s%s: %s\n%*s    %s\n", indent, "", keys->name, expected, indent, "", keys->help);
        describe_rest(keys, in, root, indent, to);
        // The struct's first item stands for every item that leaves a key out.
        if (keys->kind == LW_SECTION || keys->kind == LW_LIST)
            describe_keys(keys->keys, in + keys->offset, root, indent + INDENT, to);
    }
}

void lw_schema_describe(const struct lw_key *keys, const void *in, FILE *to)
{
    describe_keys(keys, in, in, 0, to);
}
