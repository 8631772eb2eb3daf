/* SPDX-License-Identifier: MIT */
/** @file The tick: a loop that goes down to a leaf and comes up again, and the halt. No recursion, no allocation. */
#include "canopy/tree.h"

#include <stddef.h>

#include "canopy/node.h"
#include "nodes/async_sequence.h"
#include "nodes/attributes.h"
#include "nodes/delay.h"
#include "nodes/entry_updated.h"
#include "nodes/if_then_else.h"
#include "nodes/leaf.h"
#include "nodes/loop.h"
#include "nodes/parallel.h"
#include "nodes/parallel_all.h"
#include "nodes/precondition.h"
#include "nodes/reactive_parallel.h"
#include "nodes/repeat.h"
#include "nodes/result.h"
#include "nodes/run_once.h"
#include "nodes/sequence.h"
#include "nodes/sequence_with_memory.h"
#include "nodes/switch.h"
#include "nodes/test_node.h"
#include "nodes/timeout.h"
#include "nodes/try_catch.h"
#include "nodes/user.h"
#include "nodes/while_do_else.h"

/** Every node IDLE, every state word 0. */
static void forget_everything(canopy_tree_instance_t *self)
{
    for (uint16_t node = 0; node < self->tree->node_count; node++) {
        self->status[node] = (uint8_t)CANOPY_STATUS_NEVER;
    }
    for (uint16_t word = 0; word < self->tree->word_count; word++) {
        self->words[word] = 0;
    }
}

/* NOLINTBEGIN(readability-non-const-parameter): the instance keeps both pointers, and writes through them. */
canopy_error_t canopy_tree_init(canopy_tree_instance_t *self, const canopy_tree_t *tree, uint8_t *status,
                                uint16_t *words, void *application)
{
    if (self == NULL || tree == NULL || tree->nodes == NULL || status == NULL ||
        (words == NULL && tree->word_count != 0u) || tree->node_count == 0u || tree->node_count > CANOPY_NODES_MAX) {
        return CANOPY_ERROR_ARGUMENT;
    }
    *self = (canopy_tree_instance_t){
        .tree = tree, .application = application, .status = status, .words = words, .fault_node = UINT16_MAX};
    forget_everything(self);
    return CANOPY_OK;
}
/* NOLINTEND(readability-non-const-parameter) */

canopy_status_t canopy_leaf_fault(canopy_tree_instance_t *self, uint16_t node)
{
    if (self->faults != UINT32_MAX) {
        self->faults++;
    }
    self->fault_node = node;
    return CANOPY_FAILURE;
}

