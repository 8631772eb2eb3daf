/* SPDX-License-Identifier: MIT */
/**
 * @file
 * What a tick does to the nodes of a tree, written from docs/semantics.md alone, plainly recursive: the truth that the
 * trace is held against. It knows eight types of nodes, and of each node what it returned, in which tick, and whether its
 * parent has reset it since.
 */
#ifndef CANOPY_TESTS_TRACE_REFERENCE_H
#define CANOPY_TESTS_TRACE_REFERENCE_H

#include <stdbool.h>
#include <stdint.h>

#include "canopy/status.h"
#include "random.h"

enum { NODES_MAX = 1000, DEPTH_MAX = 8 };

typedef enum {
    REF_LEAF, /**< A StatefulAction. */
    REF_CONDITION,
    REF_SEQUENCE,
    REF_FALLBACK,
    REF_REACTIVE_SEQUENCE,
    REF_REACTIVE_FALLBACK,
    REF_PARALLEL_ALL,
    REF_WHILE_DO_ELSE,
    REF_INVERTER,
    REF_KEEP_RUNNING
} ref_kind_t;

typedef struct {
    ref_kind_t kind;
    uint16_t parent, end;   /**< As in canopy_node_t. */
    canopy_status_t answer; /**< Of a leaf, in this tick. */
    canopy_status_t result; /**< What it returned last; IDLE: it was never ticked. */
    bool is_ticked;         /**< In this tick. */
    bool is_reset;          /**< By its parent, since then. */
    uint16_t resume;        /**< The child at which a Sequence or Fallback goes on; 0: the first one. */
} ref_node_t;

typedef struct {
    uint16_t count;
    ref_node_t nodes[NODES_MAX];
} ref_tree_t;

/** A random tree of 1 to `most` nodes. Some are broad: leaves under one ParallelAll. */
void ref_make(ref_tree_t *self, random_t *random, uint16_t most);

/** One ParallelAll over count - 1 leaves. */
void ref_make_flat(ref_tree_t *self, uint16_t count);

/** Nothing was ever ticked. */
void ref_start(ref_tree_t *self);

/** A tick, with the answers in the leaves. Returns the root's status. */
canopy_status_t ref_tick(ref_tree_t *self);

/** A node's status code after the tick, by the table of docs/trace.md. */
uint8_t ref_code(const ref_node_t *node);

#endif
