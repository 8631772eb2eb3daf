/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The interface of a node type: of the built-in ones (src/nodes/), and of control nodes and decorators of your own.
 *
 * A node type is three small functions:
 *
 *   enter  the parent (or the tick) has come to this node: what now?
 *   child  the child that enter or child asked for has returned `status`: what now?
 *   halt   this RUNNING node is abandoned; its descendants have been halted: forget what must be forgotten.
 *
 * enter and child answer with a canopy_step_t: tick that child next, or this node is done for this tick with that
 * status. The engine stores the status. So the tick is a loop, and its stack does not grow with the tree.
 *
 * A node that is done with anything but RUNNING has reset its children before (canopy_reset_children()).
 *
 * Only for these functions: nothing here may be called from a leaf or from outside a tick.
 */
#ifndef CANOPY_NODE_H
#define CANOPY_NODE_H

#include "canopy/tree.h"

/**
 * For what a tick needs seldom, or what has a large frame. Taken into the tick's loop it would push the loop's variables
 * out of the registers, and a frame would stay on the stack while a leaf runs; the figures of `make bench` depend on it.
 */
#define CANOPY_SELDOM __attribute__((noinline))

/** What to do next. Below CANOPY_STEP_DONE: tick this child. Else CANOPY_STEP_DONE + status: see canopy_done(). */
typedef uint32_t canopy_step_t;

/** Its low byte is CANOPY_STATUS_BASE, so that the low byte of a step that is done is what is stored of the status. */
#define CANOPY_STEP_DONE 0x10006u

/** The node is done for this tick, with this status. */
static inline canopy_step_t canopy_done(canopy_status_t status)
{
    return CANOPY_STEP_DONE + (canopy_step_t)status;
}

/** Was the node RUNNING when this tick came to it? (A node's status is stored when it returns.) */
static inline bool canopy_resumes(const canopy_tree_instance_t *self, uint16_t node)
{
    return canopy_status_runs(self->status[node]);
}

/** Does the node go on: was it RUNNING when this tick came to it, or SKIPPED and not reset since? */
static inline bool canopy_goes_on(const canopy_tree_instance_t *self, uint16_t node)
{
    return canopy_status_runs(self->status[node]) || canopy_status_is_skipped(self->status[node]);
}

/** Halts a subtree if it is RUNNING: every RUNNING node in it once, deepest first. O(nodes in it). */
void canopy_halt_subtree(canopy_tree_instance_t *self, uint16_t top);

/** The parent resets a child: halted if RUNNING, then IDLE. O(1), or O(nodes below) when it is RUNNING. */
static inline void canopy_reset_child(canopy_tree_instance_t *self, uint16_t child)
{
    if (canopy_status_runs(self->status[child])) {
        canopy_halt_subtree(self, child);
    }
    self->status[child] |= (uint8_t)CANOPY_STATUS_WAS;
}

/** What a decorator does that only decides whether to tick its child: passes on the child's status. */
static inline canopy_step_t canopy_pass_on(canopy_tree_instance_t *self, uint16_t child, canopy_status_t status)
{
    if (status != CANOPY_RUNNING) {
        canopy_reset_child(self, child);
    }
    return canopy_done(status);
}

/**
 * Resets the children from `first` (a child, or the node's end) to the last one of `node`. O(children), and O(nodes below)
 * for those that are RUNNING.
 * @return true when every one of them was SKIPPED
 */
static inline bool canopy_reset_children(canopy_tree_instance_t *self, uint16_t node, uint16_t first)
{
    const canopy_node_t *nodes = self->tree->nodes;
    uint16_t end = nodes[node].end;
    bool all_skipped = true;

    for (uint16_t child = first; child != end; child = nodes[child].end) {
        all_skipped = all_skipped && canopy_status_is_skipped(self->status[child]);
        /* canopy_reset_child(), but not a call of its own: this is where the stack is deepest. */
        if (canopy_status_runs(self->status[child])) {
            canopy_halt_subtree(self, child);
        }
        self->status[child] |= (uint8_t)CANOPY_STATUS_WAS;
    }
    return all_skipped;
}

/**
 * A parameter of a built-in node, from the XML or from an entry, in the unit of its attribute; `which` counts in the order
 * of nodes.def. O(1), or as long as the script takes that gives it.
 */
static inline int32_t canopy_parameter(const canopy_tree_instance_t *self, uint16_t node, unsigned which)
{
    int32_t value = self->tree->parameters[self->tree->nodes[node].parameter + which];

    return ((self->tree->nodes[node].asks >> which) & 1u) != 0u ? self->tree->scripts[value](self->application) : value;
}

/** Runs the script that a parameter of the node names; 0 when it names none. */
static inline int32_t canopy_run_script(canopy_tree_instance_t *self, uint16_t node, unsigned which)
{
    int32_t script = canopy_parameter(self, node, which);

    return script >= 0 ? self->tree->scripts[script](self->application) : 0;
}

/** The node's state words, as many as nodes.def says; O(1). */
static inline uint16_t *canopy_words(canopy_tree_instance_t *self, uint16_t node)
{
    return &self->words[self->tree->nodes[node].state];
}

/** How many children; O(children). */
/*@ requires canopy_instance_is_sound(self) && node < self->tree->node_count;
    assigns \nothing;
    ensures \result < self->tree->nodes[node].end - node;
*/
static inline uint16_t canopy_count_children(const canopy_tree_instance_t *self, uint16_t node)
{
    const canopy_node_t *nodes = self->tree->nodes;
    uint16_t children = 0;

    /*@ loop invariant canopy_walks(self->tree, node, child) && children < child - node;
        loop assigns child, children;
        loop variant nodes[node].end - child;
    */
    for (uint16_t child = (uint16_t)(node + 1u); child != nodes[node].end; child = nodes[child].end) {
        children++;
    }
    return children;
}

/** A threshold over `children`: a negative one counts from children + 1 down (-1: all). */
static inline int32_t canopy_threshold(int32_t written, int32_t children)
{
    return written < 0 ? written + children + 1 : written;
}

#endif
