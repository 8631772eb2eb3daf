/* SPDX-License-Identifier: MIT */
/** @file The trees that the benchmark ticks. */
#include "workloads.h"

#include <stddef.h>

const char *const bench_names[BENCH_WORKLOADS] = {
    "sequence", "fallback",  "reactive",      "reactive_running", "memory_running",
    "balanced", "inverters", "halt_reactive", "halt_parallel",    "halt_timeout",
};

canopy_tree_instance_t bench_instance;
uint32_t bench_leaf_calls;

static canopy_status_t count_success(void *application, uint16_t parameter)
{
    (void)parameter;
    (*(uint32_t *)application)++;
    return CANOPY_SUCCESS;
}

static canopy_status_t count_failure(void *application, uint16_t parameter)
{
    (void)parameter;
    (*(uint32_t *)application)++;
    return CANOPY_FAILURE;
}

static canopy_status_t count_running(void *application, uint16_t parameter)
{
    (void)parameter;
    (*(uint32_t *)application)++;
    return CANOPY_RUNNING;
}

/** SUCCESS and FAILURE in turn: the first with parameter 1, the second first with 0. */
static canopy_status_t count_alternate(void *application, uint16_t parameter)
{
    static uint8_t calls;

    (*(uint32_t *)application)++;
    calls++;
    return (calls & 1u) == parameter ? CANOPY_SUCCESS : CANOPY_FAILURE;
}

static void count_nothing(void *application, uint16_t parameter)
{
    (void)application;
    (void)parameter;
}

enum { SUCCEEDS, FAILS, RUNS, ALTERNATES };

static const canopy_leaf_t leaves[] = {
    [SUCCEEDS] = {.tick = count_success},
    [FAILS] = {.tick = count_failure},
    [RUNS] = {.tick = count_running, .running = count_running, .halted = count_nothing},
    [ALTERNATES] = {.tick = count_alternate},
};

/** ReactiveParallel: one success is enough. Timeout: 1 ms. */
static const int32_t parameters[] = {1};

static canopy_node_t nodes[CANOPY_NODES_MAX];
static uint8_t status[CANOPY_NODES_MAX];
static uint16_t words[CANOPY_NODES_MAX + 8u];
static canopy_tree_t tree;

/** A node with state words enough for every type used here. */
static uint16_t add_node(canopy_node_type_t type, uint16_t parent)
{
    uint16_t words_needed = type == CANOPY_NODE_TIMEOUT ? 4u : 1u;
    uint16_t node = tree.node_count++;

    nodes[node] = (canopy_node_t){
        .type = (uint8_t)type, .parent = parent, .end = (uint16_t)(node + 1u), .state = tree.word_count};
    tree.word_count = (uint16_t)(tree.word_count + words_needed);
    return node;
}

static void add_leaf(canopy_node_type_t type, uint16_t parent, uint16_t leaf, uint16_t parameter)
{
    uint16_t node = add_node(type, parent);

    nodes[node].leaf = leaf;
    nodes[node].parameter = parameter;
}

/** One control node; all but the last leaf are Conditions. */
static void build_flat(canopy_node_type_t type, uint32_t n, uint16_t leaf, bool running)
{
    uint16_t root = add_node(type, 0);

    for (uint32_t child = running ? 1 : 0; child < n; child++) {
        add_leaf(CANOPY_NODE_CONDITION, root, leaf, 0);
    }
    if (running) {
        add_leaf(CANOPY_NODE_STATEFUL_ACTION, root, RUNS, 0);
    }
}

/** Four children a node; depth-first order comes from counting up, so no recursion is needed. */
static void build_balanced(uint32_t levels)
{
    uint16_t path[8] = {0};
    uint32_t children[8] = {0};
    uint32_t level = 0;
    uint32_t leaf = 0;

    path[0] = add_node(CANOPY_NODE_SEQUENCE, 0);
    for (;;) {
        if (children[level] == 4u) {
            nodes[path[level]].end = tree.node_count;
            if (level == 0u) {
                return;
            }
            level--;
            continue;
        }
        children[level]++;
        if (level + 1u == levels) {
            add_leaf(CANOPY_NODE_CONDITION, path[level], leaf++ % 4u == 3u ? SUCCEEDS : FAILS, 0);
            continue;
        }
        path[level + 1u] = add_node(level % 2u == 0u ? CANOPY_NODE_FALLBACK : CANOPY_NODE_SEQUENCE, path[level]);
        level++;
        children[level] = 0;
    }
}

