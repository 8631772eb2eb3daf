/* SPDX-License-Identifier: MIT */
/**
 * @file
 * RunOnce: remembers its child's first completion until the tree is reset; a halt does not forget it, SKIPPED is none.
 *
 * State: the remembered status, 0 (IDLE) for none.
 */
#ifndef CANOPY_NODES_RUN_ONCE_H
#define CANOPY_NODES_RUN_ONCE_H

#include "canopy/node.h"

static inline canopy_step_t canopy_run_once_enter(canopy_tree_instance_t *self, uint16_t node)
{
    canopy_status_t remembered = (canopy_status_t)*canopy_words(self, node);

    if (remembered == CANOPY_IDLE) {
        return node + 1u;
    }
    return canopy_done(canopy_parameter(self, node, 0) != 0 ? CANOPY_SKIPPED : remembered);
}

static inline canopy_step_t canopy_run_once_child(canopy_tree_instance_t *self, uint16_t node, uint16_t child,
                                                  canopy_status_t status)
{
    if (status != CANOPY_RUNNING) {
        canopy_reset_child(self, child);
    }
    if (status == CANOPY_SUCCESS || status == CANOPY_FAILURE) {
        *canopy_words(self, node) = (uint16_t)status;
    }
    return canopy_done(status);
}

#endif
