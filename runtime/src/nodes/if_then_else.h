/* SPDX-License-Identifier: MIT */
/**
 * @file
 * IfThenElse: the first child is asked once; then the second (SUCCESS) or the third (FAILURE) is ticked until it is done.
 *
 * State: the RUNNING child, valid while the node is RUNNING.
 */
#ifndef CANOPY_NODES_IF_THEN_ELSE_H
#define CANOPY_NODES_IF_THEN_ELSE_H

#include "canopy/node.h"

static inline canopy_step_t canopy_if_then_else_enter(canopy_tree_instance_t *self, uint16_t node)
{
    return canopy_resumes(self, node) ? *canopy_words(self, node) : node + 1u;
}

static CANOPY_SELDOM canopy_step_t canopy_if_then_else_child(canopy_tree_instance_t *self, uint16_t node,
                                                             uint16_t child, canopy_status_t status)
{
    const canopy_node_t *nodes = self->tree->nodes;
    uint16_t condition = (uint16_t)(node + 1u);
    uint16_t then = nodes[condition].end;

    if (status == CANOPY_RUNNING) {
        *canopy_words(self, node) = child;
        return canopy_done(CANOPY_RUNNING);
    }
    if (child == condition && status == CANOPY_SUCCESS) {
        return then;
    }
    if (child == condition && status == CANOPY_FAILURE && nodes[then].end != nodes[node].end) {
        return nodes[then].end;
    }
    (void)canopy_reset_children(self, node, condition);
    return canopy_done(status);
}

#endif
