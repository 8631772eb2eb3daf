/* SPDX-License-Identifier: MIT */
/**
 * @file
 * ReactiveParallel: the paper's Parallel (Algorithm 3). All N children are ticked in every tick, then counted.
 *
 * M = success_count, at least 1; a negative one counts from N + 1 down (-1: all). A SKIPPED child is taken off N.
 * SUCCESS with at least M successes; FAILURE with more than N - M failures; else RUNNING. No state.
 */
#ifndef CANOPY_NODES_REACTIVE_PARALLEL_H
#define CANOPY_NODES_REACTIVE_PARALLEL_H

#include "parallel.h"

static inline canopy_step_t canopy_reactive_parallel_enter(uint16_t node)
{
    return node + 1u;
}

/** Algorithm 3's verdict over children that have all been ticked. */
static CANOPY_SELDOM canopy_status_t canopy_reactive_parallel_verdict(const canopy_tree_instance_t *self, uint16_t node)
{
    const canopy_node_t *nodes = self->tree->nodes;
    int32_t counts[CANOPY_SKIPPED + 1] = {0};
    int32_t children = 0;
    int32_t needed;

    for (uint16_t child = (uint16_t)(node + 1u); child != nodes[node].end; child = nodes[child].end) {
        counts[canopy_status_last(self->status[child])]++;
        children++;
    }
    if (counts[CANOPY_SKIPPED] == children) {
        return CANOPY_SKIPPED;
    }
    children -= counts[CANOPY_SKIPPED];
    needed = canopy_threshold(canopy_parameter(self, node, 0), children);
    needed = needed > 1 ? needed : 1;
    if (counts[CANOPY_SUCCESS] >= needed) {
        return CANOPY_SUCCESS;
    }
    return counts[CANOPY_FAILURE] > children - needed ? CANOPY_FAILURE : CANOPY_RUNNING;
}

static CANOPY_SELDOM canopy_step_t canopy_reactive_parallel_child(canopy_tree_instance_t *self, uint16_t node,
                                                                  uint16_t child)
{
    const canopy_node_t *nodes = self->tree->nodes;
    canopy_status_t verdict;

    if (nodes[child].end != nodes[node].end) {
        return nodes[child].end;
    }
    verdict = canopy_reactive_parallel_verdict(self, node);
    return verdict == CANOPY_RUNNING ? canopy_done(CANOPY_RUNNING) : canopy_parallel_complete(self, node, verdict);
}

#endif
