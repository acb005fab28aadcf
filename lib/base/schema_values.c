// SPDX-License-Identifier: BSD-3-Clause
// Numbers, choices and lists of numbers from a YAML tree.
//
// Units    none.
// Frames   none.
// Arrays   see schema_values.h.
// Memory   see schema_values.h.
// Errors   see schema_values.h.
#include "base/schema_values.h"

#include <errno.h>  // errno
#include <math.h>   // isfinite, HUGE_VAL
#include <stdlib.h> // strtod
#include <string.h> // strspn, strcmp

// A decimal number, finite: no hexadecimal, no nan, no inf, nothing behind it.
static bool parse_number(const yaml_node_t *node, double *number)
{
    const char *text = lw_tree_scalar(node);
    if (text == NULL || text[0] == '\0' || text[strspn(text, "+-.0123456789eE")] != '\0')
        return false;
    char *end = NULL;
    errno = 0;
    *number = strtod(text, &end);
    return *end == '\0' && end != text && isfinite(*number);
}

static bool in_range(const struct lw_key *key, double number)
{
    return number <= key->max && (key->above_min ? number > key->min : number >= key->min);
}

bool lw_value_number(const struct lw_key *key, const yaml_node_t *node, double *out)
{
    const char *text = lw_tree_scalar(node);
    if (key->kind == LW_LIMITS && text != NULL && strcmp(text, "off") == 0) {
        *out = HUGE_VAL;
        return true;
    }
    double number = 0;
    if (!parse_number(node, &number) || !in_range(key, number))
        return false;
    *out = number;
    return true;
}

bool lw_value_integer(const struct lw_key *key, const yaml_node_t *node, int *out)
{
    double number = 0;
    if (!lw_value_number(key, node, &number) || number != floor(number))
        return false;
    *out = (int)number;
    return true;
}

bool lw_value_choice(const struct lw_key *key, const yaml_node_t *node, int *out)
{
    const char *text = lw_tree_scalar(node);
    for (int i = 0; text != NULL && key->names[i] != NULL; i++)
        if (strcmp(text, key->names[i]) == 0) {
            *out = i;
            return true;
        }
    return false;
}

bool lw_value_list(const struct lw_key *key, const struct lw_tree *tree, const yaml_node_t *node, int length,
                   double *out)
{
    if (lw_tree_length(node) != length)
        return false;
    for (int i = 0; i < length; i++)
        if (!lw_value_number(key, lw_tree_item(tree, node, i), &out[i]))
            return false;
    return true;
}

bool lw_value_limits(const struct lw_key *key, const struct lw_tree *tree, const yaml_node_t *node, double *out)
{
    if (lw_tree_scalar(node) == NULL)
        return lw_value_list(key, tree, node, key->count, out);
    double limit = 0;
    if (!lw_value_number(key, node, &limit))
        return false;
    for (int i = 0; i < key->count; i++)
        out[i] = limit;
    return true;
}

bool lw_value_row(const struct lw_key *key, const struct lw_tree *tree, const yaml_node_t *node, double *out)
{
    return key->width == 1 ? lw_value_number(key, node, out) : lw_value_list(key, tree, node, key->width, out);
}

const yaml_node_t *lw_value_wrong(const struct lw_key *key, const struct lw_tree *tree, const yaml_node_t *node,
                                  int length)
{
    double number = 0;
    for (int i = 0; lw_tree_length(node) == length && i < length; i++)
        if (!lw_value_number(key, lw_tree_item(tree, node, i), &number))
            return lw_tree_item(tree, node, i);
    return node;
}
