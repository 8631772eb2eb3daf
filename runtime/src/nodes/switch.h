/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Switch: ticks the child whose case matches; the last child when none does. A new match halts the old case.
 *
 * The parameter is a script that gives the matching child's place, 0 for the first; anything out of range is the last
 * child's. State: the RUNNING child, valid while the node is RUNNING.
 */
#ifndef CANOPY_NODES_SWITCH_H
#define CANOPY_NODES_SWITCH_H

#include "canopy/node.h"

static inline canopy_step_t canopy_switch_enter(canopy_tree_instance_t *self, uint16_t node)
{
    const canopy_node_t *nodes = self->tree->nodes;
    int32_t match = canopy_run_script(self, node, 0);
    uint16_t old = *canopy_words(self, node);
    uint16_t child = (uint16_t)(node + 1u);

    for (int32_t place = 0; place != match && nodes[child].end != nodes[node].end; place++) {
        child = nodes[child].end;
    }
    if (canopy_resumes(self, node) && old != child) {
        canopy_reset_child(self, old);
    }
    return child;
}

static CANOPY_SELDOM canopy_step_t canopy_switch_child(canopy_tree_instance_t *self, uint16_t node, uint16_t child,
                                                       canopy_status_t status)
{
    if (status == CANOPY_RUNNING) {
        *canopy_words(self, node) = child;
    } else {
        canopy_reset_child(self, child);
    }
    return canopy_done(status);
}

#endif
