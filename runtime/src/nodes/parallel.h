/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Parallel: ticks the children that have not completed; what has completed is remembered, by its status, while the node
 * is RUNNING. The thresholds are tested after each child; only when neither is met can all children be SKIPPED, and with
 * a negative success_count, for which they count as successes, never.
 *
 * State: successes and failures so far; children SKIPPED in this tick; how many children there are.
 */
#ifndef CANOPY_NODES_PARALLEL_H
#define CANOPY_NODES_PARALLEL_H

#include "canopy/node.h"

enum {
    CANOPY_PARALLEL_SUCCESSES = 0,
    CANOPY_PARALLEL_FAILURES = 1,
    CANOPY_PARALLEL_SKIPPED = 2,
    CANOPY_PARALLEL_CHILDREN = 3
};

/** The first child from `child` on that has not completed, or the node's end. */
/*@ requires canopy_instance_is_sound(self) && node < self->tree->node_count;
    requires canopy_is_child_or_end(self->tree->nodes, node, child);
    assigns \nothing;
    ensures canopy_is_child_or_end(self->tree->nodes, node, \result) && child <= \result;
*/
static inline uint16_t canopy_parallel_open_child(const canopy_tree_instance_t *self, uint16_t node, uint16_t child)
{
    const canopy_node_t *nodes = self->tree->nodes;

    /*@ loop invariant canopy_walks(self->tree, node, child) && \at(child, Pre) <= child;
        loop assigns child;
        loop variant nodes[node].end - child;
    */
    while (child != nodes[node].end && canopy_status_is_completed(self->status[child])) {
        child = nodes[child].end;
    }
    return child;
}

static inline canopy_step_t canopy_parallel_enter(canopy_tree_instance_t *self, uint16_t node)
{
    uint16_t *words = canopy_words(self, node);

    words[CANOPY_PARALLEL_SKIPPED] = 0;
    if (!canopy_resumes(self, node)) {
        words[CANOPY_PARALLEL_SUCCESSES] = 0;
        words[CANOPY_PARALLEL_FAILURES] = 0;
        words[CANOPY_PARALLEL_CHILDREN] = canopy_count_children(self, node);
        return node + 1u;
    }
    return canopy_parallel_open_child(self, node, (uint16_t)(node + 1u));
}

/** The node is done. A function of its own, called last: the frame of its caller is gone while children are halted. */
static CANOPY_SELDOM canopy_step_t canopy_parallel_complete(canopy_tree_instance_t *self, uint16_t node,
                                                            canopy_status_t status)
{
    (void)canopy_reset_children(self, node, (uint16_t)(node + 1u));
    return canopy_done(status);
}

/** RUNNING while neither threshold is met. */
static CANOPY_SELDOM canopy_status_t canopy_parallel_verdict(canopy_tree_instance_t *self, uint16_t node)
{
    const uint16_t *words = canopy_words(self, node);
    int32_t children = words[CANOPY_PARALLEL_CHILDREN];
    int32_t wanted = canopy_parameter(self, node, 0);
    int32_t successes_needed = canopy_threshold(wanted, children);
    int32_t failures_needed = canopy_threshold(canopy_parameter(self, node, 1), children);
    int32_t successes = words[CANOPY_PARALLEL_SUCCESSES];
    int32_t failures = words[CANOPY_PARALLEL_FAILURES];

    if (successes + (wanted < 0 ? words[CANOPY_PARALLEL_SKIPPED] : 0) >= successes_needed) {
        return CANOPY_SUCCESS;
    }
    return failures >= failures_needed || children - failures < successes_needed ? CANOPY_FAILURE : CANOPY_RUNNING;
}

static CANOPY_SELDOM canopy_step_t canopy_parallel_child(canopy_tree_instance_t *self, uint16_t node, uint16_t child,
                                                         canopy_status_t status)
{
    const canopy_node_t *nodes = self->tree->nodes;
    uint16_t *words = canopy_words(self, node);
    canopy_status_t verdict;
    uint16_t next;

    if (status == CANOPY_SUCCESS) {
        words[CANOPY_PARALLEL_SUCCESSES]++;
    } else if (status == CANOPY_FAILURE) {
        words[CANOPY_PARALLEL_FAILURES]++;
    } else if (status == CANOPY_SKIPPED) {
        words[CANOPY_PARALLEL_SKIPPED]++;
    }
    verdict = canopy_parallel_verdict(self, node);
    next = canopy_parallel_open_child(self, node, nodes[child].end);
    if (verdict == CANOPY_RUNNING && next != nodes[node].end) {
        return next;
    }
    if (verdict == CANOPY_RUNNING && words[CANOPY_PARALLEL_SKIPPED] != words[CANOPY_PARALLEL_CHILDREN]) {
        return canopy_done(CANOPY_RUNNING);
    }
    if (verdict == CANOPY_RUNNING) {
        verdict = CANOPY_SKIPPED;
    }
    return canopy_parallel_complete(self, node, verdict);
}

#endif