/** The tick has come down to this node; those of nodes/sequence.h are entered by the tick itself. */
static CANOPY_SELDOM canopy_step_t enter(canopy_tree_instance_t *self, canopy_index_t index)
{
    uint16_t node = (uint16_t)index;

    switch ((canopy_node_type_t)self->tree->nodes[node].type) { /* not covered: no other value */
    case CANOPY_NODE_CONDITION:
    case CANOPY_NODE_SYNC_ACTION:
        return canopy_leaf_enter(self, node);
    case CANOPY_NODE_STATEFUL_ACTION:
        return canopy_stateful_action_enter(self, node);
    case CANOPY_NODE_ALWAYS_SUCCESS:
        return canopy_done(CANOPY_SUCCESS);
    case CANOPY_NODE_ALWAYS_FAILURE:
        return canopy_done(CANOPY_FAILURE);
    case CANOPY_NODE_SLEEP:
        return canopy_sleep_enter(self, node);
    case CANOPY_NODE_SEQUENCE_WITH_MEMORY:
        return canopy_sequence_with_memory_enter(self, node);
    case CANOPY_NODE_ASYNC_SEQUENCE:
    case CANOPY_NODE_ASYNC_FALLBACK:
        return canopy_async_sequence_enter(self, node);
    case CANOPY_NODE_PARALLEL:
        return canopy_parallel_enter(self, node);
    case CANOPY_NODE_PARALLEL_ALL:
        return canopy_parallel_all_enter(self, node);
    case CANOPY_NODE_REACTIVE_PARALLEL:
        return canopy_reactive_parallel_enter(node);
    case CANOPY_NODE_IF_THEN_ELSE:
        return canopy_if_then_else_enter(self, node);
    case CANOPY_NODE_WHILE_DO_ELSE:
        return canopy_while_do_else_enter(node);
    case CANOPY_NODE_TRY_CATCH:
        return canopy_try_catch_enter(self, node);
    case CANOPY_NODE_INVERTER:
    case CANOPY_NODE_FORCE_SUCCESS:
    case CANOPY_NODE_FORCE_FAILURE:
    case CANOPY_NODE_KEEP_RUNNING_UNTIL_FAILURE:
        return canopy_result_enter(node);
    case CANOPY_NODE_REPEAT:
        return canopy_repeat_enter(self, node, CANOPY_SUCCESS);
    case CANOPY_NODE_RETRY_UNTIL_SUCCESSFUL:
        return canopy_repeat_enter(self, node, CANOPY_FAILURE);
    case CANOPY_NODE_DELAY:
        return canopy_delay_enter(self, node);
    case CANOPY_NODE_TIMEOUT:
        return canopy_timeout_enter(self, node);
    case CANOPY_NODE_RUN_ONCE:
        return canopy_run_once_enter(self, node);
    case CANOPY_NODE_PRECONDITION:
        return canopy_precondition_enter(self, node);
    case CANOPY_NODE_ATTRIBUTES:
        return canopy_attributes_enter(self, node);
    case CANOPY_NODE_SKIP_UNLESS_UPDATED:
        return canopy_entry_updated_enter(self, node, CANOPY_SKIPPED);
    case CANOPY_NODE_WAIT_VALUE_UPDATE:
        return canopy_entry_updated_enter(self, node, CANOPY_RUNNING);
    case CANOPY_NODE_WAS_ENTRY_UPDATED:
        return canopy_was_entry_updated_enter(self, node);
    case CANOPY_NODE_TEST_NODE:
        return canopy_test_node_enter(self, node);
    case CANOPY_NODE_LOOP:
        return canopy_loop_enter(self, node);
    case CANOPY_NODE_SWITCH:
        return canopy_switch_enter(self, node);
    case CANOPY_NODE_USER_CONTROL:
    case CANOPY_NODE_USER_DECORATOR:
        return canopy_user_enter(self, node);
    case CANOPY_NODE_SEQUENCE:          /* not covered: the tick enters these itself */
    case CANOPY_NODE_FALLBACK:          /* not covered: the tick enters these itself */
    case CANOPY_NODE_REACTIVE_SEQUENCE: /* not covered: the tick enters these itself */
    case CANOPY_NODE_REACTIVE_FALLBACK: /* not covered: the tick enters these itself */
    case CANOPY_NODE_TYPES:             /* not covered: no type */
        break;
    }
    return canopy_done(canopy_leaf_fault(self, node)); /* not covered: refused */
}

