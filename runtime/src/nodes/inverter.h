/* SPDX-License-Identifier: MIT */
/** @file Inverter: SUCCESS and FAILURE swapped, the rest passed on. */
#ifndef CANOPY_NODES_INVERTER_H
#define CANOPY_NODES_INVERTER_H

#include "../engine.h"

static inline canopy_step_t canopy_inverter_enter(uint16_t node)
{
    return node + 1u;
}

static inline canopy_step_t canopy_inverter_child(canopy_tree_instance_t *self, uint16_t child, canopy_status_t status)
{
    if (status == CANOPY_RUNNING) {
        return canopy_done(CANOPY_RUNNING);
    }
    canopy_reset_child(self, child);
    if (status == CANOPY_SKIPPED) {
        return canopy_done(CANOPY_SKIPPED);
    }
    return canopy_done(status == CANOPY_SUCCESS ? CANOPY_FAILURE : CANOPY_SUCCESS);
}

#endif
