/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Sequence and Fallback: one algorithm, with SUCCESS and FAILURE in each other's place.
 *
 * Children are ticked in order while they return `go_on`. A RUNNING child is where the next tick resumes.
 * State: the RUNNING child, valid while the node itself is RUNNING.
 */
#ifndef CANOPY_NODES_SEQUENCE_H
#define CANOPY_NODES_SEQUENCE_H

#include "canopy/node.h"

static inline canopy_step_t canopy_sequence_enter(canopy_tree_instance_t *self, uint16_t node)
{
    return canopy_resumes(self, node) ? *canopy_words(self, node) : node + 1u;
}

static inline canopy_step_t canopy_sequence_child(canopy_tree_instance_t *self, uint16_t node, uint16_t child,
                                                  canopy_status_t status, canopy_status_t go_on)
{
    const canopy_node_t *nodes = self->tree->nodes;
    uint16_t first = (uint16_t)(node + 1u);

    if (status == CANOPY_RUNNING) {
        *canopy_words(self, node) = child;
        return canopy_done(CANOPY_RUNNING);
    }
    if (status != go_on && status != CANOPY_SKIPPED) {
        (void)canopy_reset_children(self, node, first);
        return canopy_done(status);
    }
    if (nodes[child].end != nodes[node].end) {
        return nodes[child].end;
    }
    return canopy_done(canopy_reset_children(self, node, first) ? CANOPY_SKIPPED : go_on);
}

#endif
