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

/*@ predicate canopy_shapes_fit =
        \valid_read(&shapes[0 .. CANOPY_NODE_TYPES - 1]) && \forall integer type; 0 <= type < CANOPY_NODE_TYPES ==>
        canopy_shape_is(type, shapes[type].least, shapes[type].most, shapes[type].words, shapes[type].parameters);
*/

/*
 * The comments that begin with an at sign are contracts in ACSL, which Frama-C's WP proves (docs/verification.md); the
 * words in them are explained in tests/proof/wp_tree.h.
 */

/** Is parameter `which` of the node a script, or none where that is allowed? */
/*@ requires canopy_tables_there(tree) && \valid_read(node);
    requires node->parameter + which < tree->parameter_count;
    assigns \nothing;
    ensures \result == true ==> canopy_script_is(tree, node, which, least);
*/
static bool script_fits(const canopy_tree_t *tree, const canopy_node_t *node, unsigned which, int32_t least)
{
    int32_t script = tree->parameters[node->parameter + which];

    return script >= least && script < (int32_t)tree->script_count && (script < 0 || tree->scripts[script] != NULL);
}

/** Is parameter `which` of the node a status that a node can return? */
/*@ requires canopy_tables_there(tree) && \valid_read(node);
    requires node->parameter + which < tree->parameter_count;
    assigns \nothing;
    ensures \result == true ==> canopy_status_is(tree, node, which);
*/
static bool status_fits(const canopy_tree_t *tree, const canopy_node_t *node, unsigned which)
{
    int32_t status = tree->parameters[node->parameter + which];

    return status > (int32_t)CANOPY_IDLE && status <= (int32_t)CANOPY_SKIPPED;
}

/** All parameters of the node from `first` on are scripts, or none. */
/*@ requires canopy_tables_there(tree) && \valid_read(node);
    requires node->type < CANOPY_NODE_TYPES;
    requires node->parameter + shapes[node->type].parameters <= tree->parameter_count;
    assigns \nothing;
    ensures \result == true ==> \forall integer which; first <= which < shapes[node->type].parameters ==>
            canopy_script_is(tree, node, which, -1);
*/
static bool scripts_fit(const canopy_tree_t *tree, const canopy_node_t *node, unsigned first)
{
    /*@ loop invariant first <= which;
        loop invariant \forall integer checked; first <= checked < which ==>
                       canopy_script_is(tree, node, checked, -1);
        loop assigns which;
        loop variant shapes[node->type].parameters - which;
    */
    for (unsigned which = first; which < shapes[node->type].parameters; which++) {
        if (!script_fits(tree, node, which, -1)) {
            return false;
        }
    }
    return true;
}

/** Parameters that a script gives: the script is there. */
/*@ requires canopy_tables_there(tree) && \valid_read(node);
    requires node->type < CANOPY_NODE_TYPES;
    requires shapes[node->type].parameters > 0 ==>
             node->parameter + shapes[node->type].parameters <= tree->parameter_count;
    assigns \nothing;
    ensures \result == true ==> \forall integer which; 0 <= which < 8 && canopy_asks(node, which) ==>
            which < shapes[node->type].parameters && canopy_script_is(tree, node, which, 0);
*/
static bool asked_fit(const canopy_tree_t *tree, const canopy_node_t *node)
{
    /*@ loop invariant 0 <= which <= 8;
        loop invariant \forall integer checked; 0 <= checked < which && canopy_asks(node, checked) ==>
                       checked < shapes[node->type].parameters && canopy_script_is(tree, node, checked, 0);
        loop assigns which;
        loop variant 8 - which;
    */
    for (unsigned which = 0; which < 8u; which++) {
        if (((node->asks >> which) & 1u) != 0u &&
            (which >= shapes[node->type].parameters || !script_fits(tree, node, which, 0))) {
            return false;
        }
    }
    return true;
}

/** Is the type one whose parameters are scripts and statuses themselves? */
/*@ assigns \nothing;
    ensures \result == true <==> CANOPY_NODE_PRECONDITION <= type <= CANOPY_NODE_SWITCH;
*/
static bool is_scripted(uint8_t type)
{
    return type >= (uint8_t)CANOPY_NODE_PRECONDITION && type <= (uint8_t)CANOPY_NODE_SWITCH;
}

