/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The behaviour tree: a constant node table, one instance of its state, and the tick.
 *
 * What a tick means is written in docs/semantics.md. In short: canopy_tree_tick() is a function of (table, state,
 * what the leaves read, now); it visits each node at most once, and it neither recurses nor allocates: its stack use does
 * not depend on the tree.
 *
 * Threads: an instance belongs to one thread. Instances share tables freely, tables are constant.
 *
 * Memory: all by the caller, usually in the one static object that `canopy compile` makes. 12 bytes of constant memory a
 * node; 1 byte of RAM a node and 2 bytes for each state word that nodes.def lists.
 */
#ifndef CANOPY_TREE_H
#define CANOPY_TREE_H

#include <stdbool.h>
#include <stdint.h>

#include "canopy/clock.h"
#include "canopy/status.h"
#include "canopy/status_code.h"

/** Largest number of nodes of a tree (indices 0..65533; 65534 and 65535 mean "none" in tables and traces). */
#define CANOPY_NODES_MAX 65534u

/** Types of nodes, in the order of nodes.def. */
typedef enum {
#define CANOPY_NODE(id, name, category, least, most, words, count, parameters, text) CANOPY_NODE_##id,
#include "canopy/nodes.def"
#undef CANOPY_NODE
    CANOPY_NODE_TYPES
} canopy_node_type_t;

/**
 * One node. The table holds the tree in depth-first order, the root first: a node's first child is the next entry, and
 * a child's `end` is its next sibling, or the parent's `end` for the last one.
 */
typedef struct {
    uint8_t type;    /**< canopy_node_type_t. */
    uint8_t asks;    /**< Bit i: parameter i is a script that gives the value in each tick. Else 0. */
    uint16_t parent; /**< Index of the parent; the root names itself, 0. */
    uint16_t end;    /**< Index after the last descendant. */
    uint16_t state;  /**< First of its state words, after those of earlier nodes; any value if it has none. */
    uint16_t leaf;   /**< Your nodes: index in canopy_tree_t.leaves or .controls. Else 0. */
    uint16_t
        parameter; /**< Your nodes: which of the kind's uses this is. Else: first index in canopy_tree_t.parameters. */
} canopy_node_t;

/**
 * The functions of one kind of leaf, made by the compiler around the user's functions.
 *
 * @param application the pointer given to canopy_tree_init()
 * @param parameter   canopy_node_t.parameter of the leaf: which of the kind's instances this is
 */
typedef struct {
    /** Condition, SyncAction: called in every tick of the leaf. StatefulAction: on_start. */
    canopy_status_t (*tick)(void *application, uint16_t parameter);
    /** StatefulAction: called instead of tick while the action is RUNNING. Else NULL. */
    canopy_status_t (*running)(void *application, uint16_t parameter);
    /** StatefulAction: called once when a RUNNING action is abandoned. Else NULL. */
    void (*halted)(void *application, uint16_t parameter);
} canopy_leaf_t;

/**
 * A script of the tree, compiled to C.
 * @return the value of its last expression: 0 is false; an index; a count
 */
typedef int32_t (*canopy_script_t)(void *application);

struct canopy_tree_instance;

/** The functions of one kind of control node or decorator of your own; canopy/node.h is their manual. */
typedef struct {
    uint32_t (*enter)(struct canopy_tree_instance *self, uint16_t node);
    uint32_t (*child)(struct canopy_tree_instance *self, uint16_t node, uint16_t child, canopy_status_t status);
    void (*halt)(struct canopy_tree_instance *self, uint16_t node); /**< NULL: nothing to forget. */
} canopy_control_t;

