/* SPDX-License-Identifier: MIT */
/**
 * @file
 * For Frama-C's WP: what a well-formed tree is, in the words of the contracts in runtime/src. run.py has the
 * preprocessor take it in before each source, so that the sources need not.
 */
#ifndef PROOF_WP_TREE_H
#define PROOF_WP_TREE_H

#include <stddef.h>

#include "canopy/tree.h"

/* What nodes.def says of a type; that it says so is proved too, in canopy_tree_validate(). */
/*@ predicate canopy_type_is_leaf(integer type) =
        type <= CANOPY_NODE_SLEEP || type == CANOPY_NODE_WAS_ENTRY_UPDATED || type == CANOPY_NODE_TEST_NODE;
    predicate canopy_type_has_two(integer type) =
        type == CANOPY_NODE_IF_THEN_ELSE || type == CANOPY_NODE_WHILE_DO_ELSE || type == CANOPY_NODE_TRY_CATCH ||
        type == CANOPY_NODE_SWITCH;
    logic integer canopy_type_words(integer type) =
        type == CANOPY_NODE_SLEEP || type == CANOPY_NODE_PARALLEL || type == CANOPY_NODE_DELAY ||
        type == CANOPY_NODE_TIMEOUT || type == CANOPY_NODE_TEST_NODE ? 4 :
        type == CANOPY_NODE_ASYNC_SEQUENCE || type == CANOPY_NODE_ASYNC_FALLBACK || type == CANOPY_NODE_REPEAT ||
        type == CANOPY_NODE_RETRY_UNTIL_SUCCESSFUL || type == CANOPY_NODE_SKIP_UNLESS_UPDATED ||
        type == CANOPY_NODE_WAIT_VALUE_UPDATE || type == CANOPY_NODE_WAS_ENTRY_UPDATED ? 2 :
        type == CANOPY_NODE_SEQUENCE || type == CANOPY_NODE_SEQUENCE_WITH_MEMORY || type == CANOPY_NODE_FALLBACK ||
        type == CANOPY_NODE_IF_THEN_ELSE || type == CANOPY_NODE_TRY_CATCH || type == CANOPY_NODE_RUN_ONCE ||
        type == CANOPY_NODE_SWITCH ? 1 : 0;
    logic integer canopy_type_parameters(integer type) =
        type == CANOPY_NODE_ATTRIBUTES ? 8 :
        type == CANOPY_NODE_TEST_NODE ? 5 :
        type == CANOPY_NODE_PARALLEL || type == CANOPY_NODE_PRECONDITION || type == CANOPY_NODE_LOOP ? 2 :
        type == CANOPY_NODE_SLEEP || type == CANOPY_NODE_PARALLEL_ALL || type == CANOPY_NODE_REACTIVE_PARALLEL ||
        type == CANOPY_NODE_TRY_CATCH || type == CANOPY_NODE_REPEAT || type == CANOPY_NODE_RETRY_UNTIL_SUCCESSFUL ||
        type == CANOPY_NODE_DELAY || type == CANOPY_NODE_TIMEOUT || type == CANOPY_NODE_RUN_ONCE ||
        type == CANOPY_NODE_SKIP_UNLESS_UPDATED || type == CANOPY_NODE_WAIT_VALUE_UPDATE ||
        type == CANOPY_NODE_WAS_ENTRY_UPDATED || type == CANOPY_NODE_SWITCH ? 1 : 0;

    predicate canopy_shape_is(integer type, integer least, integer most, integer words, integer parameters) =
        words == canopy_type_words(type) && parameters == canopy_type_parameters(type) &&
        (canopy_type_is_leaf(type) ==> most == 0) && (!canopy_type_is_leaf(type) ==> least >= 1) &&
        (canopy_type_has_two(type) ==> least >= 2);
*/

/* Each type by its number: WP proves what is said of a constant, not of each place in a table. */
#define CANOPY_EACH_TYPE(is, and)                                                                                      \
    (is(0) and is(1) and is(2) and is(3) and is(4) and is(5) and is(6) and is(7) and is(8) and is(9) and is(10)        \
         and is(11) and is(12) and is(13) and is(14) and is(15) and is(16) and is(17) and is(18) and is(19) and is(20) \
             and is(21) and is(22) and is(23) and is(24) and is(25) and is(26) and is(27) and is(28) and is(29)        \
                 and is(30) and is(31) and is(32) and is(33) and is(34) and is(35) and is(36) and is(37))