/** A child of this node has returned; those of nodes/sequence.h are told by the tick itself. */
static CANOPY_SELDOM canopy_step_t child_done(canopy_tree_instance_t *self, canopy_index_t parent, canopy_index_t index,
                                              canopy_status_t status)
{
    uint16_t node = (uint16_t)parent;
    uint16_t child = (uint16_t)index;

    switch ((canopy_node_type_t)self->tree->nodes[node].type) { /* not covered: no other value */
    case CANOPY_NODE_SEQUENCE_WITH_MEMORY:
        return canopy_sequence_with_memory_child(self, node, child, status);
    case CANOPY_NODE_ASYNC_SEQUENCE:
        return canopy_async_sequence_child(self, node, child, status, CANOPY_SUCCESS);
    case CANOPY_NODE_ASYNC_FALLBACK:
        return canopy_async_sequence_child(self, node, child, status, CANOPY_FAILURE);
    case CANOPY_NODE_PARALLEL:
        return canopy_parallel_child(self, node, child, status);
    case CANOPY_NODE_PARALLEL_ALL:
        return canopy_parallel_all_child(self, node, child);
    case CANOPY_NODE_REACTIVE_PARALLEL:
        return canopy_reactive_parallel_child(self, node, child);
    case CANOPY_NODE_IF_THEN_ELSE:
        return canopy_if_then_else_child(self, node, child, status);
    case CANOPY_NODE_WHILE_DO_ELSE:
        return canopy_while_do_else_child(self, node, child, status);
    case CANOPY_NODE_TRY_CATCH:
        return canopy_try_catch_child(self, node, child, status);
    case CANOPY_NODE_INVERTER:
        return canopy_result_child(self, child, status, CANOPY_FAILURE, CANOPY_SUCCESS);
    case CANOPY_NODE_FORCE_SUCCESS:
        return canopy_result_child(self, child, status, CANOPY_SUCCESS, CANOPY_SUCCESS);
    case CANOPY_NODE_FORCE_FAILURE:
        return canopy_result_child(self, child, status, CANOPY_FAILURE, CANOPY_FAILURE);
    case CANOPY_NODE_KEEP_RUNNING_UNTIL_FAILURE:
        return canopy_result_child(self, child, status, CANOPY_RUNNING, CANOPY_FAILURE);
    case CANOPY_NODE_REPEAT:
        return canopy_repeat_child(self, node, child, status, CANOPY_SUCCESS);
    case CANOPY_NODE_RETRY_UNTIL_SUCCESSFUL:
        return canopy_repeat_child(self, node, child, status, CANOPY_FAILURE);
    case CANOPY_NODE_RUN_ONCE:
        return canopy_run_once_child(self, node, child, status);
    case CANOPY_NODE_DELAY:
    case CANOPY_NODE_TIMEOUT:
    case CANOPY_NODE_PRECONDITION:
    case CANOPY_NODE_SKIP_UNLESS_UPDATED:
    case CANOPY_NODE_WAIT_VALUE_UPDATE:
        return canopy_pass_on(self, child, status);
    case CANOPY_NODE_ATTRIBUTES:
        return canopy_attributes_child(self, node, child, status);
    case CANOPY_NODE_LOOP:
        return canopy_loop_child(self, child, status);
    case CANOPY_NODE_SWITCH:
        return canopy_switch_child(self, node, child, status);
    case CANOPY_NODE_USER_CONTROL:
    case CANOPY_NODE_USER_DECORATOR:
        return canopy_user_child(self, node, child, status);
    case CANOPY_NODE_SEQUENCE:          /* not covered: told by the tick itself */
    case CANOPY_NODE_FALLBACK:          /* not covered: told by the tick itself */
    case CANOPY_NODE_REACTIVE_SEQUENCE: /* not covered: told by the tick itself */
    case CANOPY_NODE_REACTIVE_FALLBACK: /* not covered: told by the tick itself */
    case CANOPY_NODE_CONDITION:
    case CANOPY_NODE_SYNC_ACTION:
    case CANOPY_NODE_STATEFUL_ACTION:
    case CANOPY_NODE_ALWAYS_SUCCESS:
    case CANOPY_NODE_ALWAYS_FAILURE:
    case CANOPY_NODE_SLEEP:
    case CANOPY_NODE_WAS_ENTRY_UPDATED:
    case CANOPY_NODE_TEST_NODE:
    case CANOPY_NODE_TYPES: /* not covered: no type */
        break;
    }
    return canopy_done(canopy_leaf_fault(self, node));
}

