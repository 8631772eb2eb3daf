/* SPDX-License-Identifier: MIT */
/**
 * @file
 * For Frama-C: the validator with any table at all of 1 to NODES nodes, any index in it, and any of the tables missing.
 */
#include <stddef.h>

#include "__fc_builtin.h"
#include "canopy/tree.h"

enum { NODES = 4, PARAMETERS = 16 };

static canopy_node_t nodes[NODES];
static int32_t parameters[PARAMETERS];

static canopy_status_t leaf(void *application, uint16_t node)
{
    (void)application;
    (void)node;
    return CANOPY_SUCCESS;
}

static void halted(void *application, uint16_t node)
{
    (void)application;
    (void)node;
}

static int32_t script(void *application)
{
    (void)application;
    return 0;
}

static uint32_t enter(canopy_tree_instance_t *self, uint16_t node)
{
    (void)self;
    return node;
}

static uint32_t child_done(canopy_tree_instance_t *self, uint16_t node, uint16_t child, canopy_status_t status)
{
    (void)self;
    (void)child;
    (void)status;
    return node;
}

static const canopy_leaf_t leaves[] = {{.tick = leaf}, {.tick = leaf, .running = leaf, .halted = halted}, {0}};
static const canopy_control_t controls[] = {{.enter = enter, .child = child_done}, {0}};
static const canopy_script_t scripts[] = {script, NULL};

static bool any_bool(void)
{
    return Frama_C_interval(0, 1) != 0;
}

int main(void)
{
    uint16_t bad;
    uint16_t node_count = (uint16_t)Frama_C_unsigned_int_interval(0, NODES);
    bool has_tables = any_bool();
    canopy_tree_t tree = {.nodes = any_bool() ? nodes : NULL,
                          .leaves = has_tables ? leaves : NULL,
                          .controls = has_tables ? controls : NULL,
                          .scripts = has_tables ? scripts : NULL,
                          .parameters = has_tables ? parameters : NULL,
                          .leaf_count = has_tables || any_bool() ? 3 : 0,
                          .control_count = has_tables || any_bool() ? 2 : 0,
                          .script_count = has_tables || any_bool() ? 2 : 0,
                          .parameter_count = has_tables || any_bool() ? PARAMETERS : 0,
                          .word_count = (uint16_t)Frama_C_unsigned_int_interval(0, UINT16_MAX)};

    /*@ split node_count; */
    tree.node_count = node_count;
    Frama_C_make_unknown((char *)nodes, sizeof nodes);
    Frama_C_make_unknown((char *)parameters, sizeof parameters);
    (void)canopy_tree_validate(&tree, any_bool() ? &bad : NULL);
    return 0;
}