/** Parameters that name scripts and statuses; the parameters themselves are known to be there. */
/*@ requires canopy_tables_there(tree) && \valid_read(node);
    requires node->type < CANOPY_NODE_TYPES && canopy_shapes_fit;
    requires canopy_type_parameters(node->type) > 0 ==>
             node->parameter + canopy_type_parameters(node->type) <= tree->parameter_count;
    assigns \nothing;
    ensures \result == true ==> canopy_meaning_is(tree, node);
*/
static bool meaning_fits(const canopy_tree_t *tree, const canopy_node_t *node)
{
    const uint8_t type = node->type;

    if (node->asks != 0u && (is_scripted(type) || !asked_fit(tree, node))) {
        return false;
    }

    if (type == (uint8_t)CANOPY_NODE_ATTRIBUTES) {
        return scripts_fit(tree, node, 0);
    }
    if (type == (uint8_t)CANOPY_NODE_TEST_NODE) {
        return status_fits(tree, node, 0) && scripts_fit(tree, node, 2);
    }
    if (type == (uint8_t)CANOPY_NODE_PRECONDITION || type == (uint8_t)CANOPY_NODE_LOOP) {
        return script_fits(tree, node, 0, 0) && status_fits(tree, node, 1);
    }
    if (type == (uint8_t)CANOPY_NODE_SKIP_UNLESS_UPDATED || type == (uint8_t)CANOPY_NODE_WAIT_VALUE_UPDATE ||
        type == (uint8_t)CANOPY_NODE_WAS_ENTRY_UPDATED || type == (uint8_t)CANOPY_NODE_SWITCH) {
        return script_fits(tree, node, 0, 0);
    }
    return true;
}

/** A node of the user's own has the functions that its kind needs. */
/*@ requires canopy_tables_there(tree) && \valid_read(node);
    assigns \nothing;
    ensures \result == true ==> canopy_functions_are(tree, node);
*/
static bool functions_fit(const canopy_tree_t *tree, const canopy_node_t *node)
{
    const uint8_t type = node->type;

    if (type == (uint8_t)CANOPY_NODE_USER_CONTROL || type == (uint8_t)CANOPY_NODE_USER_DECORATOR) {
        const canopy_control_t *control = node->leaf < tree->control_count ? &tree->controls[node->leaf] : NULL;

        return control != NULL && control->enter != NULL && control->child != NULL;
    }
    if (type == (uint8_t)CANOPY_NODE_CONDITION || type == (uint8_t)CANOPY_NODE_SYNC_ACTION ||
        type == (uint8_t)CANOPY_NODE_STATEFUL_ACTION) {
        const canopy_leaf_t *leaf = node->leaf < tree->leaf_count ? &tree->leaves[node->leaf] : NULL;

        return leaf != NULL && leaf->tick != NULL &&
               (type != (uint8_t)CANOPY_NODE_STATEFUL_ACTION || (leaf->running != NULL && leaf->halted != NULL));
    }
    return true;
}

/**
 * The node's own state words: after those of the nodes before it. Shared words would be the one way to make a node
 * resume at what is not its child.
 */
/*@ requires \valid_read(tree) && \valid_read(node) && \valid(words_end);
    requires node->type < CANOPY_NODE_TYPES && canopy_shapes_fit;
    assigns *words_end;
    ensures \result == true && canopy_type_words(node->type) == 0 ==> *words_end == \old(*words_end);
    ensures \result == true && canopy_type_words(node->type) > 0 ==> \old(*words_end) <= node->state &&
            *words_end == canopy_words_end(node) <= tree->word_count;
*/
static bool words_fit(const canopy_tree_t *tree, const canopy_node_t *node, uint32_t *words_end)
{
    const uint8_t words = shapes[node->type].words;

    if (words == 0u) {
        return true;
    }
    if (node->state < *words_end || (uint32_t)node->state + words > tree->word_count) {
        return false;
    }
    *words_end = (uint32_t)node->state + words;
    return true;
}

/** The node's own fields: its parameters, its functions. */
/*@ requires canopy_tables_there(tree) && \valid_read(node);
    requires node->type < CANOPY_NODE_TYPES && canopy_shapes_fit && shape == &shapes[node->type];
    assigns \nothing;
    ensures \result == true ==> canopy_fields_are(tree, node);
*/
static bool fields_fit(const canopy_tree_t *tree, const canopy_node_t *node, const canopy_shape_t *shape)
{
    return (shape->parameters == 0u || (uint32_t)node->parameter + shape->parameters <= tree->parameter_count) &&
           functions_fit(tree, node) && meaning_fits(tree, node);
}

/** The children: each lies within the node, names it as parent, and their number suits the type. */
/*@ requires canopy_tables_there(tree) && index < tree->nodes[index].end <= tree->node_count;
    requires tree->nodes[index].type < CANOPY_NODE_TYPES && canopy_shapes_fit;
    requires shape == &shapes[tree->nodes[index].type];
    assigns \nothing;
    ensures \result == true ==> canopy_chain(tree->nodes, index, index + 1) && canopy_arity_is(tree->nodes, index);
*/
static bool children_fit(const canopy_tree_t *tree, uint16_t index, const canopy_shape_t *shape)
{
    const canopy_node_t *nodes = tree->nodes;
    uint16_t children = 0;
    uint16_t child = (uint16_t)(index + 1u);

    /*@ loop invariant index < child <= nodes[index].end && children < child - index;
        loop invariant canopy_chain(nodes, index, child) ==> canopy_chain(nodes, index, index + 1);
        loop invariant children == 0 <==> child == index + 1;
        loop invariant children >= 1 ==> index + 1 < nodes[index].end && nodes[index + 1].end <= child;
        loop invariant children == 1 ==> nodes[index + 1].end == child;
        loop invariant children >= 2 ==> nodes[index + 1].end < nodes[index].end;
        loop assigns child, children;
        loop variant nodes[index].end - child;
    */
    while (child < nodes[index].end) {
        if (nodes[child].parent != index || nodes[child].end <= child || nodes[child].end > nodes[index].end) {
            return false;
        }
        children++;
        child = nodes[child].end;
    }
    return children >= shape->least && children <= shape->most;
}

