/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The trees that the benchmark ticks, built at run time into static tables; for the host and for bare metal.
 *
 * The work of a leaf is the same everywhere: one counter goes up, through the function pointer of the leaf's table.
 */
#ifndef BENCH_WORKLOADS_H
#define BENCH_WORKLOADS_H

#include "canopy/tree.h"

typedef enum {
    BENCH_SEQUENCE,         /**< Sequence of n Conditions, all true. */
    BENCH_FALLBACK,         /**< Fallback of n Conditions, all false. */
    BENCH_REACTIVE,         /**< ReactiveSequence of n Conditions, all true. */
    BENCH_REACTIVE_RUNNING, /**< ReactiveSequence of n - 1 Conditions, all true, and an action that stays RUNNING. */
    BENCH_MEMORY_RUNNING,   /**< The same as a Sequence: a tick goes straight to the action. */
    BENCH_BALANCED,         /**< n levels of four children each, Sequence and Fallback in turn; leaves F, F, F, S. */
    BENCH_INVERTERS,        /**< n Inverters in each other, and a Condition. */
    /*
     * What halts: a RUNNING action under n Sequences in each other, abandoned in every second tick by
     */
    BENCH_HALT_REACTIVE, /**< a ReactiveSequence, */
    BENCH_HALT_PARALLEL, /**< a ReactiveParallel, */
    BENCH_HALT_TIMEOUT,  /**< a Timeout. */
    BENCH_WORKLOADS
} bench_workload_t;

/** The name on the command line. */
extern const char *const bench_names[BENCH_WORKLOADS];

extern canopy_tree_instance_t bench_instance;

/** Leaf calls since bench_build(); halts are none. */
extern uint32_t bench_leaf_calls;

/**
 * Builds a tree and its instance.
 * @return its number of nodes; 0 when n is out of range or the tables do not pass canopy_tree_validate()
 */
uint32_t bench_build(bench_workload_t workload, uint32_t n);

#endif
