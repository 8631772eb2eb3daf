/* SPDX-License-Identifier: MIT */
/**
 * @file
 * WhileDoElse: the first child is asked in every tick; the second (SUCCESS) or the third (FAILURE) is ticked, and the
 * other one, if RUNNING, halted before. No state.
 */
#ifndef CANOPY_NODES_WHILE_DO_ELSE_H
#define CANOPY_NODES_WHILE_DO_ELSE_H

#include "canopy/node.h"

static inline canopy_step_t canopy_while_do_else_enter(uint16_t node)
{
    return node + 1u;
}

static CANOPY_SELDOM canopy_step_t canopy_while_do_else_child(canopy_tree_instance_t *self, uint16_t node,
                                                              uint16_t child, canopy_status_t status)
{
    const canopy_node_t *nodes = self->tree->nodes;
    uint16_t condition = (uint16_t)(node + 1u);
    uint16_t do_branch = nodes[condition].end;
    uint16_t else_branch = nodes[do_branch].end; /* the node's end when there is none */

    if (status == CANOPY_RUNNING) {
        return canopy_done(CANOPY_RUNNING);
    }
    if (child == condition && status == CANOPY_SUCCESS) {
        if (else_branch != nodes[node].end) {
            canopy_reset_child(self, else_branch);
        }
        return do_branch;
    }
    if (child == condition && status == CANOPY_FAILURE && else_branch != nodes[node].end) {
        canopy_reset_child(self, do_branch);
        return else_branch;
    }
    (void)canopy_reset_children(self, node, condition);
    return canopy_done(status);
}

#endif
