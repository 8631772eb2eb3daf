/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Condition, SyncAction, StatefulAction: the calls into the application, and rule 7: a status that the kind of leaf
 * may not return counts as FAILURE and raises the fault counter; it never stops the loop.
 */
#ifndef CANOPY_NODES_LEAF_H
#define CANOPY_NODES_LEAF_H

#include "canopy/node.h"

/** Rule 7. Out of line: the tick's fast path never gets here. */
canopy_status_t canopy_leaf_fault(canopy_tree_instance_t *self, uint16_t node);

static inline const canopy_leaf_t *canopy_leaf(const canopy_tree_instance_t *self, uint16_t node)
{
    return &self->tree->leaves[self->tree->nodes[node].leaf];
}

/** Condition or SyncAction: a leaf that has no state and is never RUNNING. */
static inline bool canopy_is_simple_leaf(const canopy_node_t *node)
{
    return node->type <= (uint8_t)CANOPY_NODE_SYNC_ACTION;
}

/** Rule 7 for a Condition or SyncAction: what counts when it has returned `status`. */
static inline canopy_status_t canopy_leaf_checked(canopy_tree_instance_t *self, uint16_t node, canopy_status_t status)
{
    if ((unsigned)status - (unsigned)CANOPY_SUCCESS > (unsigned)CANOPY_SKIPPED - (unsigned)CANOPY_SUCCESS) {
        return canopy_leaf_fault(self, node);
    }
    return status;
}

/** Condition and SyncAction. */
static inline canopy_step_t canopy_leaf_enter(canopy_tree_instance_t *self, uint16_t node)
{
    canopy_status_t status = canopy_leaf(self, node)->tick(self->application, self->tree->nodes[node].parameter);

    return canopy_done(canopy_leaf_checked(self, node, status));
}

static inline canopy_step_t canopy_stateful_action_enter(canopy_tree_instance_t *self, uint16_t node)
{
    const canopy_leaf_t *leaf = canopy_leaf(self, node);
    uint16_t parameter = self->tree->nodes[node].parameter;
    canopy_status_t status = canopy_resumes(self, node) ? leaf->running(self->application, parameter)
                                                        : leaf->tick(self->application, parameter);

    if ((unsigned)status - (unsigned)CANOPY_RUNNING > (unsigned)CANOPY_SKIPPED - (unsigned)CANOPY_RUNNING) {
        status = canopy_leaf_fault(self, node);
    }
    return canopy_done(status);
}

static inline void canopy_stateful_action_halt(canopy_tree_instance_t *self, uint16_t node)
{
    canopy_leaf(self, node)->halted(self->application, self->tree->nodes[node].parameter);
}

#endif
