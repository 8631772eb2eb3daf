/* SPDX-License-Identifier: MIT */
/**
 * @file
 * TestNode: stands in for a leaf that is not written yet. RUNNING until its time is over, then a status, and scripts.
 *
 * Parameters: the status, the time in ms, scripts for SUCCESS, for FAILURE, and for any end. State: the deadline.
 */
#ifndef CANOPY_NODES_TEST_NODE_H
#define CANOPY_NODES_TEST_NODE_H

#include "../state.h"

enum { CANOPY_TEST_STATUS, CANOPY_TEST_DELAY, CANOPY_TEST_ON_SUCCESS, CANOPY_TEST_ON_FAILURE, CANOPY_TEST_POST };

static inline canopy_step_t canopy_test_node_enter(canopy_tree_instance_t *self, uint16_t node)
{
    canopy_status_t status = (canopy_status_t)canopy_parameter(self, node, CANOPY_TEST_STATUS);
    uint16_t *words = canopy_words(self, node);

    if (!canopy_resumes(self, node)) {
        canopy_start_timer(self, words, canopy_parameter(self, node, CANOPY_TEST_DELAY));
    }
    if (!canopy_timer_is_over(self, words)) {
        return canopy_done(CANOPY_RUNNING);
    }
    if (status == CANOPY_SUCCESS) {
        (void)canopy_run_script(self, node, CANOPY_TEST_ON_SUCCESS);
    }
    if (status == CANOPY_FAILURE) {
        (void)canopy_run_script(self, node, CANOPY_TEST_ON_FAILURE);
    }
    (void)canopy_run_script(self, node, CANOPY_TEST_POST);
    return canopy_done(status);
}

#endif
