// SPDX-License-Identifier: BSD-3-Clause
// A thin view of libyaml's document tree: parse, look up, and say what stands where.
//
// Units    lines count from 1.
// Frames   none.
// Arrays   items and pairs count from 0.
// Memory   lw_tree_parse allocates, lw_tree_free releases; texts belong to the tree.
// Errors   NULL or -1 where a node is not what the question needs; NULL nodes are welcome everywhere.
#ifndef LW_BASE_YAML_TREE_H
#define LW_BASE_YAML_TREE_H

#include <stdbool.h> // bool
#include <stddef.h>  // size_t
#include <yaml.h>    // yaml_document_t, yaml_node_t

struct lw_tree {
    yaml_document_t document;
};

// Parses a text that is one document, at most 16 deep and of at most 20000 values. On failure: false, `problem` says
// ":LINE: why", nothing to free.
bool lw_tree_parse(struct lw_tree *tree, const char *text, char *problem, size_t size);
void lw_tree_free(struct lw_tree *tree);

// Top node, NULL when the text is empty.
const yaml_node_t *lw_tree_root(const struct lw_tree *tree);

// Line of a node; 1 for NULL.
int lw_tree_line(const yaml_node_t *node);

// Text of a scalar, else NULL.
const char *lw_tree_scalar(const yaml_node_t *node);

// Number of items of a list, else -1; and one item.
int lw_tree_length(const yaml_node_t *node);
const yaml_node_t *lw_tree_item(const struct lw_tree *tree, const yaml_node_t *node, int i);

// Number of pairs of a mapping, else -1; key and value of one pair; value of a key (the first), else NULL.
int lw_tree_pairs(const yaml_node_t *node);
const yaml_node_t *lw_tree_key(const struct lw_tree *tree, const yaml_node_t *node, int i);
const yaml_node_t *lw_tree_value(const struct lw_tree *tree, const yaml_node_t *node, int i);
const yaml_node_t *lw_tree_lookup(const struct lw_tree *tree, const yaml_node_t *node, const char *name);

// What a node is, for people: "abc", a list of 5, a mapping, nothing.
void lw_tree_found(const yaml_node_t *node, char *text, size_t size);

#endif
