/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Sequence, Fallback, ReactiveSequence, ReactiveFallback: one algorithm. Children are ticked in order while they return
 * `go_on`: SUCCESS in the Sequences, FAILURE in the Fallbacks.
 *
 * Sequence and Fallback resume at the child that was RUNNING. State: that child, valid while the node is RUNNING.
 * The reactive ones are the paper's memoryless Sequence (Algorithm 2) and Fallback (Algorithm 1): no state, every tick
 * starts at the first child, so a later child can be RUNNING from before.
 *
 * A tick spends most of its time here, so two things are done otherwise than elsewhere. A child is reset when it
 * completes, not when the node does: the node mostly completes in the same tick, and need not walk over its children
 * then. A node that stays RUNNING takes it back. And children that are simple leaves are ticked here, in a loop.
 */
#ifndef CANOPY_NODES_SEQUENCE_H
#define CANOPY_NODES_SEQUENCE_H

#include "canopy/node.h"
#include "leaf.h"

/** For what the tick's loop must not call, but is too large for the compiler to take in unasked. */
#define CANOPY_IN_LOOP inline __attribute__((always_inline))

/** Index of a node, or a canopy_step_t, in a register's width: cutting it down costs an instruction each time. */
typedef uint_fast32_t canopy_index_t;

/**
 * What a child returns for a node of this type to go on; IDLE for the other types. As long as the table's index can be,
 * so that a type that does not exist needs no test in the loop. (Words, since bytes would cost four instructions a leaf.)
 */
static const canopy_status_t canopy_sequence_statuses[UINT8_MAX + 1] = {
    [CANOPY_NODE_SEQUENCE] = CANOPY_SUCCESS,
    [CANOPY_NODE_REACTIVE_SEQUENCE] = CANOPY_SUCCESS,
    [CANOPY_NODE_FALLBACK] = CANOPY_FAILURE,
    [CANOPY_NODE_REACTIVE_FALLBACK] = CANOPY_FAILURE,
};

static inline canopy_status_t canopy_sequence_go_on(const canopy_node_t *at)
{
    return canopy_sequence_statuses[at->type];
}

static inline bool canopy_sequence_is_reactive(const canopy_node_t *at)
{
    return at->type == (uint8_t)CANOPY_NODE_REACTIVE_SEQUENCE || at->type == (uint8_t)CANOPY_NODE_REACTIVE_FALLBACK;
}

static inline void canopy_sequence_reset(canopy_tree_instance_t *self, canopy_index_t child, canopy_status_t status)
{
    self->status[child] = (uint8_t)(status + (CANOPY_STATUS_BASE + CANOPY_STATUS_WAS));
}

static inline canopy_index_t canopy_sequence_enter(const canopy_tree_instance_t *self, const canopy_node_t *at,
                                                   canopy_index_t node)
{
    bool resumes = canopy_status_runs(self->status[node]) && !canopy_sequence_is_reactive(at);

    return resumes ? self->words[at->state] : node + 1u;
}

/** The node stays RUNNING with this child. Those that completed before it in this tick are not reset after all. */
static CANOPY_SELDOM canopy_index_t canopy_sequence_running(canopy_tree_instance_t *self, canopy_index_t node,
                                                            canopy_index_t running)
{
    const canopy_node_t *nodes = self->tree->nodes;
    const canopy_node_t *at = &nodes[node];
    canopy_index_t child = canopy_sequence_enter(self, at, node);

    while (child != running) {
        self->status[child] &= (uint8_t)~CANOPY_STATUS_WAS;
        child = nodes[child].end;
    }
    if (canopy_sequence_is_reactive(at)) {
        (void)canopy_reset_children(self, (uint16_t)node, nodes[running].end);
    } else {
        self->words[at->state] = (uint16_t)running;
    }
    return canopy_done(CANOPY_RUNNING);
}

/** The node was RUNNING before this tick: children that completed in earlier ticks, or are RUNNING, have to be reset. */
static CANOPY_SELDOM void canopy_sequence_reset_all(canopy_tree_instance_t *self, canopy_index_t node)
{
    (void)canopy_reset_children(self, (uint16_t)node, (uint16_t)(node + 1u));
}

static inline canopy_index_t canopy_sequence_complete(canopy_tree_instance_t *self, canopy_index_t node,
                                                      canopy_status_t status)
{
    if (canopy_status_runs(self->status[node])) {
        canopy_sequence_reset_all(self, node);
    }
    return canopy_done(status);
}

/** The child before `next` was SKIPPED: as if it were not there, unless they all were. */
static CANOPY_SELDOM canopy_index_t canopy_sequence_skipped(canopy_tree_instance_t *self, canopy_index_t node,
                                                            canopy_index_t next)
{
    const canopy_node_t *nodes = self->tree->nodes;
    canopy_status_t status = CANOPY_SKIPPED;

    if (next != nodes[node].end) {
        return next;
    }
    for (canopy_index_t child = node + 1u; child != next; child = nodes[child].end) {
        if (!canopy_status_is_skipped((uint8_t)(self->status[child] & ~CANOPY_STATUS_WAS))) {
            status = canopy_sequence_go_on(&nodes[node]);
        }
    }
    return canopy_sequence_complete(self, node, status);
}

/** @param next the child's next sibling, or the node's end after the last one */
static CANOPY_IN_LOOP canopy_index_t canopy_sequence_child(canopy_tree_instance_t *self, const canopy_node_t *at,
                                                           canopy_index_t node, canopy_index_t child,
                                                           canopy_index_t next, canopy_status_t status,
                                                           canopy_status_t go_on)
{
    if (status == CANOPY_RUNNING) {
        return canopy_sequence_running(self, node, child);
    }
    canopy_sequence_reset(self, child, status);
    if (status == go_on && next != at->end) {
        return next;
    }
    return status == CANOPY_SKIPPED ? canopy_sequence_skipped(self, node, next)
                                    : canopy_sequence_complete(self, node, status);
}

/** A simple leaf has returned neither SUCCESS nor FAILURE. */
static CANOPY_SELDOM canopy_index_t canopy_sequence_odd_leaf(canopy_tree_instance_t *self, canopy_index_t node,
                                                             canopy_index_t leaf, canopy_status_t status)
{
    const canopy_node_t *at = &self->tree->nodes[node];

    status = canopy_leaf_checked(self, (uint16_t)leaf, status);
    return canopy_sequence_child(self, at, node, leaf, leaf + 1u, status, canopy_sequence_go_on(at));
}

/**
 * The turn of `child` has come: ticks it, and those after it, as far as they are simple leaves.
 * @param leaf   &nodes[child]
 * @param leaves the tree's
 */
static CANOPY_IN_LOOP canopy_index_t canopy_sequence_tick(canopy_tree_instance_t *self, const canopy_node_t *at,
                                                          canopy_index_t node, canopy_index_t child,
                                                          const canopy_node_t *leaf, const canopy_leaf_t *leaves,
                                                          canopy_status_t go_on)
{
    while (canopy_is_simple_leaf(leaf)) {
        canopy_status_t status = leaves[leaf->leaf].tick(self->application, leaf->parameter);

        canopy_sequence_reset(self, child, status);
        if (status != go_on) {
            return status == CANOPY_SUCCESS || status == CANOPY_FAILURE
                       ? canopy_sequence_complete(self, node, status)
                       : canopy_sequence_odd_leaf(self, node, child, status);
        }
        child++;
        leaf++;
        if (child == at->end) {
            return canopy_sequence_complete(self, node, go_on);
        }
    }
    return child;
}

#endif
