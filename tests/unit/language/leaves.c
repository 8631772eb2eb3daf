/* SPDX-License-Identifier: MIT */
/** @file Leaves and nodes of the application "language". */
#include "language_leaves.h"

canopy_status_t find_goal_tick(const language_input_t *in, const find_goal_ports_t *ports)
{
    (void)in;
    find_goal_set_goal(ports, *ports->goal + (int32_t)ports->offset);
    return CANOPY_SUCCESS;
}

/* Every port is a whole number of steps: 12.75 in quarters, degrees in tenths. */
canopy_status_t scale_tick(const language_input_t *in, const scale_ports_t *ports)
{
    (void)in;
    scale_set_scaled(ports, ports->gain);
    return ports->most == 51u && ports->temperature == 105 ? CANOPY_SUCCESS : CANOPY_FAILURE;
}

canopy_status_t fill_queue_tick(const language_input_t *in, const fill_queue_ports_t *ports)
{
    static const canopy_queue_int32_3_t queue = {.count = 3, .items = {5, 70, 900}};

    (void)in;
    fill_queue_set_queue(ports, &queue);
    return CANOPY_SUCCESS;
}

/* The texts that a leaf writes are constants of its own. */
canopy_status_t choose_colour_tick(const language_input_t *in, const choose_colour_ports_t *ports)
{
    static const canopy_queue_text_2_t queue = {.count = 2, .items = {CHOOSE_COLOUR_LIGHT_GREEN, CHOOSE_COLOUR_RED}};

    (void)in;
    choose_colour_set_colour(ports, ports->number == 1 ? CHOOSE_COLOUR_LIGHT_GREEN : CHOOSE_COLOUR_RED);
    if (*ports->last != (uint16_t)CHOOSE_COLOUR_RED) {
        choose_colour_set_last(ports, CHOOSE_COLOUR_RED);
        choose_colour_set_queue(ports, &queue);
    }
    return CANOPY_SUCCESS;
}

canopy_status_t say_tick(const language_input_t *in, const say_ports_t *ports)
{
    (void)in;
    return ports->text[0] != '\0' ? CANOPY_SUCCESS : CANOPY_FAILURE;
}

canopy_status_t use_goal_tick(const language_input_t *in, const use_goal_ports_t *ports, use_goal_state_t *self)
{
    static const float_free_t value = {.bytes = {1, 2, 3}};

    (void)in;
    use_goal_set_unconnected(ports, &value);
    *self = (use_goal_state_t){.goal = ports->goal, .temperature = ports->temperature, .label = ports->label};
    return CANOPY_SUCCESS;
}

/* Ticks one child a tick, the next one each time. */
canopy_step_t round_robin_enter(canopy_tree_instance_t *tree, uint16_t node, const language_input_t *in,
                                const round_robin_ports_t *ports, round_robin_state_t *self)
{
    uint16_t child = (uint16_t)(node + 1u);
    uint16_t children = canopy_count_children(tree, node);
    uint8_t place = (uint8_t)(children > 0u ? (ports->first + self->next) % children : 0);

    (void)in;
    for (; place > 0u; place--) {
        child = tree->tree->nodes[child].end;
    }
    return child;
}

canopy_step_t round_robin_child(canopy_tree_instance_t *tree, uint16_t node, uint16_t child, canopy_status_t status,
                                const language_input_t *in, const round_robin_ports_t *ports, round_robin_state_t *self)
{
    (void)in;
    (void)node;
    if (status != CANOPY_RUNNING) {
        self->next++;
        round_robin_set_count(ports, self->next);
        canopy_reset_child(tree, child);
    }
    return canopy_done(status);
}

void round_robin_halt(canopy_tree_instance_t *tree, uint16_t node, const language_input_t *in,
                      const round_robin_ports_t *ports, round_robin_state_t *self)
{
    (void)tree;
    (void)node;
    (void)in;
    (void)ports;
    self->halts++;
}

/* Ticks its child in every so-many-th tick. */
canopy_step_t every_enter(canopy_tree_instance_t *tree, uint16_t node, const language_input_t *in,
                          const every_ports_t *ports, every_state_t *self)
{
    (void)tree;
    (void)in;
    self->passed++;
    if (self->passed < ports->ticks) {
        return canopy_done(CANOPY_RUNNING);
    }
    self->passed = 0;
    return node + 1u;
}

canopy_step_t every_child(canopy_tree_instance_t *tree, uint16_t node, uint16_t child, canopy_status_t status,
                          const language_input_t *in, const every_ports_t *ports, every_state_t *self)
{
    (void)node;
    (void)in;
    (void)ports;
    (void)self;
    if (status != CANOPY_RUNNING) {
        canopy_reset_child(tree, child);
    }
    return canopy_done(status);
}

void every_halt(canopy_tree_instance_t *tree, uint16_t node, const language_input_t *in, const every_ports_t *ports,
                every_state_t *self)
{
    (void)tree;
    (void)node;
    (void)in;
    (void)ports;
    self->passed = 0;
}