/** n nodes of one type in each other, below `parent`. @return the last one */
static uint16_t add_chain(canopy_node_type_t type, uint32_t n, uint16_t parent)
{
    for (uint32_t depth = 0; depth < n; depth++) {
        parent = add_node(type, parent);
    }
    return parent;
}

static void build_halting(canopy_node_type_t type, uint32_t n)
{
    uint16_t root = add_node(type, 0);

    if (type != CANOPY_NODE_TIMEOUT) {
        /* The action has to start in one tick and be abandoned in the next. */
        add_leaf(CANOPY_NODE_CONDITION, root, ALTERNATES, type == CANOPY_NODE_REACTIVE_SEQUENCE ? 1 : 0);
    }
    add_leaf(CANOPY_NODE_STATEFUL_ACTION, add_chain(CANOPY_NODE_SEQUENCE, n, root), RUNS, 0);
}

static void build(bench_workload_t workload, uint32_t n)
{
    switch (workload) {
    case BENCH_SEQUENCE:
        build_flat(CANOPY_NODE_SEQUENCE, n, SUCCEEDS, false);
        break;
    case BENCH_FALLBACK:
        build_flat(CANOPY_NODE_FALLBACK, n, FAILS, false);
        break;
    case BENCH_REACTIVE:
        build_flat(CANOPY_NODE_REACTIVE_SEQUENCE, n, SUCCEEDS, false);
        break;
    case BENCH_REACTIVE_RUNNING:
        build_flat(CANOPY_NODE_REACTIVE_SEQUENCE, n, SUCCEEDS, true);
        break;
    case BENCH_MEMORY_RUNNING:
        build_flat(CANOPY_NODE_SEQUENCE, n, SUCCEEDS, true);
        break;
    case BENCH_BALANCED:
        build_balanced(n);
        break;
    case BENCH_INVERTERS:
        add_leaf(CANOPY_NODE_CONDITION, add_chain(CANOPY_NODE_INVERTER, n, 0), SUCCEEDS, 0);
        break;
    case BENCH_HALT_REACTIVE:
        build_halting(CANOPY_NODE_REACTIVE_SEQUENCE, n);
        break;
    case BENCH_HALT_PARALLEL:
        build_halting(CANOPY_NODE_REACTIVE_PARALLEL, n);
        break;
    case BENCH_HALT_TIMEOUT:
        build_halting(CANOPY_NODE_TIMEOUT, n);
        break;
    case BENCH_WORKLOADS:
        break;
    }
    /* What was built as a chain or under one root ends where the table does. */
    for (uint16_t node = 0; node < tree.node_count; node++) {
        bool has_children = node + 1u < tree.node_count && nodes[node + 1u].parent == node;

        if (has_children && workload != BENCH_BALANCED) {
            nodes[node].end = tree.node_count;
        }
    }
}

uint32_t bench_build(bench_workload_t workload, uint32_t n)
{
    if (n == 0u || n > (workload == BENCH_BALANCED ? 7u : 60000u)) {
        return 0;
    }
    tree = (canopy_tree_t){.nodes = nodes,
                           .leaves = leaves,
                           .parameters = parameters,
                           .leaf_count = sizeof leaves / sizeof leaves[0],
                           .parameter_count = 1};
    build(workload, n);
    bench_leaf_calls = 0;
    if (canopy_tree_validate(&tree, NULL) != CANOPY_OK ||
        canopy_tree_init(&bench_instance, &tree, status, words, &bench_leaf_calls) != CANOPY_OK) {
        return 0;
    }
    return tree.node_count;
}