/** This RUNNING node is abandoned; what is below it has been halted. */
static void halt_node(canopy_tree_instance_t *self, uint16_t node)
{
    switch ((canopy_node_type_t)self->tree->nodes[node].type) {
    case CANOPY_NODE_STATEFUL_ACTION:
        canopy_stateful_action_halt(self, node);
        break;
    case CANOPY_NODE_ATTRIBUTES:
        canopy_attributes_halt(self, node);
        break;
    case CANOPY_NODE_TRY_CATCH:
        /* The status first, so that the call is the last thing done: no frame of this function below a leaf's. */
        self->status[node] = canopy_status_reset(self->status[node]);
        canopy_try_catch_halt(self, node);
        return;
    case CANOPY_NODE_USER_CONTROL:
    case CANOPY_NODE_USER_DECORATOR:
        canopy_user_halt(self, node);
        break;
    case CANOPY_NODE_CONDITION:
    case CANOPY_NODE_SYNC_ACTION:
    case CANOPY_NODE_ALWAYS_SUCCESS:
    case CANOPY_NODE_ALWAYS_FAILURE:
    case CANOPY_NODE_SLEEP:
    case CANOPY_NODE_SEQUENCE:
    case CANOPY_NODE_SEQUENCE_WITH_MEMORY:
    case CANOPY_NODE_ASYNC_SEQUENCE:
    case CANOPY_NODE_REACTIVE_SEQUENCE:
    case CANOPY_NODE_FALLBACK:
    case CANOPY_NODE_ASYNC_FALLBACK:
    case CANOPY_NODE_REACTIVE_FALLBACK:
    case CANOPY_NODE_PARALLEL:
    case CANOPY_NODE_PARALLEL_ALL:
    case CANOPY_NODE_REACTIVE_PARALLEL:
    case CANOPY_NODE_IF_THEN_ELSE:
    case CANOPY_NODE_WHILE_DO_ELSE:
    case CANOPY_NODE_INVERTER:
    case CANOPY_NODE_FORCE_SUCCESS:
    case CANOPY_NODE_FORCE_FAILURE:
    case CANOPY_NODE_KEEP_RUNNING_UNTIL_FAILURE:
    case CANOPY_NODE_REPEAT:
    case CANOPY_NODE_RETRY_UNTIL_SUCCESSFUL:
    case CANOPY_NODE_DELAY:
    case CANOPY_NODE_TIMEOUT:
    case CANOPY_NODE_RUN_ONCE:
    case CANOPY_NODE_PRECONDITION:
    case CANOPY_NODE_SKIP_UNLESS_UPDATED:
    case CANOPY_NODE_WAIT_VALUE_UPDATE:
    case CANOPY_NODE_WAS_ENTRY_UPDATED:
    case CANOPY_NODE_TEST_NODE:
    case CANOPY_NODE_LOOP:
    case CANOPY_NODE_SWITCH:
    case CANOPY_NODE_TYPES:
        break;
    }
    self->status[node] = canopy_status_reset(self->status[node]);
}

canopy_status_t canopy_tree_tick(canopy_tree_instance_t *self, canopy_time_t now)
{
    const canopy_node_t *nodes = self->tree->nodes;
    const canopy_leaf_t *leaves = self->tree->leaves;
    canopy_index_t node = 0;

    self->now = now;
    for (;;) {
        const canopy_node_t *at = &nodes[node];
        canopy_status_t go_on = canopy_sequence_go_on(at);
        canopy_index_t step;

        if (go_on != CANOPY_IDLE) {
            step = canopy_sequence_enter(self, at, node);
            step = canopy_sequence_tick(self, at, node, step, &nodes[step], leaves, go_on);
        } else {
            step = enter(self, node);
        }
        while (step >= CANOPY_STEP_DONE) {
            canopy_status_t status = (canopy_status_t)(step - CANOPY_STEP_DONE);
            canopy_index_t child = node;
            canopy_index_t next = at->end;

            self->status[child] = (uint8_t)step; /* canopy_status_stored(status) */
            if (child == 0u) {
                return status;
            }
            node = at->parent;
            at = &nodes[node];
            go_on = canopy_sequence_go_on(at);
            if (go_on == CANOPY_IDLE) {
                step = child_done(self, node, child, status);
                continue;
            }
            step = canopy_sequence_child(self, at, node, child, next, status, go_on);
            if (step < CANOPY_STEP_DONE) {
                step = canopy_sequence_tick(self, at, node, step, &nodes[step], leaves, go_on);
            }
        }
        node = step;
    }
}

/*
 * Depth-first order makes a subtree a range of the table, so the halt walks it from left to right and closes each inner
 * node after its last descendant: deepest first, siblings in order. What is not RUNNING has nothing RUNNING below it.
 */
void canopy_halt_subtree(canopy_tree_instance_t *self, uint16_t top)
{
    const canopy_node_t *nodes = self->tree->nodes;
    uint16_t end = nodes[top].end;
    uint16_t node = top;

    while (node < end) {
        bool running = canopy_status_runs(self->status[node]);
        uint16_t next = nodes[node].end;

        if (running && next != node + 1u) {
            node++;
            continue;
        }
        if (running) {
            halt_node(self, node);
        } else {
            self->status[node] |= (uint8_t)CANOPY_STATUS_WAS;
        }
        while (node != top && nodes[nodes[node].parent].end == next) {
            node = nodes[node].parent;
            halt_node(self, node);
        }
        node = next;
    }
}

void canopy_tree_halt(canopy_tree_instance_t *self)
{
    canopy_reset_child(self, 0);
}

void canopy_tree_reset(canopy_tree_instance_t *self)
{
    canopy_tree_halt(self);
    forget_everything(self);
}
