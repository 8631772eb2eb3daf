/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The control nodes and the decorator of navigation_nodes.xml. canopy/node.h is the manual of their three functions.
 */
#include "courier_leaves.h"

static uint16_t first_child(uint16_t node)
{
    return (uint16_t)(node + 1u);
}

/* The sibling after `child`; the parent's end after the last one. */
static uint16_t sibling(const canopy_tree_instance_t *tree, uint16_t child)
{
    return tree->tree->nodes[child].end;
}

static bool is_last(const canopy_tree_instance_t *tree, uint16_t node, uint16_t child)
{
    return sibling(tree, child) == sibling(tree, node);
}

/*
 * RecoveryNode: when its first child fails, the second one shall make it good, and the first one is tried again, in the
 * next tick. Fails when the second child fails, or when it has helped number_of_retries times in vain.
 */

canopy_step_t recovery_node_enter(canopy_tree_instance_t *tree, uint16_t node, const courier_input_t *in,
                                  const recovery_node_ports_t *ports, recovery_t *self)
{
    (void)in;
    (void)ports;
    if (!canopy_resumes(tree, node)) {
        *self = (recovery_t){0};
    }
    return self->recovering ? sibling(tree, first_child(node)) : first_child(node);
}

canopy_step_t recovery_node_child(canopy_tree_instance_t *tree, uint16_t node, uint16_t child, canopy_status_t status,
                                  const courier_input_t *in, const recovery_node_ports_t *ports, recovery_t *self)
{
    (void)in;
    if (status == CANOPY_RUNNING) {
        return canopy_done(CANOPY_RUNNING);
    }
    if (!self->recovering && status == CANOPY_FAILURE && self->retries < ports->number_of_retries &&
        !is_last(tree, node, child)) {
        self->recovering = true;
        return sibling(tree, child);
    }
    canopy_reset_children(tree, node, first_child(node));
    if (self->recovering && status == CANOPY_SUCCESS) {
        self->recovering = false;
        self->retries++;
        return canopy_done(CANOPY_RUNNING);
    }
    return canopy_done(self->recovering ? CANOPY_FAILURE : status);
}

void recovery_node_halt(canopy_tree_instance_t *tree, uint16_t node, const courier_input_t *in,
                        const recovery_node_ports_t *ports, recovery_t *self)
{
    (void)tree;
    (void)node;
    (void)in;
    (void)ports;
    *self = (recovery_t){0};
}

/*
 * PipelineSequence: a Sequence that ticks the children before the furthest one again, in every tick, and waits for none
 * of them: planning goes on while the robot follows the last plan.
 */

canopy_step_t pipeline_sequence_enter(canopy_tree_instance_t *tree, uint16_t node, const courier_input_t *in,
                                      pipeline_t *self)
{
    (void)in;
    if (!canopy_resumes(tree, node)) {
        self->reached = first_child(node);
    }
    return first_child(node);
}

canopy_step_t pipeline_sequence_child(canopy_tree_instance_t *tree, uint16_t node, uint16_t child,
                                      canopy_status_t status, const courier_input_t *in, pipeline_t *self)
{
    (void)in;
    if (status == CANOPY_RUNNING && child == self->reached) {
        return canopy_done(CANOPY_RUNNING);
    }
    if (status != CANOPY_FAILURE && !is_last(tree, node, child)) {
        if (child == self->reached) {
            self->reached = sibling(tree, child);
        }
        return sibling(tree, child);
    }
    if (canopy_reset_children(tree, node, first_child(node))) {
        return canopy_done(CANOPY_SKIPPED);
    }
    return canopy_done(status == CANOPY_FAILURE ? CANOPY_FAILURE : CANOPY_SUCCESS);
}

void pipeline_sequence_halt(canopy_tree_instance_t *tree, uint16_t node, const courier_input_t *in, pipeline_t *self)
{
    (void)tree;
    (void)node;
    (void)in;
    (void)self; /* enter starts anew: the node is not RUNNING any more */
}

/*
 * RoundRobin: each time it is started it takes the next child in turn, so that the same remedy is not tried twice in a
 * row. A child that fails gives way to the one after it; when all have failed, so has the node.
 */

static uint16_t child_in_turn(const canopy_tree_instance_t *tree, uint16_t node, uint16_t turn)
{
    uint16_t child = first_child(node);

    for (; turn > 0u; turn--) {
        child = sibling(tree, child);
    }
    return child;
}

canopy_step_t round_robin_enter(canopy_tree_instance_t *tree, uint16_t node, const courier_input_t *in,
                                round_robin_t *self)
{
    (void)in;
    if (!canopy_resumes(tree, node)) {
        self->tried = 0;
    }
    return child_in_turn(tree, node, self->next);
}

canopy_step_t round_robin_child(canopy_tree_instance_t *tree, uint16_t node, uint16_t child, canopy_status_t status,
                                const courier_input_t *in, round_robin_t *self)
{
    (void)in;
    if (status == CANOPY_RUNNING) {
        return canopy_done(CANOPY_RUNNING);
    }
    self->next = is_last(tree, node, child) ? 0 : (uint16_t)(self->next + 1u);
    self->tried++;
    if (status != CANOPY_SUCCESS && self->tried < canopy_count_children(tree, node)) {
        return child_in_turn(tree, node, self->next);
    }
    canopy_reset_children(tree, node, first_child(node));
    return canopy_done(status == CANOPY_SUCCESS ? CANOPY_SUCCESS : CANOPY_FAILURE);
}

void round_robin_halt(canopy_tree_instance_t *tree, uint16_t node, const courier_input_t *in, round_robin_t *self)
{
    (void)tree;
    (void)node;
    (void)in;
    (void)self; /* whose turn it is outlives a halt */
}

/*
 * RateController: starts its child at most hz times a second, and is RUNNING between. A child that is RUNNING is ticked
 * in every tick.
 */

#define SECOND_US UINT32_C(1000000)

canopy_step_t rate_controller_enter(canopy_tree_instance_t *tree, uint16_t node, const courier_input_t *in,
                                    const rate_controller_ports_t *ports, rate_t *self)
{
    uint16_t child = first_child(node);
    canopy_time_t interval = ports->hz > 0u ? SECOND_US / ports->hz : SECOND_US;

    if (canopy_tree_status(tree, node) == CANOPY_IDLE) {
        self->has_started = false; /* the parent starts anew, and so does the clock */
    }
    if (canopy_tree_status(tree, child) == CANOPY_RUNNING) {
        return child;
    }
    if (self->has_started && in->now - self->started < interval) {
        return canopy_done(CANOPY_RUNNING);
    }
    self->started = in->now;
    self->has_started = true;
    return child;
}

canopy_step_t rate_controller_child(canopy_tree_instance_t *tree, uint16_t node, uint16_t child, canopy_status_t status,
                                    const courier_input_t *in, const rate_controller_ports_t *ports, rate_t *self)
{
    (void)node;
    (void)in;
    (void)ports;
    (void)self;
    return canopy_pass_on(tree, child, status);
}

void rate_controller_halt(canopy_tree_instance_t *tree, uint16_t node, const courier_input_t *in,
                          const rate_controller_ports_t *ports, rate_t *self)
{
    (void)tree;
    (void)node;
    (void)in;
    (void)ports;
    (void)self;
}
