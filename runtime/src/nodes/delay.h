/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Delay: RUNNING until the time is over, then ticks its child until it has completed. Sleep: the same without a child.
 *
 * State: the deadline; and for Delay, whether it counts: completing and halting clear that, a SKIPPED child does not, so
 * that the delay is not waited for again before the child has had its turn.
 */
#ifndef CANOPY_NODES_DELAY_H
#define CANOPY_NODES_DELAY_H

#include "../state.h"

enum { CANOPY_DELAY_STARTED = 4 /* the word after the deadline's */ };

static inline canopy_step_t canopy_delay_enter(canopy_tree_instance_t *self, uint16_t node)
{
    uint16_t *words = canopy_words(self, node);

    if (words[CANOPY_DELAY_STARTED] == 0u) {
        canopy_start_timer(self, words, canopy_parameter(self, node, 0));
        words[CANOPY_DELAY_STARTED] = 1;
    }
    return canopy_timer_is_over(self, words) ? node + 1u : canopy_done(CANOPY_RUNNING);
}

static inline canopy_step_t canopy_delay_child(canopy_tree_instance_t *self, uint16_t node, uint16_t child,
                                               canopy_status_t status)
{
    if (status != CANOPY_RUNNING) {
        canopy_reset_child(self, child);
    }
    if (status == CANOPY_SUCCESS || status == CANOPY_FAILURE) {
        canopy_words(self, node)[CANOPY_DELAY_STARTED] = 0;
    }
    return canopy_done(status);
}

static inline void canopy_delay_halt(canopy_tree_instance_t *self, uint16_t node)
{
    canopy_words(self, node)[CANOPY_DELAY_STARTED] = 0;
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
