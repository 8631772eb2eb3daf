/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Trees for the worst stack of a tick: one for every node type, whose leaves and scripts answer at random, so that each
 * way through the type's functions is taken; and above it a ReactiveSequence that abandons it now and then.
 */
#include "stack.h"

#include <stddef.h>

#include "canopy/node.h"

static uint32_t seed;

/* No branch and no call, so that no frame of these functions is counted. */
static inline __attribute__((always_inline)) uint32_t random_below_eight(void)
{
    seed = seed * 1664525u + 1013904223u;
    return seed >> 29;
}

/** Also a status that is none. */
static const uint8_t answers[8] = {CANOPY_RUNNING, CANOPY_RUNNING, CANOPY_RUNNING, CANOPY_SUCCESS,
                                   CANOPY_SUCCESS, CANOPY_FAILURE, CANOPY_SKIPPED, 7};

static canopy_status_t answer(void *application, uint16_t parameter)
{
    (void)application;
    (void)parameter;
    return (canopy_status_t)answers[random_below_eight()];
}

static void forget(void *application, uint16_t parameter)
{
    (void)application;
    (void)parameter;
}

static int32_t script(void *application)
{
    (void)application;
    return (int32_t)(random_below_eight() & 3u);
}

static uint32_t enter(canopy_tree_instance_t *self, uint16_t node)
{
    (void)self;
    return node + 1u;
}

static uint32_t child_done(canopy_tree_instance_t *self, uint16_t node, uint16_t child, canopy_status_t status)
{
    (void)self;
    (void)node;
    (void)child;
    return canopy_done(status);
}

static void halt(canopy_tree_instance_t *self, uint16_t node)
{
    (void)self;
    (void)node;
}

static const canopy_leaf_t leaves[] = {{.tick = answer, .running = answer, .halted = forget}};
static const canopy_control_t controls[] = {{.enter = enter, .child = child_done, .halt = halt}};
static int32_t seldom(void *application)
{
    (void)application;
    return (int32_t)(random_below_eight() >> 2 & random_below_eight());
}

static const canopy_script_t scripts[] = {script, seldom, script};

/**
 * Thresholds, counts and times of 2; scripts, and FAILURE for a status; the scripts of Attributes, of which the first three
 * keep the node below from being ticked; and what a TestNode has.
 */
static const int32_t parameters[] = {2, 2, 0, CANOPY_FAILURE, 1, 1, 1, 0, 0, 0, 0, 0, CANOPY_FAILURE, 2, 0, 1, 2};
enum { PLAIN = 0, SCRIPTED = 2, ATTRIBUTES = 4, TEST_NODE = 12 };

static uint16_t parameters_of(canopy_node_type_t type)
{
    if (type == CANOPY_NODE_ATTRIBUTES) {
        return ATTRIBUTES;
    }
    if (type == CANOPY_NODE_TEST_NODE) {
        return TEST_NODE;
    }
    return type >= CANOPY_NODE_PRECONDITION && type <= CANOPY_NODE_SWITCH ? SCRIPTED : PLAIN;
}

typedef struct {
    uint8_t least_children;
    uint8_t words;
    uint8_t parameters;
} shape_t;

static const shape_t shapes[] = {
#define CANOPY_NODE(id, name, category, least, most, words, count, parameters, text) {(least), (words), (count)},
#include "canopy/nodes.def"
#undef CANOPY_NODE
};

enum { NODES_MAX = 16, WORDS_MAX = 16 };

static canopy_node_t nodes[NODES_MAX];
static uint8_t status[NODES_MAX];
static uint16_t words[WORDS_MAX];
static canopy_tree_t tree;

static uint16_t add(canopy_node_type_t type, uint16_t parent)
{
    uint16_t node = tree.node_count++;

    nodes[node] = (canopy_node_t){.type = (uint8_t)type,
                                  .parent = parent,
                                  .end = (uint16_t)(node + 1u),
                                  .state = tree.word_count,
                                  .parameter = parameters_of(type)};
    tree.word_count = (uint16_t)(tree.word_count + shapes[type].words);
    return node;
}

/** @param asked the parameters come from scripts, where the type lets them */
uint32_t bench_stack_build(canopy_node_type_t type, uint32_t asked)
{
    uint16_t root;
    uint16_t top;
    unsigned children = shapes[type].least_children;

    tree = (canopy_tree_t){.nodes = nodes,
                           .leaves = leaves,
                           .controls = controls,
                           .scripts = scripts,
                           .parameters = parameters,
                           .leaf_count = 1,
                           .control_count = 1,
                           .script_count = sizeof scripts / sizeof scripts[0],
                           .parameter_count = sizeof parameters / sizeof parameters[0]};
    seed = 1;
    root = add(CANOPY_NODE_REACTIVE_SEQUENCE, 0);
    (void)add(CANOPY_NODE_CONDITION, root);
    top = add(type, root);
    if (asked != 0u && nodes[top].parameter == PLAIN) {
        nodes[top].asks = (uint8_t)((1u << shapes[type].parameters) - 1u);
    }
    /* Two or more children where there may be, the first an inner node, for the halt walks up from an inner node. */
    for (unsigned child = 0; child < children + (children == 1u && type < CANOPY_NODE_INVERTER); child++) {
        uint16_t parent = child == 0u ? add(CANOPY_NODE_INVERTER, top) : top;

        (void)add(CANOPY_NODE_STATEFUL_ACTION, parent);
        nodes[parent].end = tree.node_count;
    }
    nodes[top].end = tree.node_count;
    nodes[root].end = tree.node_count;
    if (canopy_tree_validate(&tree, NULL) != CANOPY_OK ||
        canopy_tree_init(&bench_instance, &tree, status, words, NULL) != CANOPY_OK) {
        return 0;
    }
    return tree.node_count;
}
