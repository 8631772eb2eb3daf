/* SPDX-License-Identifier: MIT */
/**
 * @file
 * ParallelAll: ticks the children until every one has completed or is SKIPPED; what has completed is remembered, by its
 * status, while the node is RUNNING. No state.
 */
#ifndef CANOPY_NODES_PARALLEL_ALL_H
#define CANOPY_NODES_PARALLEL_ALL_H

#include "parallel.h"

static inline canopy_step_t canopy_parallel_all_enter(const canopy_tree_instance_t *self, uint16_t node)
{
    return canopy_resumes(self, node) ? canopy_parallel_open_child(self, node, (uint16_t)(node + 1u)) : node + 1u;
}

static CANOPY_SELDOM canopy_step_t canopy_parallel_all_child(canopy_tree_instance_t *self, uint16_t node,
                                                             uint16_t child)
{
    const canopy_node_t *nodes = self->tree->nodes;
    uint16_t next = canopy_parallel_open_child(self, node, nodes[child].end);
    int32_t counts[CANOPY_SKIPPED + 1] = {0};
    int32_t children = 0;

    if (next != nodes[node].end) {
        return next;
    }
    for (child = (uint16_t)(node + 1u); child != nodes[node].end; child = nodes[child].end) {
        counts[canopy_status_last(self->status[child])]++;
        children++;
    }
    if (counts[CANOPY_RUNNING] != 0) {
        return canopy_done(CANOPY_RUNNING);
    }
    if (canopy_reset_children(self, node, (uint16_t)(node + 1u))) {
        return canopy_done(CANOPY_SKIPPED);
    }
    return canopy_done(counts[CANOPY_FAILURE] >= canopy_threshold(canopy_parameter(self, node, 0), children)
                           ? CANOPY_FAILURE
                           : CANOPY_SUCCESS);
}

#endif
