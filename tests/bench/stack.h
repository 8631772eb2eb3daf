/* SPDX-License-Identifier: MIT */
/** @file Trees for the worst stack of a tick. */
#ifndef BENCH_STACK_H
#define BENCH_STACK_H

#include "workloads.h"

/**
 * Makes bench_instance a tree of 4 to 16 nodes in which a node of this type is ticked, halted and answered at random.
 * @param asked not 0: the parameters of the node are asked of scripts, where its type allows it
 * @return its number of nodes; 0 when the tables do not pass canopy_tree_validate()
 */
uint32_t bench_stack_build(canopy_node_type_t type, uint32_t asked);

#endif