/* The tables: each is there as long as its count says; validate() also takes NULL. */
/*@ predicate canopy_tables_readable(canopy_tree_t *tree) =
        \valid_read(tree) &&
        (tree->nodes == \null || \valid_read(tree->nodes + (0 .. tree->node_count - 1))) &&
        (tree->leaves == \null || \valid_read(tree->leaves + (0 .. tree->leaf_count - 1))) &&
        (tree->controls == \null || \valid_read(tree->controls + (0 .. tree->control_count - 1))) &&
        (tree->scripts == \null || \valid_read(tree->scripts + (0 .. tree->script_count - 1))) &&
        (tree->parameters == \null || \valid_read(tree->parameters + (0 .. tree->parameter_count - 1)));

    predicate canopy_tables_there(canopy_tree_t *tree) =
        \valid_read(tree) && 1 <= tree->node_count <= CANOPY_NODES_MAX &&
        \valid_read(tree->nodes + (0 .. tree->node_count - 1)) &&
        \valid_read(tree->leaves + (0 .. tree->leaf_count - 1)) &&
        \valid_read(tree->controls + (0 .. tree->control_count - 1)) &&
        \valid_read(tree->scripts + (0 .. tree->script_count - 1)) &&
        \valid_read(tree->parameters + (0 .. tree->parameter_count - 1));
*/

/* The node's fields, each by itself. */
/*@ predicate canopy_script_is(canopy_tree_t *tree, canopy_node_t *node, integer which, integer least) =
        least <= tree->parameters[node->parameter + which] < tree->script_count &&
        (tree->parameters[node->parameter + which] >= 0 ==>
         tree->scripts[tree->parameters[node->parameter + which]] != \null);

    predicate canopy_status_is(canopy_tree_t *tree, canopy_node_t *node, integer which) =
        CANOPY_RUNNING <= tree->parameters[node->parameter + which] <= CANOPY_SKIPPED;

    predicate canopy_asks(canopy_node_t *node, integer which) = ((node->asks >> which) & 1) != 0;

    predicate canopy_meaning_is(canopy_tree_t *tree, canopy_node_t *node) =
        (CANOPY_NODE_PRECONDITION <= node->type <= CANOPY_NODE_SWITCH ==> node->asks == 0) &&
        (node->asks != 0 ==> \forall integer which; 0 <= which < 8 && canopy_asks(node, which) ==>
                             which < canopy_type_parameters(node->type) && canopy_script_is(tree, node, which, 0)) &&
        (node->type == CANOPY_NODE_ATTRIBUTES ==>
         \forall integer which; 0 <= which < 8 ==> canopy_script_is(tree, node, which, -1)) &&
        (node->type == CANOPY_NODE_TEST_NODE ==> canopy_status_is(tree, node, 0) &&
         \forall integer which; 2 <= which < 5 ==> canopy_script_is(tree, node, which, -1)) &&
        (node->type == CANOPY_NODE_PRECONDITION || node->type == CANOPY_NODE_LOOP ==>
         canopy_script_is(tree, node, 0, 0) && canopy_status_is(tree, node, 1)) &&
        (node->type == CANOPY_NODE_SKIP_UNLESS_UPDATED || node->type == CANOPY_NODE_WAIT_VALUE_UPDATE ||
         node->type == CANOPY_NODE_WAS_ENTRY_UPDATED || node->type == CANOPY_NODE_SWITCH ==>
         canopy_script_is(tree, node, 0, 0));

    predicate canopy_functions_are(canopy_tree_t *tree, canopy_node_t *node) =
        (node->type == CANOPY_NODE_USER_CONTROL || node->type == CANOPY_NODE_USER_DECORATOR ==>
         node->leaf < tree->control_count && tree->controls[node->leaf].enter != \null &&
         tree->controls[node->leaf].child != \null) &&
        (node->type <= CANOPY_NODE_STATEFUL_ACTION ==>
         node->leaf < tree->leaf_count && tree->leaves[node->leaf].tick != \null) &&
        (node->type == CANOPY_NODE_STATEFUL_ACTION ==>
         tree->leaves[node->leaf].running != \null && tree->leaves[node->leaf].halted != \null);

    predicate canopy_fields_are(canopy_tree_t *tree, canopy_node_t *node) =
        node->type < CANOPY_NODE_TYPES &&
        (canopy_type_parameters(node->type) > 0 ==>
         node->parameter + canopy_type_parameters(node->type) <= tree->parameter_count) &&
        canopy_functions_are(tree, node) && canopy_meaning_is(tree, node);
*/

