/* SPDX-License-Identifier: MIT */
/**
 * @file
 * SequenceWithMemory: a Sequence that goes on at the child that failed or was halted.
 *
 * State: that child, 0 for the first one (the root is nobody's child). It outlives failures and halts.
 */
#ifndef CANOPY_NODES_SEQUENCE_WITH_MEMORY_H
#define CANOPY_NODES_SEQUENCE_WITH_MEMORY_H

#include "canopy/node.h"

static inline canopy_step_t canopy_sequence_with_memory_enter(canopy_tree_instance_t *self, uint16_t node)
{
    uint16_t child = *canopy_words(self, node);

    return child != 0u ? child : node + 1u;
}

static CANOPY_SELDOM canopy_step_t canopy_sequence_with_memory_child(canopy_tree_instance_t *self, uint16_t node,
                                                                     uint16_t child, canopy_status_t status)
{
    const canopy_node_t *nodes = self->tree->nodes;
    bool all_skipped;

    if (status == CANOPY_RUNNING || status == CANOPY_FAILURE) {
        *canopy_words(self, node) = child;
        if (status == CANOPY_FAILURE) {
            (void)canopy_reset_children(self, node, (uint16_t)(node + 1u));
        }
        return canopy_done(status);
    }
    if (nodes[child].end != nodes[node].end) {
        return nodes[child].end;
    }
    *canopy_words(self, node) = 0;
    all_skipped = canopy_reset_children(self, node, (uint16_t)(node + 1u));
    return canopy_done(all_skipped ? CANOPY_SKIPPED : CANOPY_SUCCESS);
}

#endif