/** The last child of a TryCatch that ticks it when it is halted is a leaf with functions. */
/*@ requires canopy_tables_there(tree) && index < tree->nodes[index].end <= tree->node_count;
    requires canopy_fields_are(tree, &tree->nodes[index]) && canopy_arity_is(tree->nodes, index);
    requires canopy_chain(tree->nodes, index, index + 1);
    assigns \nothing;
    ensures \result == true ==> canopy_handler_is(tree, index);
*/
static bool handler_fits(const canopy_tree_t *tree, uint16_t index)
{
    const canopy_node_t *node = &tree->nodes[index];
    uint16_t handler = (uint16_t)(index + 1u);

    if (node->type != (uint8_t)CANOPY_NODE_TRY_CATCH || (node->asks == 0u && tree->parameters[node->parameter] == 0)) {
        return true;
    }
    /*@ loop invariant canopy_chain(tree->nodes, index, handler);
        loop invariant index < handler < node->end;
        loop assigns handler;
        loop variant node->end - handler;
    */
    while (tree->nodes[handler].end != node->end) {
        handler = tree->nodes[handler].end;
    }
    return tree->nodes[handler].type <= (uint8_t)CANOPY_NODE_STATEFUL_ACTION;
}

/*@ requires tree == \null || canopy_tables_readable(tree);
    requires bad_node == \null || \valid(bad_node);
    requires canopy_shapes_fit;
    assigns *bad_node;
    ensures \result == CANOPY_OK ==> canopy_well_formed(tree) && *bad_node == \old(*bad_node);
*/
canopy_error_t canopy_tree_validate(const canopy_tree_t *tree, uint16_t *bad_node)
{
    uint32_t words_end = 0;

    if (tree == NULL || tree->nodes == NULL || tree->node_count == 0u || tree->node_count > CANOPY_NODES_MAX ||
        (tree->leaf_count != 0u && tree->leaves == NULL) || (tree->control_count != 0u && tree->controls == NULL) ||
        (tree->script_count != 0u && tree->scripts == NULL) ||
        (tree->parameter_count != 0u && tree->parameters == NULL)) {
        return CANOPY_ERROR_ARGUMENT;
    }
    /*@ loop invariant 0 <= index <= tree->node_count;
        loop invariant \forall integer node; 0 <= node < index ==> canopy_node_is(tree, node);
        loop invariant canopy_linked_to(tree->nodes, tree->node_count, index);
        loop invariant canopy_nested(tree->nodes, index);
        loop invariant words_end <= tree->word_count;
        loop invariant \forall integer node; 0 <= node < index && canopy_type_words(tree->nodes[node].type) > 0 ==>
                       canopy_words_end(&tree->nodes[node]) <= words_end;
        loop invariant canopy_words_apart(tree->nodes, index);
        loop assigns index, words_end;
        loop variant tree->node_count - index;
    */
    for (uint16_t index = 0; index < tree->node_count; index++) {
        const canopy_node_t *node = &tree->nodes[index];

        //@ assert index > 0 ==> canopy_linked(tree->nodes, tree->node_count, index - 1);
        //@ assert index > 0 ==> canopy_hangs(tree->nodes, tree->node_count, index);
        /* Only the root's place is looked at here: every later node is a child of one that children_fit() accepted. */
        if ((index == 0u && (node->parent != 0u || node->end != tree->node_count)) ||
            node->type >= (uint8_t)CANOPY_NODE_TYPES || !words_fit(tree, node, &words_end) ||
            !fields_fit(tree, node, &shapes[node->type]) || !children_fit(tree, index, &shapes[node->type]) ||
            !handler_fits(tree, index)) {
            if (bad_node != NULL) {
                *bad_node = index;
            }
            return CANOPY_ERROR_TREE;
        }
        //@ assert index > 0 ==> canopy_linked(tree->nodes, tree->node_count, tree->nodes[index].parent);
        //@ assert canopy_linked(tree->nodes, tree->node_count, index);
        //@ assert index > 0 ==> canopy_below(tree->nodes, index - 1);
        //@ assert index > 0 ==> canopy_under(tree->nodes, index);
        //@ assert index > 0 ==> canopy_below(tree->nodes, tree->nodes[index].parent);
        //@ assert canopy_below(tree->nodes, index);
    }
    //@ assert canopy_form_is(tree->nodes, tree->node_count);
    return CANOPY_OK;
}
