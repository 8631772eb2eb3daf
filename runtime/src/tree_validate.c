/* SPDX-License-Identifier: MIT */
/** @file Examines a tree's tables, so that no tick of an accepted tree can leave them. */
#include <stddef.h>

#include "canopy/tree.h"

typedef struct {
    uint16_t least;
    uint16_t most;
    uint8_t words;
    uint8_t parameters;
} canopy_shape_t;

static const canopy_shape_t shapes[CANOPY_NODE_TYPES] = {
#define CANOPY_NODE(id, name, category, least, most, words, count, parameters, text) \
    [CANOPY_NODE_##id] = {(least), (most), (words), (count)},
#include "canopy/nodes.def"
#undef CANOPY_NODE
};

/** A leaf of the user's has all the functions that its kind needs. */
static bool functions_fit(const canopy_tree_t *tree, const canopy_node_t *node)
{
    const canopy_leaf_t *leaf;

    if (node->leaf >= tree->leaf_count) {
        return false;
    }
    leaf = &tree->leaves[node->leaf];
    if (node->type == (uint8_t)CANOPY_NODE_STATEFUL_ACTION) {
        return leaf->tick != NULL && leaf->running != NULL && leaf->halted != NULL;
    }
    return leaf->tick != NULL;
}

static bool calls_the_application(const canopy_node_t *node)
{
    return node->type == (uint8_t)CANOPY_NODE_CONDITION || node->type == (uint8_t)CANOPY_NODE_SYNC_ACTION ||
           node->type == (uint8_t)CANOPY_NODE_STATEFUL_ACTION;
}

/** The node's own fields: its state words, its parameters, its functions. */
static bool fields_fit(const canopy_tree_t *tree, const canopy_node_t *node, const canopy_shape_t *shape)
{
    return (shape->words == 0u || (uint32_t)node->state + shape->words <= tree->word_count) &&
           (shape->parameters == 0u || (uint32_t)node->parameter + shape->parameters <= tree->parameter_count) &&
           (!calls_the_application(node) || functions_fit(tree, node));
}

/** The children: each lies within the node, names it as parent, and their number suits the type. */
static bool children_fit(const canopy_tree_t *tree, uint16_t index, const canopy_shape_t *shape)
{
    const canopy_node_t *nodes = tree->nodes;
    uint16_t children = 0;
    uint16_t child = (uint16_t)(index + 1u);

    while (child < nodes[index].end) {
        if (nodes[child].parent != index || nodes[child].end <= child || nodes[child].end > nodes[index].end) {
            return false;
        }
        children++;
        child = nodes[child].end;
    }
    return children >= shape->least && children <= shape->most;
}

canopy_error_t canopy_tree_validate(const canopy_tree_t *tree, uint16_t *bad_node)
{
    if (tree == NULL || tree->nodes == NULL || tree->node_count == 0u || tree->node_count > CANOPY_NODES_MAX ||
        (tree->leaf_count != 0u && tree->leaves == NULL) ||
        (tree->parameter_count != 0u && tree->parameters == NULL)) {
        return CANOPY_ERROR_ARGUMENT;
    }
    for (uint16_t index = 0; index < tree->node_count; index++) {
        const canopy_node_t *node = &tree->nodes[index];
        bool ends_well = index == 0u ? node->parent == 0u && node->end == tree->node_count
                                     : node->end > index && node->end <= tree->node_count && node->parent < index;

        if (!ends_well || node->type >= (uint8_t)CANOPY_NODE_TYPES ||
            !fields_fit(tree, node, &shapes[node->type]) || !children_fit(tree, index, &shapes[node->type])) {
            if (bad_node != NULL) {
                *bad_node = index;
            }
            return CANOPY_ERROR_TREE;
        }
    }
    return CANOPY_OK;
}
