// SPDX-License-Identifier: BSD-3-Clause
// Reading YAML by a table of keys: libyaml parses the text to a tree with line marks, the table checks the tree.
//
// Units    none.
// Frames   none.
// Arrays   see schema.h.
// Memory   the tree and a working copy of the struct, freed before return.
// Errors   the first problem found is reported and ends the reading.
#include "base/schema.h"

#include "base/schema_values.h" // lw_value_*
#include "base/yaml_tree.h"     // struct lw_tree, lw_tree_*

#include <stdarg.h> // va_list
#include <stdlib.h> // malloc
#include <string.h> // memcpy, strcmp

enum { PATH_MAX_LENGTH = 128 };

struct reader {
    const struct lw_source *source;
    bool *set_used;
    char path[PATH_MAX_LENGTH]; // dotted path of the value being read
    unsigned char *root;        // the struct that is filled
    struct lw_error *error;
};

// A value found: the tree it stands in (the file's, or an override's), its node, and the override's index or -1.
struct value {
    const struct lw_tree *tree;
    const yaml_node_t *node;
    int set;
};

static enum lw_status read_mapping(struct reader *r, const struct lw_key *keys, const struct value *mapping,
                                   unsigned char *out);

// --- messages ---

static enum lw_status refuse(struct reader *r, const struct value *at, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

// Fills the error: where (file and line, or the override), key, then the text.
static enum lw_status refuse(struct reader *r, const struct value *at, const char *format, ...)
{
    char where[256], what[384];
    if (at->set >= 0)
        snprintf(where, sizeof where, "--set %.100s%s", r->source->set[at->set],
                 strlen(r->source->set[at->set]) > 100 ? "..." : "");
    else
        snprintf(where, sizeof where, "%s:%d", r->source->name, lw_tree_line(at->node));
    va_list args;
    va_start(args, format);
    vsnprintf(what, sizeof what, format, args);
    va_end(args);
    snprintf(r->error->text, sizeof r->error->text, "%s: %s%s%s", where, r->path, r->path[0] ? ": " : "", what);
    return LW_E_SCENE;
}

// Refuses a value that is not of its key's kind; in a list of the right length it names the entry that is wrong.
static enum lw_status refuse_kind(struct reader *r, const struct value *at, const struct lw_key *key)
{
    char expected[192], found[96];
    lw_schema_expected(key, expected, sizeof expected);
    const int length = key->kind == LW_ROWS ? key->width : key->count;
    const bool has_entries = key->kind == LW_VECTOR || key->kind == LW_LIMITS || key->kind == LW_ROWS;
    lw_tree_found(has_entries ? lw_value_wrong(key, at->tree, at->node, length) : at->node, found, sizeof found);
    return refuse(r, at, "expected %s, found %s", expected, found);
}

// --- composites ---

// Extends the path for the life of a nested read; returns the old length for path_pop.
static size_t path_push(struct reader *r, const char *name)
{
    const size_t old = strlen(r->path);
    snprintf(r->path + old, sizeof r->path - old, "%s%s", old ? "." : "", name);
    return old;
}

static void path_pop(struct reader *r, size_t old)
{
    r->path[old] = '\0';
}

// Puts the rows of a list behind those already in their pool.
static enum lw_status read_rows(struct reader *r, const struct lw_key *key, const struct value *v, struct lw_rows *out)
{
    const int count = lw_tree_length(v->node);
    if (count < 0 || count > key->count)
        return refuse_kind(r, v, key);
    const struct lw_pool *pool = key->pool;
    double *numbers = (double *)(void *)(r->root + pool->offset);
    int used = 0;
    memcpy(&used, r->root + pool->used_offset, sizeof used);
    if (count * key->width > pool->capacity - used)
        return refuse(r, v, "expected at most %d numbers in all lists of lists, found more", pool->capacity);
    const struct lw_rows rows = {used, count};
    for (int i = 0; i < count; i++, used += key->width) {
        const struct value row = {v->tree, lw_tree_item(v->tree, v->node, i), v->set};
        if (!lw_value_row(key, row.tree, row.node, &numbers[used]))
            return refuse_kind(r, &row, key);
    }
    memcpy(r->root + pool->used_offset, &used, sizeof used);
    *out = rows;
    return LW_OK;
}

static enum lw_status read_list(struct reader *r, const struct lw_key *key, const struct value *v,
                                unsigned char *parent)
{
    const int count = lw_tree_length(v->node);
    if (count < 0 || count > key->count)
        return refuse_kind(r, v, key);
    for (int i = 0; i < count; i++) {
        char index[16];
        snprintf(index, sizeof index, "%d", i);
        const size_t old = path_push(r, index);
        const struct value item = {v->tree, lw_tree_item(v->tree, v->node, i), v->set};
        unsigned char *out = parent + key->offset + (size_t)i * key->stride;
        const int line = v->set < 0 ? lw_tree_line(item.node) : 0;
        if (key->line_offset != 0)
            memcpy(out + key->line_offset, &line, sizeof line);
        enum lw_status status = read_mapping(r, key->keys, &item, out);
        path_pop(r, old);
        if (status != LW_OK)
            return status;
    }
    memcpy(parent + key->count_offset, &count, sizeof count);
    return LW_OK;
}

static enum lw_status read_value(struct reader *r, const struct lw_key *key, const struct value *v,
                                 unsigned char *parent)
{
    void *out = parent + key->offset;
    bool ok = false;
    switch (key->kind) {
    case LW_NUMBER: ok = lw_value_number(key, v->node, out); break;
    case LW_INTEGER: ok = lw_value_integer(key, v->node, out); break;
    case LW_CHOICE: ok = lw_value_choice(key, v->node, out); break;
    case LW_VECTOR: ok = lw_value_list(key, v->tree, v->node, key->count, out); break;
    case LW_LIMITS: ok = lw_value_limits(key, v->tree, v->node, out); break;
    case LW_ROWS: return read_rows(r, key, v, out);
    case LW_SECTION: return read_mapping(r, key->keys, v, out);
    case LW_LIST: return read_list(r, key, v, parent);
    }
    return ok ? LW_OK : refuse_kind(r, v, key);
}

// Index of the newest override of the current path, or -1; marks all of them used.
static int find_set(struct reader *r)
{
    const size_t length = strlen(r->path);
    int found = -1;
    for (int i = 0; i < r->source->set_count; i++) {
        const char *set = r->source->set[i];
        if (strncmp(set, r->path, length) == 0 && set[length] == '=') {
            r->set_used[i] = true;
            found = i;
        }
    }
    return found;
}

// Reads an override: its text is a small YAML document of its own.
static enum lw_status read_set(struct reader *r, const struct lw_key *key, int set, unsigned char *parent)
{
    struct lw_tree tree;
    struct value v = {&tree, NULL, set};
    char problem[128];
    if (!lw_tree_parse(&tree, strchr(r->source->set[set], '=') + 1, problem, sizeof problem))
        return refuse(r, &v, "%s", problem);
    v.node = lw_tree_root(&tree);
    enum lw_status status = v.node != NULL ? read_value(r, key, &v, parent) : refuse_kind(r, &v, key);
    lw_tree_free(&tree);
    return status;
}

// Refuses a key that is given although the choice before it has no such key.
static enum lw_status check_absent(struct reader *r, const struct lw_key *key, const struct value *mapping,
                                   const unsigned char *out, int set)
{
    const yaml_node_t *node = lw_tree_lookup(mapping->tree, mapping->node, key->name);
    if (set < 0 && node == NULL)
        return LW_OK;
    const struct value at = {mapping->tree, node, set >= 0 ? set : mapping->set};
    char choices[160];
    int found = 0;
    lw_schema_choices(key, choices, sizeof choices);
    memcpy(&found, out + key->choice->offset, sizeof found);
    return refuse(r, &at, "expected this key with %s only, found %s", choices, key->choice->names[found]);
}

// Reads one key of a mapping from the override, else from the mapping, else leaves the default.
static enum lw_status read_key(struct reader *r, const struct lw_key *key, const struct value *mapping,
                               unsigned char *out)
{
    // A section is visited even when the file lacks it: an override may name a key inside.
    const int set = find_set(r);
    if (!lw_schema_applies(key, out))
        return check_absent(r, key, mapping, out, set);
    if (set >= 0)
        return read_set(r, key, set, out);
    const struct value v = {mapping->tree, lw_tree_lookup(mapping->tree, mapping->node, key->name), mapping->set};
    if (v.node != NULL || key->kind == LW_SECTION)
        return read_value(r, key, &v, out);
    if (!key->required)
        return LW_OK;
    char expected[192];
    lw_schema_expected(key, expected, sizeof expected);
    return refuse(r, mapping, "missing key: expected %s", expected);
}

static const struct lw_key *find_key(const struct lw_key *keys, const char *name)
{
    for (; keys->name != NULL; keys++)
        if (strcmp(keys->name, name) == 0)
            return keys;
    return NULL;
}

// Refuses keys that the table lacks, and keys that stand twice.
static enum lw_status check_names(struct reader *r, const struct lw_key *keys, const struct value *mapping)
{
    const int pairs = lw_tree_pairs(mapping->node);
    for (int i = 0; i < pairs; i++) {
        const struct value at = {mapping->tree, lw_tree_key(mapping->tree, mapping->node, i), mapping->set};
        const char *name = lw_tree_scalar(at.node);
        const size_t old = path_push(r, name ? name : "?");
        if (name == NULL || find_key(keys, name) == NULL) {
            char known[256] = "";
            for (const struct lw_key *k = keys; k->name != NULL; k++)
                snprintf(known + strlen(known), sizeof known - strlen(known), "%s%s", known[0] ? ", " : "", k->name);
            return refuse(r, &at, "unknown key; known here: %s", known);
        }
        if (lw_tree_lookup(mapping->tree, mapping->node, name) != lw_tree_value(mapping->tree, mapping->node, i))
            return refuse(r, &at, "key stands twice");
        path_pop(r, old);
    }
    return LW_OK;
}

static enum lw_status read_mapping(struct reader *r, const struct lw_key *keys, const struct value *mapping,
                                   unsigned char *out)
{
    if (mapping->node != NULL && lw_tree_pairs(mapping->node) < 0) {
        char found[96];
        lw_tree_found(mapping->node, found, sizeof found);
        return refuse(r, mapping, "expected keys with values, found %s", found);
    }
    enum lw_status status = mapping->node ? check_names(r, keys, mapping) : LW_OK;
    for (; status == LW_OK && keys->name != NULL; keys++) {
        const size_t old = path_push(r, keys->name);
        status = read_key(r, keys, mapping, out);
        if (status == LW_OK)
            path_pop(r, old);
    }
    return status;
}

// --- entry ---

static enum lw_status check_sets_used(struct reader *r)
{
    for (int i = 0; i < r->source->set_count; i++) {
        const struct value at = {.set = i};
        if (strchr(r->source->set[i], '=') == NULL)
            return refuse(r, &at, "expected KEY=VALUE, as in --set law.gamma=2");
        if (!r->set_used[i])
            return refuse(r, &at, "unknown key; `leeway keys` lists all of them");
    }
    return LW_OK;
}

static enum lw_status read_tree(struct reader *r, const struct lw_key *keys, const struct lw_tree *tree,
                                unsigned char *out)
{
    const struct value root = {tree, lw_tree_root(tree), -1};
    enum lw_status status = read_mapping(r, keys, &root, out);
    return status == LW_OK ? check_sets_used(r) : status;
}

enum lw_status lw_schema_read(const struct lw_key *keys, const struct lw_source *source, void *out, size_t size,
                              struct lw_error *error)
{
    struct lw_tree tree;
    char problem[256];
    if (!lw_tree_parse(&tree, source->text, problem, sizeof problem)) {
        snprintf(error->text, sizeof error->text, "%s%s", source->name, problem);
        return LW_E_SCENE;
    }
    // Work on a copy, so that a refused document leaves the caller's struct as it was.
    unsigned char *copy = malloc(size);
    bool *used = calloc((size_t)source->set_count + 1, sizeof *used);
    enum lw_status status = LW_E_IO;
    if (copy != NULL && used != NULL) {
        memcpy(copy, out, size);
        struct reader r = {.source = source, .set_used = used, .root = copy, .error = error};
        status = read_tree(&r, keys, &tree, copy);
    } else {
        snprintf(error->text, sizeof error->text, "%s: out of memory", source->name);
    }
    if (status == LW_OK)
        memcpy(out, copy, size);
    free(copy);
    free(used);
    lw_tree_free(&tree);
    return status;
}
