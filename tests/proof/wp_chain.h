/* SPDX-License-Identifier: MIT */
/**
 * @file
 * For Frama-C's WP: what the validator knows when it has examined a part of the table, and the steps from there to a
 * tree's form.
 */
#ifndef PROOF_WP_CHAIN_H
#define PROOF_WP_CHAIN_H

#include "wp_tree.h"

/*@ // From `child` on, each child of `node` lies within it and names it as parent, up to its end.
    inductive canopy_chain{L}(canopy_node_t *nodes, integer node, integer child) {
        case end{L}: \forall canopy_node_t *nodes, integer node; canopy_chain(nodes, node, nodes[node].end);
        case link{L}: \forall canopy_node_t *nodes, integer node, child;
            node < child < nodes[node].end && nodes[child].parent == node &&
            child < nodes[child].end <= nodes[node].end && canopy_chain(nodes, node, nodes[child].end) ==>
            canopy_chain(nodes, node, child);
    }

    // A node in the chain of its parent.
    predicate canopy_hangs(canopy_node_t *nodes, integer count, integer node) =
        0 <= nodes[node].parent < node < nodes[node].end <= nodes[nodes[node].parent].end <= count &&
        (nodes[node].end < nodes[nodes[node].parent].end ==>
         nodes[nodes[node].end].parent == nodes[node].parent) &&
        canopy_chain(nodes, nodes[node].parent, nodes[node].end);

    // What is known of a node that has been examined; its end, where it is a node, hangs from one that has been, too.
    predicate canopy_linked(canopy_node_t *nodes, integer count, integer node) =
        node < nodes[node].end <= count && canopy_chain(nodes, node, node + 1) &&
        (node == 0 ==> nodes[node].parent == 0 && nodes[node].end == count) &&
        (node > 0 ==> canopy_hangs(nodes, count, node)) &&
        (nodes[node].end < count ==> canopy_hangs(nodes, count, nodes[node].end));

    predicate canopy_linked_to(canopy_node_t *nodes, integer count, integer examined) =
        \forall integer node; 0 <= node < examined ==> canopy_linked(nodes, count, node) &&
        (nodes[node].end < count ==> nodes[nodes[node].end].parent < examined);

    predicate canopy_under(canopy_node_t *nodes, integer node) =
        \forall integer top; 0 <= top < node < nodes[top].end ==> top <= nodes[node].parent;

    lemma first_hangs: \forall canopy_node_t *nodes, integer count, node;
        0 <= node && node + 1 < nodes[node].end <= count && canopy_chain(nodes, node, node + 1) ==>
        canopy_hangs(nodes, count, node + 1);
    lemma next_hangs: \forall canopy_node_t *nodes, integer count, node;
        canopy_hangs(nodes, count, node) && nodes[node].end < nodes[nodes[node].parent].end ==>
        canopy_hangs(nodes, count, nodes[node].end);
    lemma linked_hangs: \forall canopy_node_t *nodes, integer count, node;
        0 <= node && node + 1 < count && canopy_linked(nodes, count, node) ==> canopy_hangs(nodes, count, node + 1);
    lemma hangs_linked: \forall canopy_node_t *nodes, integer count, node;
        0 < node < count && canopy_hangs(nodes, count, node) && canopy_linked(nodes, count, nodes[node].parent) &&
        canopy_chain(nodes, node, node + 1) ==> canopy_linked(nodes, count, node);
    lemma hangs_under: \forall canopy_node_t *nodes, integer count, before, node;
        0 <= before == node - 1 && canopy_linked(nodes, count, before) && canopy_hangs(nodes, count, node) &&
        canopy_below(nodes, before) ==> canopy_under(nodes, node);
    lemma hangs_below: \forall canopy_node_t *nodes, integer count, node;
        canopy_hangs(nodes, count, node) && canopy_under(nodes, node) && canopy_below(nodes, nodes[node].parent) ==>
        canopy_below(nodes, node);
    lemma one_more_nested: \forall canopy_node_t *nodes, integer node;
        canopy_nested(nodes, node) && canopy_below(nodes, node) ==> canopy_nested(nodes, node + 1);
    lemma linked_in_place: \forall canopy_node_t *nodes, integer count, node;
        0 <= node && canopy_linked(nodes, count, node) ==> canopy_place_is(nodes, count, node);
*/

#endif
