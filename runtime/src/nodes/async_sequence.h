/* SPDX-License-Identifier: MIT */
/**
 * @file
 * AsyncSequence and AsyncFallback: as Sequence and Fallback, but a child that completes in the tick in which it was
 * started ends the tick: the node is RUNNING, and the next child's turn is in the next tick.
 *
 * State: where the next tick resumes, valid while the node is RUNNING; and the child that was RUNNING when this tick
 * came to it (0: none), whose completion does not end the tick.
 */
#ifndef CANOPY_NODES_ASYNC_SEQUENCE_H
#define CANOPY_NODES_ASYNC_SEQUENCE_H

#include "canopy/node.h"

enum { CANOPY_ASYNC_RESUME = 0, CANOPY_ASYNC_WAS_RUNNING = 1 };

static inline canopy_step_t canopy_async_sequence_enter(canopy_tree_instance_t *self, uint16_t node)
{
    uint16_t *words = canopy_words(self, node);
    uint16_t child = canopy_resumes(self, node) ? words[CANOPY_ASYNC_RESUME] : (uint16_t)(node + 1u);

    words[CANOPY_ASYNC_WAS_RUNNING] = canopy_resumes(self, child) ? child : 0u;
    return child;
}

static CANOPY_SELDOM canopy_step_t canopy_async_sequence_child(canopy_tree_instance_t *self, uint16_t node,
                                                               uint16_t child, canopy_status_t status,
                                                               canopy_status_t go_on)
{
    const canopy_node_t *nodes = self->tree->nodes;
    uint16_t *words = canopy_words(self, node);
    uint16_t next = nodes[child].end;
    uint16_t first = (uint16_t)(node + 1u);

    if (status == CANOPY_RUNNING) {
        words[CANOPY_ASYNC_RESUME] = child;
        return canopy_done(CANOPY_RUNNING);
    }
    if (status != go_on && status != CANOPY_SKIPPED) {
        (void)canopy_reset_children(self, node, first);
        return canopy_done(status);
    }
    if (next == nodes[node].end) {
        return canopy_done(canopy_reset_children(self, node, first) ? CANOPY_SKIPPED : go_on);
    }
    if (status == go_on && words[CANOPY_ASYNC_WAS_RUNNING] != child) {
        words[CANOPY_ASYNC_RESUME] = next;
        return canopy_done(CANOPY_RUNNING);
    }
    return next;
}

#endif
