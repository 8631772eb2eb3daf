/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Delay: RUNNING until the time is over, then ticks its child until it has completed. Sleep: the same without a child.
 *
 * State: the deadline. A delay that is over stays over while the child is RUNNING or SKIPPED, whatever time does.
 */
#ifndef CANOPY_NODES_DELAY_H
#define CANOPY_NODES_DELAY_H

#include "../state.h"

static inline canopy_step_t canopy_delay_enter(canopy_tree_instance_t *self, uint16_t node)
{
    uint16_t *words = canopy_words(self, node);
    uint16_t child = (uint16_t)(node + 1u);

    if (canopy_resumes(self, child) || canopy_status_is_skipped(self->status[node])) {
        return child;
    }
    if (!canopy_resumes(self, node)) {
        canopy_start_timer(self, words, canopy_parameter(self, node, 0));
    }
    return canopy_timer_is_over(self, words) ? child : canopy_done(CANOPY_RUNNING);
}

static inline canopy_step_t canopy_sleep_enter(canopy_tree_instance_t *self, uint16_t node)
{
    uint16_t *words = canopy_words(self, node);

    if (!canopy_resumes(self, node)) {
        canopy_start_timer(self, words, canopy_parameter(self, node, 0));
    }
    return canopy_done(canopy_timer_is_over(self, words) ? CANOPY_SUCCESS : CANOPY_RUNNING);
}

#endif
