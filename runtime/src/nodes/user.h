/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Control nodes and decorators of the user's own. What they answer is checked, so that a wrong one cannot break rule 3
 * (a tick visits each node at most once): only own children, each one later than the one before. Else it is a fault, and
 * the node fails.
 */
#ifndef CANOPY_NODES_USER_H
#define CANOPY_NODES_USER_H

#include "leaf.h"

static inline const canopy_control_t *canopy_user_control(const canopy_tree_instance_t *self, uint16_t node)
{
    return &self->tree->controls[self->tree->nodes[node].leaf];
}

/** The step, if it is one that may follow `last`, the child ticked before (the node itself: none yet). */
static inline canopy_step_t canopy_user_checked(canopy_tree_instance_t *self, uint16_t node, uint16_t last,
                                                canopy_step_t step)
{
    bool good = step < CANOPY_STEP_DONE
                    ? step > last && step < self->tree->nodes[node].end && self->tree->nodes[step].parent == node
                    : step > canopy_done(CANOPY_IDLE) && step <= canopy_done(CANOPY_SKIPPED);

    if (!good) {
        step = canopy_done(canopy_leaf_fault(self, node));
    }
    if (step >= CANOPY_STEP_DONE && step != canopy_done(CANOPY_RUNNING)) {
        (void)canopy_reset_children(self, node, (uint16_t)(node + 1u));
    }
    return step;
}

static inline canopy_step_t canopy_user_enter(canopy_tree_instance_t *self, uint16_t node)
{
    return canopy_user_checked(self, node, node, canopy_user_control(self, node)->enter(self, node));
}

static CANOPY_SELDOM canopy_step_t canopy_user_child(canopy_tree_instance_t *self, uint16_t node, uint16_t child,
                                                     canopy_status_t status)
{
    return canopy_user_checked(self, node, child, canopy_user_control(self, node)->child(self, node, child, status));
}

static inline void canopy_user_halt(canopy_tree_instance_t *self, uint16_t node)
{
    const canopy_control_t *control = canopy_user_control(self, node);

    if (control->halt != NULL) {
        control->halt(self, node);
    }
}

#endif
