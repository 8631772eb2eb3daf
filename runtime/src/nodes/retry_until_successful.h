/* SPDX-License-Identifier: MIT */
/**
 * @file
 * RetryUntilSuccessful: one attempt a tick (rule 3: a tick visits a node at most once), RUNNING between attempts.
 *
 * State: attempts that have failed, 32 bit. A SKIPPED child keeps the count; completing and halting clear it.
 */
#ifndef CANOPY_NODES_RETRY_UNTIL_SUCCESSFUL_H
#define CANOPY_NODES_RETRY_UNTIL_SUCCESSFUL_H

#include "../engine.h"

static inline void canopy_retry_set_count(canopy_tree_instance_t *self, uint16_t node, uint32_t count)
{
    uint16_t *words = canopy_words(self, node);

    words[0] = (uint16_t)(count & 0xFFFFu);
    words[1] = (uint16_t)(count >> 16);
}

static inline uint32_t canopy_retry_count(canopy_tree_instance_t *self, uint16_t node)
{
    const uint16_t *words = canopy_words(self, node);

    return (uint32_t)words[0] | ((uint32_t)words[1] << 16);
}

static inline canopy_step_t canopy_retry_enter(const canopy_tree_instance_t *self, uint16_t node)
{
    return canopy_parameter(self, node) == 0 ? canopy_done(CANOPY_FAILURE) : node + 1u;
}

static inline canopy_step_t canopy_retry_child(canopy_tree_instance_t *self, uint16_t node, uint16_t child,
                                               canopy_status_t status)
{
    int32_t most = canopy_parameter(self, node);
    uint32_t failed;

    if (status == CANOPY_RUNNING) {
        return canopy_done(CANOPY_RUNNING);
    }
    canopy_reset_child(self, child);
    if (status == CANOPY_SKIPPED) {
        return canopy_done(CANOPY_SKIPPED);
    }
    if (status == CANOPY_FAILURE && most < 0) {
        return canopy_done(CANOPY_RUNNING);
    }
    failed = canopy_retry_count(self, node) + 1u;
    if (status == CANOPY_FAILURE && failed < (uint32_t)most) {
        canopy_retry_set_count(self, node, failed);
        return canopy_done(CANOPY_RUNNING);
    }
    canopy_retry_set_count(self, node, 0u);
    return canopy_done(status);
}

static inline void canopy_retry_halt(canopy_tree_instance_t *self, uint16_t node)
{
    canopy_retry_set_count(self, node, 0u);
}

#endif
