/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Timeout: the clock starts with the child's first tick and is asked before each next one.
 *
 * State: the deadline, 64 bit, valid while the node is RUNNING (so a SKIPPED child stops the clock).
 */
#ifndef CANOPY_NODES_TIMEOUT_H
#define CANOPY_NODES_TIMEOUT_H

#include "../engine.h"

static inline void canopy_timeout_set_deadline(canopy_tree_instance_t *self, uint16_t node, canopy_time_t deadline)
{
    uint16_t *words = canopy_words(self, node);

    for (unsigned word = 0; word < 4u; word++) {
        words[word] = (uint16_t)((deadline >> (16u * word)) & 0xFFFFu);
    }
}

static inline canopy_time_t canopy_timeout_deadline(canopy_tree_instance_t *self, uint16_t node)
{
    const uint16_t *words = canopy_words(self, node);
    canopy_time_t deadline = 0;

    for (unsigned word = 0; word < 4u; word++) {
        deadline |= (canopy_time_t)words[word] << (16u * word);
    }
    return deadline;
}

static inline canopy_step_t canopy_timeout_enter(canopy_tree_instance_t *self, uint16_t node)
{
    uint16_t child = (uint16_t)(node + 1u);

    if (!canopy_resumes(self, node)) {
        canopy_timeout_set_deadline(self, node, self->now + ((canopy_time_t)canopy_parameter(self, node) * 1000u));
    } else if (canopy_time_reached(self->now, canopy_timeout_deadline(self, node))) {
        canopy_reset_child(self, child);
        return canopy_done(CANOPY_FAILURE);
    }
    return child;
}

static inline canopy_step_t canopy_timeout_child(canopy_tree_instance_t *self, uint16_t child, canopy_status_t status)
{
    if (status != CANOPY_RUNNING) {
        canopy_reset_child(self, child);
    }
    return canopy_done(status);
}

#endif
