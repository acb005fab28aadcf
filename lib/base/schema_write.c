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

static void write_scalar(const struct lw_key *key, const unsigned char *at, FILE *to)
{
    const double *numbers = (const double *)(const void *)at;
    switch (key->kind) {
    case LW_NUMBER: write_number(numbers[0], to); break;
    case LW_INTEGER: fprintf(to, "%d", read_int(at)); break;
    case LW_CHOICE: fputs(key->names[read_int(at)], to); break;
    case LW_LIMITS:
    case LW_VECTOR: write_numbers(numbers, key->count, to); break;
    case LW_SECTION:
    case LW_LIST: break;
    }
}

static void write_list(const struct lw_key *key, const unsigned char *parent, FILE *to)
{
    const int count = read_int(parent + key->count_offset);
    fputs(count ? "\n" : " []\n", to);
    for (int i = 0; i < count; i++) {
        const unsigned char *item = parent + key->offset + (size_t)i * key->stride;
        fputs("  - {", to);
        for (const struct lw_key *k = key->keys; k->name != NULL; k++) {
            fprintf(to, "%s%s: ", k == key->keys ? "" : ", ", k->name);
            write_scalar(k, item + k->offset, to);
        }
        fputs("}\n", to);
    }
}

static void write_keys(const struct lw_key *keys, const unsigned char *in, int indent, FILE *to)
{
    for (; keys->name != NULL; keys++) {
        fprintf(to, "%*s%s:", indent, "", keys->name);
        if (keys->kind == LW_SECTION) {
            fputc('\n', to);
            write_keys(keys->keys, in + keys->offset, indent + INDENT, to);
        } else if (keys->kind == LW_LIST) {
            write_list(keys, in, to);
        } else {
            fputc(' ', to);
            write_scalar(keys, in + keys->offset, to);
            fputc('\n', to);
        }
    }
}

void lw_schema_write(const struct lw_key *keys, const void *in, FILE *to)
{
    write_keys(keys, in, 0, to);
}

// --- what a key accepts ---

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

static void describe_keys(const struct lw_key *keys, const unsigned char *in, int indent, FILE *to)
{
    for (; keys->name != NULL; keys++) {
        char expected[192];
        lw_schema_expected(keys, expected, sizeof expected);
        fprintf(to, "%*s%s: %s\n%*s    %s\n", indent, "", keys->name, expected, indent, "", keys->help);
        const bool nested = keys->kind == LW_SECTION || keys->kind == LW_LIST;
        if (!nested && !keys->required && in != NULL) {
            fprintf(to, "%*s    default ", indent, "");
            write_scalar(keys, in + keys->offset, to);
            fputc('\n', to);
        } else if (keys->required) {
            fprintf(to, "%*s    required\n", indent, "");
        }
        // Items of a list have no defaults to show: there are none until the file lists some.
        const bool has_defaults = in != NULL && keys->kind == LW_SECTION;
        if (nested)
            describe_keys(keys->keys, has_defaults ? in + keys->offset : NULL, indent + INDENT, to);
    }
}

void lw_schema_describe(const struct lw_key *keys, const void *in, FILE *to)
{
    describe_keys(keys, in, 0, to);
}
