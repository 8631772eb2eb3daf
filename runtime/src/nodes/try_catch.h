/* SPDX-License-Identifier: MIT */
/**
 * @file
 * TryCatch: all children but the last as a Sequence; when one fails, they are reset and the last child, the handler, is
 * ticked until it is done. Then the node fails, whatever the handler returned.
 *
 * Parameter: is the handler ticked, once, when the node is halted before it? Then it is a leaf, for a halt is no tick:
 * it cannot go down a tree. State: the RUNNING child, valid while the node is RUNNING.
 */
#ifndef CANOPY_NODES_TRY_CATCH_H
#define CANOPY_NODES_TRY_CATCH_H

#include "leaf.h"

static inline canopy_step_t canopy_try_catch_enter(canopy_tree_instance_t *self, uint16_t node)
{
    return canopy_resumes(self, node) ? *canopy_words(self, node) : node + 1u;
}

/** The last child. O(children). */
/*@ requires canopy_instance_is_sound(self) && node < self->tree->node_count;
    requires self->tree->nodes[node].type == CANOPY_NODE_TRY_CATCH;
    assigns \nothing;
    ensures canopy_is_child(self->tree->nodes, node, \result);
    ensures self->tree->nodes[\result].end == self->tree->nodes[node].end;
*/
static inline uint16_t canopy_try_catch_handler(const canopy_tree_instance_t *self, uint16_t node)
{
    const canopy_node_t *nodes = self->tree->nodes;
    uint16_t child = (uint16_t)(node + 1u);

    //@ assert canopy_node_is(self->tree, node);
    /*@ loop invariant canopy_walks(self->tree, node, child) && child < nodes[node].end;
        loop assigns child;
        loop variant nodes[node].end - child;
    */
    while (nodes[child].end != nodes[node].end) {
        child = nodes[child].end;
    }
    return child;
}

static CANOPY_SELDOM canopy_step_t canopy_try_catch_child(canopy_tree_instance_t *self, uint16_t node, uint16_t child,
                                                          canopy_status_t status)
{
    const canopy_node_t *nodes = self->tree->nodes;
    uint16_t first = (uint16_t)(node + 1u);
    uint16_t next = nodes[child].end;
    bool all_skipped = true;

    if (status == CANOPY_RUNNING) {
        *canopy_words(self, node) = child;
        return canopy_done(CANOPY_RUNNING);
    }
    if (next == nodes[node].end) {
        (void)canopy_reset_children(self, node, first);
        return canopy_done(CANOPY_FAILURE);
    }
    if (status == CANOPY_FAILURE) {
        (void)canopy_reset_children(self, node, first);
        return canopy_try_catch_handler(self, node);
    }
    if (nodes[next].end != nodes[node].end) {
        return next;
    }
    for (child = first; child != next; child = nodes[child].end) {
        all_skipped = all_skipped && canopy_status_is_skipped(self->status[child]);
    }
    (void)canopy_reset_children(self, node, first);
    return canopy_done(all_skipped ? CANOPY_SKIPPED : CANOPY_SUCCESS);
}

/** The other children have been halted. Calls the leaf itself: what is shared with a tick is inlined there only. */
static CANOPY_SELDOM void canopy_try_catch_halt(canopy_tree_instance_t *self, uint16_t node)
{
    uint16_t handler;
    uint16_t parameter;
    const canopy_leaf_t *leaf;
    canopy_status_t status;

    if (canopy_parameter(self, node, 0) == 0) {
        return;
    }
    handler = canopy_try_catch_handler(self, node);
    if (*canopy_words(self, node) == handler) {
        return;
    }
    leaf = canopy_leaf(self, handler);
    parameter = self->tree->nodes[handler].parameter;
    status = leaf->tick(self->application, parameter);
    if (canopy_is_simple_leaf(&self->tree->nodes[handler]) || status != CANOPY_RUNNING) {
        status = canopy_leaf_checked(self, handler, status);
    } else {
        leaf->halted(self->application, parameter);
    }
    self->status[handler] = canopy_status_reset(canopy_status_stored(status));
}

#endif
