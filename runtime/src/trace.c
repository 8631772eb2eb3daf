/* SPDX-License-Identifier: MIT */
/** @file The trace of a tick as CAN frames. Layout: docs/trace.md, and the Canopy... messages of the DBC. */
#include "canopy/trace.h"

#include <stddef.h>

enum { SNAPSHOT_NODES = 10, NO_NODE = 0xFFFF, NO_STATUS = 15 };

static void put16(uint8_t *data, uint32_t value)
{
    data[0] = (uint8_t)(value & 0xFFu);
    data[1] = (uint8_t)((value >> 8) & 0xFFu);
}

static uint32_t at_most16(uint32_t value)
{
    return value < UINT16_MAX ? value : UINT16_MAX;
}

static void send(canopy_trace_state_t *self, const canopy_can_t *can, canopy_trace_id_t id, const uint8_t data[8])
{
    canopy_can_frame_t frame; /* not all zero: the other 56 bytes are nobody's */

    frame.id = id.id;
    frame.flags = id.flags;
    frame.length = 8;
    for (unsigned byte = 0; byte < 8u; byte++) {
        frame.data[byte] = data[byte];
    }
    if (can->send(can->context, &frame) != 1) {
        canopy_count(&self->tx_dropped);
    }
}

/** How many nodes' statuses differ from what was sent, counted up to `most`. */
static uint32_t count_changes(const canopy_trace_state_t *self, const canopy_tree_instance_t *tree, uint32_t most)
{
    uint32_t changes = 0;

    for (uint16_t node = 0; node < tree->tree->node_count && changes < most; node++) {
        changes += self->sent[node] != tree->status[node] ? 1u : 0u;
    }
    return changes;
}

static void send_tick(const canopy_trace_config_t *config, canopy_trace_state_t *self, const canopy_can_t *can,
                      const canopy_trace_tick_t *tick, uint32_t changes)
{
    uint8_t data[8] = {self->sequence};

    put16(&data[1], tick->tick);
    put16(&data[3], tick->tick >> 16);
    data[5] = (uint8_t)((unsigned)tick->root | ((unsigned)config->tree << 4));
    data[6] = (uint8_t)changes;
    data[7] = (uint8_t)(tick->overruns & 0xFFu);
    self->sequence++;
    send(self, can, config->tick, data);
}

/** What the tick worked with. Without a sequence number: there is one after each CanopyTick. */
static void send_inputs(const canopy_trace_config_t *config, canopy_trace_state_t *self, const canopy_can_t *can,
                        const canopy_trace_tick_t *tick)
{
    uint8_t data[8];

    put16(&data[0], (uint32_t)(tick->now & 0xFFFFu));
    put16(&data[2], (uint32_t)((tick->now >> 16) & 0xFFFFu));
    put16(&data[4], (uint32_t)((tick->now >> 32) & 0xFFFFu));
    data[6] = tick->taken;
    data[7] = tick->check;
    send(self, can, config->inputs, data);
}

/** One CanopyChange frame with one or two nodes, whose statuses count as sent. */
static void send_change(const canopy_trace_config_t *config, canopy_trace_state_t *self,
                        const canopy_tree_instance_t *tree, const canopy_can_t *can, const uint16_t pair[2])
{
    uint8_t data[8] = {self->sequence};
    unsigned status_b = pair[1] != (uint16_t)NO_NODE ? tree->status[pair[1]] : (unsigned)NO_STATUS;

    put16(&data[1], pair[0]);
    put16(&data[3], pair[1]);
    data[5] = (uint8_t)(tree->status[pair[0]] | (status_b << 4));
    data[6] = config->tree;
    self->sequence++;
    send(self, can, config->change, data);
}

/** The first `changes` nodes whose statuses have changed, two a frame. */
static void send_changes(const canopy_trace_config_t *config, canopy_trace_state_t *self,
                         const canopy_tree_instance_t *tree, const canopy_can_t *can, uint32_t changes)
{
    uint16_t pair[2] = {NO_NODE, NO_NODE};
    unsigned filled = 0;

    for (uint16_t node = 0; node < tree->tree->node_count && changes > 0u; node++) {
        if (self->sent[node] == tree->status[node]) {
            continue;
        }
        self->sent[node] = tree->status[node];
        pair[filled++] = node;
        changes--;
        if (filled == 2u || changes == 0u) {
            send_change(config, self, tree, can, pair);
            pair[1] = NO_NODE;
            filled = 0;
        }
    }
}

static void send_snapshot(const canopy_trace_config_t *config, canopy_trace_state_t *self,
                          const canopy_tree_instance_t *tree, const canopy_can_t *can)
{
    uint8_t data[8] = {self->sequence};
    uint16_t count = tree->tree->node_count;

    put16(&data[1], self->next_node);
    for (unsigned place = 0; place < SNAPSHOT_NODES; place++) {
        uint32_t node = self->next_node + place;
        unsigned code = node < count ? tree->status[node] : (unsigned)NO_STATUS;

        data[3u + (place / 2u)] |= (uint8_t)(code << (4u * (place % 2u)));
    }
    self->next_node = self->next_node + (uint32_t)SNAPSHOT_NODES < count
                          ? (uint16_t)(self->next_node + (uint16_t)SNAPSHOT_NODES)
                          : 0u;
    self->sequence++;
    send(self, can, config->snapshot, data);
}

static void send_health(const canopy_trace_config_t *config, canopy_trace_state_t *self,
                        const canopy_tree_instance_t *tree, const canopy_can_t *can,
                        const canopy_bus_counters_t *counters)
{
    uint8_t data[8];

    put16(&data[0], at_most16(canopy_bus_rejected(counters)));
    put16(&data[2], at_most16(counters->unknown_id));
    put16(&data[4], at_most16(canopy_sum(counters->tx_dropped, self->tx_dropped)));
    put16(&data[6], at_most16(tree->faults));
    send(self, can, config->health, data);
}

static void send_model(const canopy_trace_config_t *config, canopy_trace_state_t *self, const canopy_tree_t *tree,
                       const canopy_can_t *can)
{
    uint8_t data[8] = {0};

    put16(&data[0], tree->hash);
    put16(&data[2], tree->hash >> 16);
    put16(&data[4], tree->node_count);
    send(self, can, config->model, data);
}

void canopy_trace_send(const canopy_trace_config_t *config, canopy_trace_state_t *self,
                       const canopy_tree_instance_t *tree, const canopy_can_t *can, const canopy_trace_tick_t *tick,
                       const canopy_bus_counters_t *counters)
{
    bool traces_nodes = config->change.id != CANOPY_TRACE_OFF;
    uint32_t changes = traces_nodes ? count_changes(self, tree, 2u * config->changes_max) : 0u;

    if (config->tick.id != CANOPY_TRACE_OFF) {
        send_tick(config, self, can, tick, changes);
    }
    if (config->inputs.id != CANOPY_TRACE_OFF) {
        send_inputs(config, self, can, tick);
    }
    send_changes(config, self, tree, can, changes);
    if (config->snapshot.id != CANOPY_TRACE_OFF) {
        send_snapshot(config, self, tree, can);
    }
    if (config->health.id != CANOPY_TRACE_OFF && tick->tick % config->health_every == 0u) {
        send_health(config, self, tree, can, counters);
    }
    if (config->model.id != CANOPY_TRACE_OFF && tick->tick % config->model_every == 0u) {
        send_model(config, self, tree->tree, can);
    }
}
