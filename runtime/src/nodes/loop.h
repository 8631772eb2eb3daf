/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Loop: ticks its child for each item of a queue, one item a tick; RUNNING between items, FAILURE when the child fails.
 *
 * Parameters: a script that takes the next item (0: the queue is empty); the status for an empty queue. No state.
 */
#ifndef CANOPY_NODES_LOOP_H
#define CANOPY_NODES_LOOP_H

#include "canopy/node.h"

enum { CANOPY_LOOP_TAKE, CANOPY_LOOP_IF_EMPTY };

static inline canopy_step_t canopy_loop_enter(canopy_tree_instance_t *self, uint16_t node)
{
    uint16_t child = (uint16_t)(node + 1u);

    if (canopy_resumes(self, child) || canopy_run_script(self, node, CANOPY_LOOP_TAKE) != 0) {
        return child;
    }
    return canopy_done((canopy_status_t)canopy_parameter(self, node, CANOPY_LOOP_IF_EMPTY));
}

static inline canopy_step_t canopy_loop_child(canopy_tree_instance_t *self, uint16_t child, canopy_status_t status)
{
    if (status != CANOPY_RUNNING) {
        canopy_reset_child(self, child);
    }
    return canopy_done(status == CANOPY_FAILURE ? CANOPY_FAILURE : CANOPY_RUNNING);
}

#endif