/* The tree's form. It reads 16-bit members only, so what a tick writes into status bytes leaves it alone. */
/*@ predicate canopy_place_is(canopy_node_t *nodes, integer count, integer node) =
        node < nodes[node].end <= count &&
        (node > 0 ==> nodes[node].parent < node < nodes[node].end <= nodes[nodes[node].parent].end) &&
        (node > 0 && nodes[node].end < nodes[nodes[node].parent].end ==>
         nodes[nodes[node].end].parent == nodes[node].parent) &&
        (node + 1 < nodes[node].end ==> nodes[node + 1].parent == node);

    predicate canopy_below(canopy_node_t *nodes, integer node) =
        \forall integer top; 0 <= top < node < nodes[top].end ==>
        top <= nodes[node].parent && nodes[node].end <= nodes[top].end &&
        (nodes[node].end < nodes[top].end ==> top <= nodes[nodes[node].end].parent);

    predicate canopy_nested(canopy_node_t *nodes, integer count) =
        \forall integer node; 0 <= node < count ==> canopy_below(nodes, node);

    predicate canopy_form_is(canopy_node_t *nodes, integer count) =
        nodes[0].end == count && nodes[0].parent == 0 && canopy_nested(nodes, count) &&
        \forall integer node; 0 <= node < count ==> canopy_place_is(nodes, count, node);
*/

/* What takes both: how many children, the last one of a TryCatch, words of one's own. */
/*@ predicate canopy_arity_is(canopy_node_t *nodes, integer node) =
        (canopy_type_is_leaf(nodes[node].type) ==> nodes[node].end == node + 1) &&
        (!canopy_type_is_leaf(nodes[node].type) ==> nodes[node].end > node + 1) &&
        (canopy_type_has_two(nodes[node].type) ==> nodes[node + 1].end < nodes[node].end);

    predicate canopy_handler_is(canopy_tree_t *tree, integer node) =
        tree->nodes[node].type == CANOPY_NODE_TRY_CATCH &&
        (tree->nodes[node].asks != 0 || tree->parameters[tree->nodes[node].parameter] != 0) ==>
        \exists integer last; node < last < tree->nodes[node].end && tree->nodes[last].parent == node &&
                              tree->nodes[last].end == tree->nodes[node].end &&
                              tree->nodes[last].type <= CANOPY_NODE_STATEFUL_ACTION;

    logic integer canopy_words_end(canopy_node_t *node) = node->state + canopy_type_words(node->type);

    predicate canopy_words_apart(canopy_node_t *nodes, integer count) =
        \forall integer early, late; 0 <= early < late < count &&
        canopy_type_words(nodes[early].type) > 0 && canopy_type_words(nodes[late].type) > 0 ==>
        canopy_words_end(&nodes[early]) <= nodes[late].state;

    predicate canopy_node_is(canopy_tree_t *tree, integer node) =
        canopy_fields_are(tree, &tree->nodes[node]) && canopy_arity_is(tree->nodes, node) &&
        canopy_handler_is(tree, node) &&
        (canopy_type_words(tree->nodes[node].type) > 0 ==> canopy_words_end(&tree->nodes[node]) <= tree->word_count);

    predicate canopy_well_formed(canopy_tree_t *tree) =
        canopy_tables_there(tree) && canopy_form_is(tree->nodes, tree->node_count) &&
        canopy_words_apart(tree->nodes, tree->node_count) &&
        \forall integer node; 0 <= node < tree->node_count ==> canopy_node_is(tree, node);
*/

/* For the engine's walks over children. */
/*@ predicate canopy_instance_is_sound(canopy_tree_instance_t *self) =
        \valid_read(self) && canopy_well_formed(self->tree) &&
        \valid(self->status + (0 .. self->tree->node_count - 1));

    predicate canopy_is_child(canopy_node_t *nodes, integer node, integer child) =
        node < child < nodes[node].end && nodes[child].parent == node;

    predicate canopy_is_child_or_end(canopy_node_t *nodes, integer node, integer child) =
        canopy_is_child(nodes, node, child) || child == nodes[node].end;

    predicate canopy_walks(canopy_tree_t *tree, integer node, integer child) =
        canopy_is_child_or_end(tree->nodes, node, child) && canopy_place_is(tree->nodes, tree->node_count, node) &&
        (child < tree->nodes[node].end ==> canopy_place_is(tree->nodes, tree->node_count, child));
*/

#endif
