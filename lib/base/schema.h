// SPDX-License-Identifier: BSD-3-Clause
// Schema: reads a YAML document into plain structs and writes it back, driven by one table of keys.
//
// Units    named by each key.
// Frames   named by each key's help.
// Arrays   a table of keys ends with an entry whose name is NULL.
// Memory   reading uses the heap and frees it before it returns; not for the real-time path.
// Errors   LW_E_SCENE with one line of text: source, line, key, what was expected, what was found.
#ifndef LW_BASE_SCHEMA_H
#define LW_BASE_SCHEMA_H

#include "base/status.h" // enum lw_status

#include <stdbool.h> // bool
#include <stddef.h>  // size_t
#include <stdio.h>   // FILE

enum lw_kind {
    LW_NUMBER,  // double
    LW_INTEGER, // int
    LW_CHOICE,  // int, index into names
    LW_VECTOR,  // double[count]
    LW_LIMITS,  // double[count]: `off` (stored as infinity), one number for all, or count numbers
    LW_ROWS,    // struct lw_rows: at most count rows of `width` numbers each, stored in a pool
    LW_SECTION, // a mapping, read into the same struct tree by its own keys
    LW_LIST,    // a list of at most count mappings
};

// Rows of numbers in the pool that many keys share.
struct lw_rows {
    int first; // place of the first number in the pool
    int count; // rows
};

// Where a pool lies in the struct that is read.
struct lw_pool {
    size_t offset;      // double[capacity]
    size_t used_offset; // int
    int capacity;
};

struct lw_key {
    const char *name;
    enum lw_kind kind;
    bool required;               // else the value that stands in the struct stays
    size_t offset;               // from the start of the enclosing struct
    int count;                   // VECTOR, LIMITS: length; LIST, ROWS: capacity
    int width;                   // ROWS: numbers in a row; rows of 1 are plain numbers
    double min, max;             // NUMBER, INTEGER, VECTOR, LIMITS, ROWS: range
    bool above_min;              // the range excludes min
    const char *unit;            // SI symbol, or NULL
    const char *const *names;    // CHOICE: ended by NULL
    const struct lw_key *keys;   // SECTION, LIST: members
    size_t stride;               // LIST: bytes of one item
    size_t count_offset;         // LIST: where the number of items (int) is stored
    size_t line_offset;          // LIST: where in an item its line in the file (int) is stored; 0 = nowhere
    const struct lw_pool *pool;  // ROWS
    const struct lw_key *choice; // the key belongs to some values of this CHOICE, which stands before it in its table,
    unsigned choices;            // one bit each; NULL = it belongs to all
    const char *help;
};

struct lw_error {
    char text[1024];
};

// Text to read, and values that replace or add to it.
struct lw_source {
    const char *name;       // file name for messages
    const char *text;       // YAML
    const char *const *set; // "key=value" each, a later one wins; key is a dotted path: law.gamma, obstacles.0.radius
    int set_count;
};

// Reads a document.
//   keys   in      table of the top level
//   out    in/out  struct holding the defaults; written only on success
//   size   in      bytes of that struct
LW_MUST_CHECK enum lw_status lw_schema_read(const struct lw_key *keys, const struct lw_source *source, void *out,
                                            size_t size, struct lw_error *error);

// Writes every key and value as YAML that reads back to the same bits.
void lw_schema_write(const struct lw_key *keys, const void *in, FILE *to);

// Writes a reference of all keys for people, with the values of `in` as defaults; the first item of a list stands for
// what items leave out.
void lw_schema_describe(const struct lw_key *keys, const void *in, FILE *to);

// Whether a key belongs to what its table's choice says. `in` is the enclosing struct.
bool lw_schema_applies(const struct lw_key *key, const void *in);

// What a key accepts, for people: "a number > 0 (m)".
void lw_schema_expected(const struct lw_key *key, char *text, size_t size);

// The values of the choice that a key belongs to, for people: "shape capsule, box".
void lw_schema_choices(const struct lw_key *key, char *text, size_t size);

#endif
