/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The decorators that only translate what their child returned: Inverter, ForceSuccess, ForceFailure,
 * KeepRunningUntilFailure. RUNNING and SKIPPED are passed on. No state.
 */
#ifndef CANOPY_NODES_RESULT_H
#define CANOPY_NODES_RESULT_H

#include "canopy/node.h"

static inline canopy_step_t canopy_result_enter(uint16_t node)
{
    return node + 1u;
}

/** SUCCESS becomes on_success, FAILURE becomes on_failure. */
static inline canopy_step_t canopy_result_child(canopy_tree_instance_t *self, uint16_t child, canopy_status_t status,
                                                canopy_status_t on_success, canopy_status_t on_failure)
{
    if (status == CANOPY_RUNNING) {
        return canopy_done(CANOPY_RUNNING);
    }
    canopy_reset_child(self, child);
    if (status == CANOPY_SKIPPED) {
        return canopy_done(CANOPY_SKIPPED);
    }
    return canopy_done(status == CANOPY_SUCCESS ? on_success : on_failure);
}

#endif
