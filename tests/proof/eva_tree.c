/* SPDX-License-Identifier: MIT */
/**
 * @file
 * For Frama-C: every node type that has children, over leaves, scripts and control nodes that return any number, at any
 * times; two ticks, a halt, a tick, a reset. And the validator on any table of three nodes.
 */
#include <stddef.h>

#include "__fc_builtin.h"
#include "canopy/node.h"

enum { CHILDREN = 3, NODES = CHILDREN + 1, WORDS = 5, PARAMETERS = 8 };

static canopy_status_t any_status(void *application, uint16_t parameter)
{
    (void)application;
    (void)parameter;
    return (canopy_status_t)Frama_C_unsigned_int_interval(0, 6);
}

static void halted(void *application, uint16_t parameter)
{
    (void)application;
    (void)parameter;
}

static int32_t any_number(void *application)
{
    (void)application;
    return Frama_C_interval(INT32_MIN, INT32_MAX);
}

static canopy_step_t any_step(canopy_tree_instance_t *self, uint16_t node)
{
    (void)self;
    (void)node;
    return Frama_C_unsigned_int_interval(0, UINT32_MAX);
}

static canopy_step_t any_next_step(canopy_tree_instance_t *self, uint16_t node, uint16_t child, canopy_status_t status)
{
    (void)self;
    (void)node;
    (void)child;
    (void)status;
    return Frama_C_unsigned_int_interval(0, UINT32_MAX);
}

static const canopy_leaf_t leaf = {.tick = any_status, .running = any_status, .halted = halted};
static const canopy_control_t control = {.enter = any_step, .child = any_next_step};
static const canopy_script_t script = any_number;
static int32_t parameters[PARAMETERS];
static canopy_node_t nodes[NODES];
static const uint16_t most_children[CANOPY_NODE_TYPES] = {
#define CANOPY_NODE(id, name, category, least, most, words, count, parameters, text) [CANOPY_NODE_##id] = (most),
#include "canopy/nodes.def"
#undef CANOPY_NODE
};

static canopy_time_t any_time(void)
{
    return (canopy_time_t)Frama_C_unsigned_long_long_interval(0, UINT64_MAX);
}

static void run(const canopy_tree_t *tree)
{
    canopy_tree_instance_t instance;
    uint8_t status[NODES];
    uint16_t words[WORDS];

    if (canopy_tree_init(&instance, tree, status, words, NULL) != CANOPY_OK) {
        return;
    }
    (void)canopy_tree_tick(&instance, any_time());
    (void)canopy_tree_tick(&instance, any_time());
    canopy_tree_halt(&instance);
    (void)canopy_tree_tick(&instance, any_time());
    canopy_tree_reset(&instance);
}

static void run_type(uint8_t type, int32_t first_parameter)
{
    uint16_t children = most_children[type] < CHILDREN ? most_children[type] : CHILDREN;
    canopy_tree_t tree = {.nodes = nodes,
                          .leaves = &leaf,
                          .controls = &control,
                          .scripts = &script,
                          .parameters = parameters,
                          .node_count = (uint16_t)(children + 1u),
                          .leaf_count = 1,
                          .control_count = 1,
                          .script_count = 1,
                          .parameter_count = PARAMETERS,
                          .word_count = WORDS};

    for (uint16_t which = 0; which < (uint16_t)PARAMETERS; which++) {
        parameters[which] = first_parameter;
    }
    if (type == CANOPY_NODE_PRECONDITION || type == CANOPY_NODE_LOOP) {
        parameters[1] = (int32_t)CANOPY_FAILURE;
    }
    nodes[0] = (canopy_node_t){.type = type, .end = (uint16_t)(children + 1u)};
    for (uint16_t child = 1; child <= children; child++) {
        nodes[child] = (canopy_node_t){.type = CANOPY_NODE_STATEFUL_ACTION, .end = (uint16_t)(child + 1u)};
    }
    if (canopy_tree_validate(&tree, NULL) == CANOPY_OK) {
        run(&tree);
    }
}

int main(void)
{
    for (uint8_t type = 0; type < (uint8_t)CANOPY_NODE_TYPES; type++) {
#ifdef ONLY
        if (type != ONLY) {
            continue;
        }
#endif
        run_type(type, 0);
        run_type(type, 2);
        run_type(type, -1);
    }
    return 0;
}
