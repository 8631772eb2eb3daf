/* SPDX-License-Identifier: MIT */
/**
 * @file
 * SkipUnlessUpdated, WaitValueUpdate, WasEntryUpdated: has an entry been written since the last time?
 *
 * The parameter is a script that gives the entry's update counter. State: the counter last seen, 32 bit.
 */
#ifndef CANOPY_NODES_ENTRY_UPDATED_H
#define CANOPY_NODES_ENTRY_UPDATED_H

#include "../state.h"

static inline bool canopy_entry_is_new(canopy_tree_instance_t *self, uint16_t node)
{
    uint16_t *words = canopy_words(self, node);
    uint32_t counter = (uint32_t)canopy_run_script(self, node, 0);
    bool is_new = counter != canopy_get32(words);

    canopy_set32(words, counter);
    return is_new;
}

/** The decorators: `otherwise` is the answer when there is nothing new; a RUNNING child is ticked in any case. */
static inline canopy_step_t canopy_entry_updated_enter(canopy_tree_instance_t *self, uint16_t node,
                                                       canopy_status_t otherwise)
{
    uint16_t child = (uint16_t)(node + 1u);

    return canopy_resumes(self, child) || canopy_entry_is_new(self, node) ? child : canopy_done(otherwise);
}

static inline canopy_step_t canopy_was_entry_updated_enter(canopy_tree_instance_t *self, uint16_t node)
{
    return canopy_done(canopy_entry_is_new(self, node) ? CANOPY_SUCCESS : CANOPY_FAILURE);
}

#endif
