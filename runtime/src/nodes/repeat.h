/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Repeat and RetryUntilSuccessful: one algorithm, with SUCCESS and FAILURE in each other's place. One cycle a tick (rule
 * 3: a tick visits a node at most once), RUNNING between cycles.
 *
 * A child that returns `again` is ticked again, `most` times in all (-1: for ever, 0: not at all); the other result ends
 * it. State: cycles done, 32 bit; it counts on while the node goes on, through a SKIPPED child too.
 */
#ifndef CANOPY_NODES_REPEAT_H
#define CANOPY_NODES_REPEAT_H

#include "../state.h"

static inline canopy_step_t canopy_repeat_enter(canopy_tree_instance_t *self, uint16_t node, canopy_status_t again)
{
    if (!canopy_goes_on(self, node)) {
        canopy_set32(canopy_words(self, node), 0u);
    }
    if (canopy_parameter(self, node, 0) != 0) {
        return node + 1u;
    }
    if (canopy_resumes(self, node)) { /* an entry gives the number, and has become 0 while the child runs */
        canopy_reset_child(self, (uint16_t)(node + 1u));
    }
    return canopy_done(again);
}

static inline canopy_step_t canopy_repeat_child(canopy_tree_instance_t *self, uint16_t node, uint16_t child,
                                                canopy_status_t status, canopy_status_t again)
{
    int32_t most = canopy_parameter(self, node, 0);
    uint32_t cycles;

    if (status == CANOPY_RUNNING) {
        return canopy_done(CANOPY_RUNNING);
    }
    canopy_reset_child(self, child);
    if (status == CANOPY_SKIPPED) {
        return canopy_done(CANOPY_SKIPPED);
    }
    if (status == again && most < 0) {
        return canopy_done(CANOPY_RUNNING);
    }
    cycles = canopy_get32(canopy_words(self, node)) + 1u;
    if (status == again && cycles < (uint32_t)most) {
        canopy_set32(canopy_words(self, node), cycles);
        return canopy_done(CANOPY_RUNNING);
    }
    return canopy_done(status);
}

#endif
