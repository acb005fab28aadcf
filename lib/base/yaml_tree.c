// SPDX-License-Identifier: BSD-3-Clause
// libyaml's document tree behind a few questions.
//
// Units    none.
// Frames   none.
// Arrays   see yaml_tree.h.
// Memory   libyaml's heap.
// Errors   see yaml_tree.h.
#include "base/yaml_tree.h"

#include <stddef.h> // ptrdiff_t
#include <stdio.h>  // snprintf
#include <string.h> // strlen, strcmp

// Whether another document follows, or what follows is not YAML.
static bool has_more(yaml_parser_t *parser)
{
    yaml_document_t next;
    if (yaml_parser_load(parser, &next) == 0)
        return true;
    const bool more = yaml_document_get_root_node(&next) != NULL;
    yaml_document_delete(&next);
    return more;
}

bool lw_tree_parse(struct lw_tree *tree, const char *text, char *problem, size_t size)
{
    yaml_parser_t parser;
    if (!yaml_parser_initialize(&parser)) {
        snprintf(problem, size, ": out of memory");
        return false;
    }
    yaml_parser_set_input_string(&parser, (const unsigned char *)text, strlen(text));
    bool ok = yaml_parser_load(&parser, &tree->document) != 0;
    if (!ok) {
        snprintf(problem, size, ":%zu: not YAML: %s", parser.problem_mark.line + 1,
                 parser.problem ? parser.problem : "unreadable");
    } else if (has_more(&parser)) {
        snprintf(problem, size, ": expected one YAML document, found more behind it");
        lw_tree_free(tree);
        ok = false;
    }
    yaml_parser_delete(&parser);
    return ok;
}

void lw_tree_free(struct lw_tree *tree)
{
    yaml_document_delete(&tree->document);
}

// Node by libyaml's number, from 1; yaml_document_get_node asks for a mutable document though it only reads.
static const yaml_node_t *get_node(const struct lw_tree *tree, int index)
{
    const ptrdiff_t count = tree->document.nodes.top - tree->document.nodes.start;
    return index >= 1 && index <= count ? &tree->document.nodes.start[index - 1] : NULL;
}

const yaml_node_t *lw_tree_root(const struct lw_tree *tree)
{
    return get_node(tree, 1);
}

int lw_tree_line(const yaml_node_t *node)
{
    return node == NULL ? 1 : (int)node->start_mark.line + 1;
}

const char *lw_tree_scalar(const yaml_node_t *node)
{
    return node != NULL && node->type == YAML_SCALAR_NODE ? (const char *)node->data.scalar.value : NULL;
}

int lw_tree_length(const yaml_node_t *node)
{
    if (node == NULL || node->type != YAML_SEQUENCE_NODE)
        return -1;
    return (int)(node->data.sequence.items.top - node->data.sequence.items.start);
}

const yaml_node_t *lw_tree_item(const struct lw_tree *tree, const yaml_node_t *node, int i)
{
    return get_node(tree, node->data.sequence.items.start[i]);
}

int lw_tree_pairs(const yaml_node_t *node)
{
    if (node == NULL || node->type != YAML_MAPPING_NODE)
        return -1;
    return (int)(node->data.mapping.pairs.top - node->data.mapping.pairs.start);
}

const yaml_node_t *lw_tree_key(const struct lw_tree *tree, const yaml_node_t *node, int i)
{
    return get_node(tree, node->data.mapping.pairs.start[i].key);
}

const yaml_node_t *lw_tree_value(const struct lw_tree *tree, const yaml_node_t *node, int i)
{
    return get_node(tree, node->data.mapping.pairs.start[i].value);
}

const yaml_node_t *lw_tree_lookup(const struct lw_tree *tree, const yaml_node_t *node, const char *name)
{
    const int pairs = lw_tree_pairs(node);
    for (int i = 0; i < pairs; i++) {
        const char *key = lw_tree_scalar(lw_tree_key(tree, node, i));
        if (key != NULL && strcmp(key, name) == 0)
            return lw_tree_value(tree, node, i);
    }
    return NULL;
}

void lw_tree_found(const yaml_node_t *node, char *text, size_t size)
{
    if (node == NULL)
        snprintf(text, size, "nothing");
    else if (lw_tree_scalar(node) != NULL)
        snprintf(text, size, "\"%.60s\"", lw_tree_scalar(node));
    else if (lw_tree_length(node) >= 0)
        snprintf(text, size, "a list of %d", lw_tree_length(node));
    else
        snprintf(text, size, "a mapping");
}
