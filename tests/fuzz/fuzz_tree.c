// SPDX-License-Identifier: BSD-3-Clause
// Fuzz target: any text as YAML, and every question that can be asked of the tree.
//
// Units    none.
// Frames   none.
// Arrays   see base/yaml_tree.h.
// Memory   the text is a block of its own, so that a read beyond its end is found.
// Errors   see fuzz.h.
#include "base/yaml_tree.h"
#include "fuzz.h"

#include <string.h> // memcpy, strlen

// Aliases make a tree that contains itself: looks end at a depth and after a number of nodes.
enum { DEPTH_MAX = 12, NODES_MAX = 4000, FOUND_BYTES = 24 };

static void look(const struct lw_tree *tree, const yaml_node_t *node, int depth, int *left);

static void look_at_children(const struct lw_tree *tree, const yaml_node_t *node, int depth, int *left)
{
    for (int i = 0; i < lw_tree_length(node); i++)
        look(tree, lw_tree_item(tree, node, i), depth, left);
    for (int i = 0; i < lw_tree_pairs(node); i++) {
        const yaml_node_t *key = lw_tree_key(tree, node, i);
        look(tree, key, depth, left);
        look(tree, lw_tree_value(tree, node, i), depth, left);
        // A key that is text is found, at its first place.
        const char *name = lw_tree_scalar(key);
        CHECK(name == NULL || lw_tree_lookup(tree, node, name) != NULL);
    }
}

static void look(const struct lw_tree *tree, const yaml_node_t *node, int depth, int *left)
{
    char found[FOUND_BYTES];
    CHECK(lw_tree_lookup(tree, node, "\n absent") == NULL);
    CHECK(node != NULL);
    if (depth == DEPTH_MAX || --*left < 0)
        return;
    const int kinds = (lw_tree_scalar(node) != NULL) + (lw_tree_length(node) >= 0) + (lw_tree_pairs(node) >= 0);
    CHECK(kinds == 1 && lw_tree_line(node) >= 1);
    lw_tree_found(node, found, sizeof found);
    CHECK(found[0] != '\0' && strlen(found) < sizeof found);
    look_at_children(tree, node, depth + 1, left);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct lw_tree tree;
    char problem[128] = "";
    char *text = malloc(size + 1);
    CHECK(text != NULL);
    if (size > 0)
        memcpy(text, data, size);
    text[size] = '\0';
    int left = NODES_MAX;
    if (lw_tree_parse(&tree, text, problem, sizeof problem)) {
        if (lw_tree_root(&tree) != NULL)
            look(&tree, lw_tree_root(&tree), 0, &left);
        lw_tree_free(&tree);
    } else {
        CHECK(problem[0] == ':' && strlen(problem) < sizeof problem);
    }
    free(text);
    return 0;
}
