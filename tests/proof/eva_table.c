/* SPDX-License-Identifier: MIT */
/**
 * @file
 * For Frama-C: any table at all of any size, any index in it, and any of the tables missing. What the validator accepts is
 * ticked, halted and reset in any order, without end.
 */
#include <stddef.h>

#include "__fc_builtin.h"
#include "canopy/tree.h"

enum { PARAMETERS = UINT16_MAX, WORDS = UINT16_MAX };

static canopy_node_t nodes[CANOPY_NODES_MAX];
static uint8_t status[CANOPY_NODES_MAX];
static uint16_t words[WORDS];
static int32_t parameters[PARAMETERS];

static canopy_status_t leaf(void *application, uint16_t node)
{
    (void)application;
    (void)node;
    return (canopy_status_t)Frama_C_unsigned_int_interval(0, 7); /* those that do not exist are among them */
}

static void halted(void *application, uint16_t node)
{
    (void)application;
    (void)node;
}

static int32_t script(void *application)
{
    (void)application;
    return Frama_C_interval(INT32_MIN, INT32_MAX);
}

static uint32_t enter(canopy_tree_instance_t *self, uint16_t node)
{
    (void)self;
    (void)node;
    return Frama_C_unsigned_int_interval(0, UINT32_MAX);
}

static uint32_t child_done(canopy_tree_instance_t *self, uint16_t node, uint16_t child, canopy_status_t child_status)
{
    (void)self;
    (void)node;
    (void)child;
    (void)child_status;
    return Frama_C_unsigned_int_interval(0, UINT32_MAX);
}

static const canopy_leaf_t leaves[] = {{.tick = leaf}, {.tick = leaf, .running = leaf, .halted = halted}, {0}};
static const canopy_control_t controls[] = {{.enter = enter, .child = child_done}, {0}};
static const canopy_script_t scripts[] = {script, NULL};

static bool any_bool(void)
{
    return Frama_C_interval(0, 1) != 0;
}

/** Any run. */
static void run(canopy_tree_instance_t *instance)
{
    while (any_bool()) {
        if (any_bool()) {
            (void)canopy_tree_tick(instance, Frama_C_unsigned_long_long_interval(0, UINT64_MAX));
        } else if (any_bool()) {
            canopy_tree_halt(instance);
        } else {
            canopy_tree_reset(instance);
        }
    }
}

int main(void)
{
    uint16_t bad;
    canopy_tree_instance_t instance;
    bool has_tables = any_bool();
    canopy_tree_t tree = {.nodes = any_bool() ? nodes : NULL,
                          .leaves = has_tables ? leaves : NULL,
                          .controls = has_tables ? controls : NULL,
                          .scripts = has_tables ? scripts : NULL,
                          .parameters = has_tables ? parameters : NULL,
                          .node_count = (uint16_t)Frama_C_unsigned_int_interval(0, UINT16_MAX),
                          .leaf_count = has_tables || any_bool() ? 3 : 0,
                          .control_count = has_tables || any_bool() ? 2 : 0,
                          .script_count = has_tables || any_bool() ? 2 : 0,
                          .parameter_count = has_tables || any_bool() ? PARAMETERS : 0,
                          .word_count = (uint16_t)Frama_C_unsigned_int_interval(0, WORDS)};

    Frama_C_make_unknown((char *)nodes, sizeof nodes);
    Frama_C_make_unknown((char *)parameters, sizeof parameters);
    if (canopy_tree_validate(&tree, any_bool() ? &bad : NULL) == CANOPY_OK &&
        canopy_tree_init(&instance, &tree, status, words, NULL) == CANOPY_OK) {
        run(&instance);
    }
    return 0;
}
