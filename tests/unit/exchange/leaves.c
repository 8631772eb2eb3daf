/* SPDX-License-Identifier: MIT */
/** @file Leaves and nodes of the application "exchange": they keep what they see in exchange_seen. */
#include <string.h>

#include "exchange_leaves.h"

exchange_seen_t exchange_seen;

static void copy_label(char *into, const char *label)
{
    for (unsigned index = 0; index < 11u && *label != '\0'; index++) {
        *into++ = *label++;
    }
    *into = '\0';
}

canopy_status_t measure_tick(const exchange_input_t *in, const measure_ports_t *ports)
{
    const pose_t pose = {.x = *ports->count + 1, .y = -*ports->count};

    (void)in;
    measure_set_pose(ports, &pose);
    measure_set_count(ports, *ports->count + 1);
    return CANOPY_SUCCESS;
}

canopy_status_t note_tick(const exchange_input_t *in, const note_ports_t *ports)
{
    (void)in;
    note_set_value(ports, 5);
    exchange_seen.notes++;
    return CANOPY_SUCCESS;
}

canopy_status_t compare_tick(const exchange_input_t *in, const compare_ports_t *ports)
{
    (void)in;
    if (exchange_seen.compare_count < (unsigned)EXCHANGE_COMPARES) {
        compare_seen_t *seen = &exchange_seen.compares[exchange_seen.compare_count++];

        /* One by one: the test compares the bytes, and an assignment of all need not keep the gaps zero. */
        seen->exact = ports->exact;
        seen->small = ports->small;
        seen->count = ports->count;
        seen->after = ports->after;
        seen->wide = ports->wide;
        copy_label(seen->label, ports->label);
    }
    return ports->exact ? CANOPY_SUCCESS : CANOPY_FAILURE;
}

canopy_status_t idle_tick(const exchange_input_t *in)
{
    (void)in;
    return CANOPY_FAILURE;
}

static canopy_status_t drive(exchange_output_t *out, const drive_ports_t *ports, drive_state_t *self)
{
    exchange_seen.speed = ports->speed;
    exchange_seen.fast = ports->fast;
    exchange_seen.gear = *ports->gear;
    exchange_seen.pose = *ports->pose;
    exchange_seen.temperature = ports->temperature;
    copy_label(exchange_seen.label, ports->label);
    exchange_set_fan_speed(out, ports->speed + self->ticks);
    return ++self->ticks % 3u != 0u ? CANOPY_RUNNING : CANOPY_SUCCESS;
}

canopy_status_t drive_on_start(const exchange_input_t *in, exchange_output_t *out, const drive_ports_t *ports,
                               drive_state_t *self)
{
    (void)in;
    exchange_seen.starts++;
    return drive(out, ports, self);
}

canopy_status_t drive_on_running(const exchange_input_t *in, exchange_output_t *out, const drive_ports_t *ports,
                                 drive_state_t *self)
{
    (void)in;
    return drive(out, ports, self);
}

void drive_on_halted(const exchange_input_t *in, exchange_output_t *out, const drive_ports_t *ports,
                     drive_state_t *self)
{
    (void)in;
    (void)self;
    exchange_seen.halts++;
    exchange_set_fan_speed(out, ports->speed);
}

/* Ticks the child at `place` only. An image may give it any place, and any number of children. */
canopy_step_t first_enter(canopy_tree_instance_t *tree, uint16_t node, const exchange_input_t *in,
                          const first_ports_t *ports)
{
    uint16_t child = (uint16_t)(node + 1u);
    uint16_t children = canopy_count_children(tree, node);

    (void)in;
    for (uint16_t place = 0; place < ports->place && place + 1u < children; place++) {
        child = tree->tree->nodes[child].end;
    }
    return child;
}

canopy_step_t first_child(canopy_tree_instance_t *tree, uint16_t node, uint16_t child, canopy_status_t status,
                          const exchange_input_t *in, const first_ports_t *ports)
{
    (void)node;
    (void)in;
    (void)ports;
    return canopy_pass_on(tree, child, status);
}

void first_halt(canopy_tree_instance_t *tree, uint16_t node, const exchange_input_t *in, const first_ports_t *ports)
{
    (void)tree;
    (void)node;
    (void)in;
    (void)ports;
}

/* Open in every other tick. */
canopy_step_t gate_enter(canopy_tree_instance_t *tree, uint16_t node, const exchange_input_t *in, gate_state_t *self)
{
    (void)tree;
    (void)in;
    self->was_open = !self->was_open;
    return self->was_open ? (canopy_step_t)(node + 1u) : canopy_done(CANOPY_FAILURE);
}

canopy_step_t gate_child(canopy_tree_instance_t *tree, uint16_t node, uint16_t child, canopy_status_t status,
                         const exchange_input_t *in, gate_state_t *self)
{
    (void)node;
    (void)in;
    (void)self;
    return canopy_pass_on(tree, child, status);
}

void gate_halt(canopy_tree_instance_t *tree, uint16_t node, const exchange_input_t *in, gate_state_t *self)
{
    (void)tree;
    (void)node;
    (void)in;
    (void)self;
}
