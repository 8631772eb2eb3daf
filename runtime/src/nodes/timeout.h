/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Timeout: the clock starts with the child's first tick and is asked before each next one.
 *
 * State: the deadline, valid while the node is RUNNING (so a SKIPPED child stops the clock).
 */
#ifndef CANOPY_NODES_TIMEOUT_H
#define CANOPY_NODES_TIMEOUT_H

#include "../state.h"

static CANOPY_SELDOM canopy_step_t canopy_timeout_enter(canopy_tree_instance_t *self, uint16_t node)
{
    uint16_t child = (uint16_t)(node + 1u);

    if (!canopy_resumes(self, node)) {
        canopy_start_timer(self, canopy_words(self, node), canopy_parameter(self, node, 0));
    } else if (canopy_timer_is_over(self, canopy_words(self, node))) {
        canopy_reset_child(self, child);
        return canopy_done(CANOPY_FAILURE);
    }
    return child;
}

#endif
