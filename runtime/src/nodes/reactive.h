/* SPDX-License-Identifier: MIT */
/**
 * @file
 * ReactiveSequence and ReactiveFallback: the paper's memoryless Sequence (Algorithm 2) and Fallback (Algorithm 1).
 * One algorithm, with SUCCESS and FAILURE in each other's place. No state: every tick starts at the first child.
 */
#ifndef CANOPY_NODES_REACTIVE_H
#define CANOPY_NODES_REACTIVE_H

#include "canopy/node.h"

static inline canopy_step_t canopy_reactive_enter(uint16_t node)
{
    return node + 1u;
}

static inline canopy_step_t canopy_reactive_child(canopy_tree_instance_t *self, uint16_t node, uint16_t child,
                                                  canopy_status_t status, canopy_status_t go_on)
{
    const canopy_node_t *nodes = self->tree->nodes;
    uint16_t next = nodes[child].end;
    uint16_t first = (uint16_t)(node + 1u);

    if (status == CANOPY_RUNNING) {
        /* The children before this one have completed in this tick; only a later one can be RUNNING from before. */
        (void)canopy_reset_children(self, node, next);
        return canopy_done(CANOPY_RUNNING);
    }
    if (status != go_on && status != CANOPY_SKIPPED) {
        (void)canopy_reset_children(self, node, first);
        return canopy_done(status);
    }
    if (next != nodes[node].end) {
        return next;
    }
    return canopy_done(canopy_reset_children(self, node, first) ? CANOPY_SKIPPED : go_on);
}

#endif
