// SPDX-License-Identifier: BSD-3-Clause
// Values of a YAML tree as a key's kind wants them: the leaves of reading by a schema.
//
// Units    none.
// Frames   none.
// Arrays   lengths as the key says.
// Memory   the tree's and the caller's.
// Errors   false: not what the key accepts; outputs may be partly written.
#ifndef LW_BASE_SCHEMA_VALUES_H
#define LW_BASE_SCHEMA_VALUES_H

#include "base/schema.h"    // struct lw_key
#include "base/yaml_tree.h" // struct lw_tree

// One number of a key: of the value itself, or of an entry of a vector, of limits (which may be off) or of a row.
bool lw_value_number(const struct lw_key *key, const yaml_node_t *node, double *out);

bool lw_value_integer(const struct lw_key *key, const yaml_node_t *node, int *out);
bool lw_value_choice(const struct lw_key *key, const yaml_node_t *node, int *out);

// A list of `length` numbers.
bool lw_value_list(const struct lw_key *key, const struct lw_tree *tree, const yaml_node_t *node, int length,
                   double *out);

// A list of key->count limits, or one limit for all of them.
bool lw_value_limits(const struct lw_key *key, const struct lw_tree *tree, const yaml_node_t *node, double *out);

// One row: a list of key->width numbers, or a plain number where that is 1.
bool lw_value_row(const struct lw_key *key, const struct lw_tree *tree, const yaml_node_t *node, double *out);

// The first entry of a list that is not a number of the key; the list itself when all are or its length is wrong.
const yaml_node_t *lw_value_wrong(const struct lw_key *key, const struct lw_tree *tree, const yaml_node_t *node,
                                  int length);

#endif