/** A tree: constant tables. A table may be NULL when its count is 0. */
typedef struct {
    const canopy_node_t *nodes;
    const canopy_leaf_t *leaves;
    const canopy_control_t *controls;
    const canopy_script_t *scripts;
    const int32_t *parameters; /**< Parameters of the other nodes, in the unit of the XML attribute. */
    uint16_t node_count;       /**< 1..CANOPY_NODES_MAX. */
    uint16_t leaf_count;
    uint16_t control_count;
    uint16_t script_count;
    uint16_t parameter_count;
    uint16_t word_count; /**< State words of all nodes together. */
    uint32_t hash;       /**< First 8 digits of the model file's hash, for CanopyModel; 0: not known. */
} canopy_tree_t;

/** One running instance of a tree. Set up by canopy_tree_init(); read the counters, leave the rest alone. */
typedef struct canopy_tree_instance {
    const canopy_tree_t *tree;
    void *application;
    uint8_t *status; /**< A byte a node, see canopy/status_code.h. */
    uint16_t *words;
    canopy_time_t now;   /**< Of the tick under way. */
    uint32_t faults;     /**< Leaves that returned no valid status (rule 7). Saturates. */
    uint16_t fault_node; /**< The last such leaf. */
} canopy_tree_instance_t;

/**
 * Makes an instance: every node IDLE, every counter 0.
 *
 * @param self        the instance
 * @param tree        the tables; must stay
 * @param status      tree->node_count bytes; must stay
 * @param words       tree->word_count words; may be NULL when that is 0
 * @param application handed to every leaf function; may be NULL
 * @return CANOPY_OK; CANOPY_ERROR_ARGUMENT for a NULL that is not allowed or a node count out of range (nothing changed)
 *
 * O(nodes). The tables themselves are not examined: use canopy_tree_validate() on tables that did not come from the compiler.
 */
canopy_error_t canopy_tree_init(canopy_tree_instance_t *self, const canopy_tree_t *tree, uint8_t *status,
                                uint16_t *words, void *application);

/**
 * Examines tables: structure, types, arities, that every index lies in its table and that no two nodes share a state
 * word, so that no tick can leave them.
 *
 * @param tree the tables
 * @param bad_node when not NULL: receives the first node found wrong
 * @return CANOPY_OK or CANOPY_ERROR_TREE (CANOPY_ERROR_ARGUMENT when tree or a table is NULL). O(nodes).
 */
canopy_error_t canopy_tree_validate(const canopy_tree_t *tree, uint16_t *bad_node);

/**
 * Ticks the tree once.
 *
 * @param self the instance
 * @param now  time of this tick [us]; any value, but going back makes Timeout wait longer
 * @return RUNNING, SUCCESS, FAILURE or SKIPPED. A tree that completed starts again with the next tick.
 *
 * Visits each node at most once, halts included twice, so O(nodes); the stack does not depend on the tree. Calls leaf
 * functions; these must not call back into this instance.
 */
canopy_status_t canopy_tree_tick(canopy_tree_instance_t *self, canopy_time_t now);

/**
 * Halts the whole tree: every RUNNING node once, deepest first; every node is IDLE afterwards. O(nodes).
 * Not to be called from a leaf.
 */
void canopy_tree_halt(canopy_tree_instance_t *self);

/**
 * Halts the whole tree and forgets what outlives a halt: a RunOnce has not run, a SequenceWithMemory starts at its first
 * child. The fault counter stays. O(nodes). Not to be called from a leaf.
 */
void canopy_tree_reset(canopy_tree_instance_t *self);

/** Status of a node now: IDLE for one that its parent has reset. node must be < node_count (not checked). O(1). */
static inline canopy_status_t canopy_tree_status(const canopy_tree_instance_t *self, uint16_t node)
{
    return canopy_status_now(self->status[node]);
}

/**
 * Status code of a node (canopy/status_code.h): what it returned last, whether in the last tick, and whether its parent has
 * reset it since. Without a trace nobody marks what is old: every result counts as one of the last tick. node must be
 * < node_count (not checked). O(1).
 */
static inline uint8_t canopy_tree_status_code(const canopy_tree_instance_t *self, uint16_t node)
{
    return canopy_status_code(self->status[node]);
}

#endif
