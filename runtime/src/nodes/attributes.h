/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The pre- and postconditions that any node may have. Such a node stands below an Attributes node of its own, so that
 * nodes without them pay nothing. Parameters: scripts, in the order of nodes.def. No state.
 */
#ifndef CANOPY_NODES_ATTRIBUTES_H
#define CANOPY_NODES_ATTRIBUTES_H

#include "canopy/node.h"

enum {
    CANOPY_FAILURE_IF,
    CANOPY_SUCCESS_IF,
    CANOPY_SKIP_IF,
    CANOPY_WHILE,
    CANOPY_ON_SUCCESS,
    CANOPY_ON_FAILURE,
    CANOPY_POST,
    CANOPY_ON_HALTED
};

/** The node has completed: _onSuccess or _onFailure, then _post. */
static inline canopy_step_t canopy_attributes_complete(canopy_tree_instance_t *self, uint16_t node,
                                                       canopy_status_t status)
{
    (void)canopy_run_script(self, node, status == CANOPY_SUCCESS ? CANOPY_ON_SUCCESS : CANOPY_ON_FAILURE);
    (void)canopy_run_script(self, node, CANOPY_POST);
    return canopy_done(status);
}

/** False when there is a _while and it does not hold. */
static inline bool canopy_attributes_while(canopy_tree_instance_t *self, uint16_t node)
{
    return canopy_parameter(self, node, CANOPY_WHILE) < 0 || canopy_run_script(self, node, CANOPY_WHILE) != 0;
}

static inline canopy_step_t canopy_attributes_enter(canopy_tree_instance_t *self, uint16_t node)
{
    uint16_t child = (uint16_t)(node + 1u);

    if (canopy_resumes(self, child)) {
        if (canopy_attributes_while(self, node)) {
            return child;
        }
        canopy_reset_child(self, child);
        (void)canopy_run_script(self, node, CANOPY_ON_HALTED);
        return canopy_done(CANOPY_SKIPPED);
    }
    if (canopy_run_script(self, node, CANOPY_FAILURE_IF) != 0) {
        return canopy_attributes_complete(self, node, CANOPY_FAILURE);
    }
    if (canopy_run_script(self, node, CANOPY_SUCCESS_IF) != 0) {
        return canopy_attributes_complete(self, node, CANOPY_SUCCESS);
    }
    if (canopy_run_script(self, node, CANOPY_SKIP_IF) != 0 || !canopy_attributes_while(self, node)) {
        return canopy_done(CANOPY_SKIPPED);
    }
    return child;
}

static inline canopy_step_t canopy_attributes_child(canopy_tree_instance_t *self, uint16_t node, uint16_t child,
                                                    canopy_status_t status)
{
    if (status == CANOPY_RUNNING) {
        return canopy_done(CANOPY_RUNNING);
    }
    canopy_reset_child(self, child);
    return status == CANOPY_SKIPPED ? canopy_done(CANOPY_SKIPPED) : canopy_attributes_complete(self, node, status);
}

static inline void canopy_attributes_halt(canopy_tree_instance_t *self, uint16_t node)
{
    (void)canopy_run_script(self, node, CANOPY_ON_HALTED);
}

#endif
