/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Precondition: the script `if` is asked while the child is not RUNNING; where it is false, the status `else` is the
 * answer. No state.
 */
#ifndef CANOPY_NODES_PRECONDITION_H
#define CANOPY_NODES_PRECONDITION_H

#include "canopy/node.h"

enum { CANOPY_PRECONDITION_IF, CANOPY_PRECONDITION_ELSE };

static inline canopy_step_t canopy_precondition_enter(canopy_tree_instance_t *self, uint16_t node)
{
    uint16_t child = (uint16_t)(node + 1u);

    if (canopy_resumes(self, child) || canopy_run_script(self, node, CANOPY_PRECONDITION_IF) != 0) {
        return child;
    }
    return canopy_done((canopy_status_t)canopy_parameter(self, node, CANOPY_PRECONDITION_ELSE));
}

#endif
