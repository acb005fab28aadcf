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

// libyaml's time grows with the square of the depth, and of the number of anchors: no text of ours needs more.
enum { DEPTH_MAX = 16, NODES_MAX = 20000 };

// --- parse ---

struct shape {
    int depth, nodes, documents;
};

static void count(struct shape *shape, yaml_event_type_t type)
{
    const bool opens = type == YAML_SEQUENCE_START_EVENT || type == YAML_MAPPING_START_EVENT;
    const bool closes = type == YAML_SEQUENCE_END_EVENT || type == YAML_MAPPING_END_EVENT;
    shape->depth += opens - closes;
    shape->nodes += opens || type == YAML_SCALAR_EVENT || type == YAML_ALIAS_EVENT;
    shape->documents += type == YAML_DOCUMENT_START_EVENT;
}

// What is wrong with a shape, or NULL.
static const char *find_excess(const struct shape *shape)
{
    if (shape->documents > 1)
        return "expected one YAML document, found more behind it";
    if (shape->depth > DEPTH_MAX)
        return "expected lists and mappings at most 16 deep";
    return shape->nodes > NODES_MAX ? "expected at most 20000 values" : NULL;
}

static bool start(yaml_parser_t *parser, const char *text, char *problem, size_t size)
{
    if (!yaml_parser_initialize(parser)) {
        snprintf(problem, size, ": out of memory");
        return false;
    }
    yaml_parser_set_input_string(parser, (const unsigned char *)text, strlen(text));
    return true;
}

static bool refuse(const yaml_parser_t *parser, char *problem, size_t size)
{
    snprintf(problem, size, ":%zu: not YAML: %s", parser->problem_mark.line + 1,
             parser->problem ? parser->problem : "unreadable");
    return false;
}

// Goes through the whole text before a tree is made of it.
static bool check_shape(yaml_parser_t *parser, char *problem, size_t size)
{
    struct shape shape = {0};
    const char *excess = NULL;
    for (bool ended = false; !ended && excess == NULL;) {
        yaml_event_t event;
        if (yaml_parser_parse(parser, &event) == 0)
            return refuse(parser, problem, size);
        count(&shape, event.type);
        excess = find_excess(&shape);
        if (excess != NULL)
            snprintf(problem, size, ":%zu: %s", event.start_mark.line + 1, excess);
        ended = event.type == YAML_STREAM_END_EVENT;
        yaml_event_delete(&event);
    }
    return excess == NULL;
}

bool lw_tree_parse(struct lw_tree *tree, const char *text, char *problem, size_t size)
{
    yaml_parser_t parser;
    if (!start(&parser, text, problem, size))
        return false;
    bool ok = check_shape(&parser, problem, size);
    yaml_parser_delete(&parser);
    if (!ok || !start(&parser, text, problem, size))
        return false;
    ok = yaml_parser_load(&parser, &tree->document) != 0 || refuse(&parser, problem, size);
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
