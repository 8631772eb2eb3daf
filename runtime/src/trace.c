/* SPDX-License-Identifier: MIT */
/** @file The trace of a tick as CAN frames. Layout: docs/trace.md, and the Canopy... messages of the DBC. */
#include "canopy/trace.h"

#include <stddef.h>

enum { SNAPSHOT_NODES = 10, NO_NODE = 0xFFFF, NO_STATUS = 15, ARRIVALS = 3, FILTERED = 0xFFFF };
enum { OVERLOAD_BIT = 8, RETURNING_BIT = 0x40 }; /* of CanopyArrivals' first byte */

static void put16(uint8_t *data, uint32_t value)
{
    data[0] = (uint8_t)(value & 0xFFu);
    data[1] = (uint8_t)((value >> 8) & 0xFFu);
}

static uint32_t at_most16(uint32_t value)
{
    return value < UINT16_MAX ? value : UINT16_MAX;
}

/** Where the frames of a tick go. */
typedef struct {
    canopy_tx_t *tx;
    canopy_time_t until;
} sink_t;

static void send(const sink_t *sink, canopy_trace_id_t id, const canopy_tx_trace_data_t *data)
{
    canopy_tx_trace(sink->tx, id.id, id.flags, data, sink->until);
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

static void send_tick(const canopy_trace_config_t *config, canopy_trace_state_t *self, const sink_t *sink,
                      const canopy_trace_tick_t *tick, uint32_t changes)
{
    canopy_tx_trace_data_t data = {{self->sequence}};

    put16(&data.byte[1], tick->tick);
    put16(&data.byte[3], tick->tick >> 16);
    data.byte[5] = (uint8_t)((unsigned)tick->root | ((unsigned)config->tree << 4));
    data.byte[6] = (uint8_t)changes;
    data.byte[7] = (uint8_t)(tick->overruns & 0xFFu);
    self->sequence++;
    send(sink, config->tick, &data);
}

/** What the tick worked with. Without a sequence number: there is one after each CanopyTick. */
static void send_inputs(const canopy_trace_config_t *config, const sink_t *sink, const canopy_trace_tick_t *tick)
{
    canopy_time_t now = tick->cycle->now;
    canopy_tx_trace_data_t data;

    put16(&data.byte[0], (uint32_t)(now & 0xFFFFu));
    put16(&data.byte[2], (uint32_t)((now >> 16) & 0xFFFFu));
    put16(&data.byte[4], (uint32_t)((now >> 32) & 0xFFFFu));
    data.byte[6] = tick->bus->taken;
    data.byte[7] = tick->bus->check;
    send(sink, config->inputs, &data);
}

/**
 * How old the messages were of which this tick took frames, and the state of the bus: three messages a frame, in the
 * order of the table. Without messages, one frame when the state is not the one told last.
 */
static void send_arrivals(const canopy_trace_config_t *config, canopy_trace_state_t *self, const sink_t *sink,
                          const canopy_trace_tick_t *tick)
{
    const canopy_bus_state_t *bus = tick->bus;
    unsigned conditions = (unsigned)tick->cycle->can_state | (tick->cycle->overload ? (unsigned)OVERLOAD_BIT : 0u) |
                          (tick->returning ? (unsigned)RETURNING_BIT : 0u);
    bool is_due = conditions != self->conditions;
    unsigned filled = 0;
    canopy_tx_trace_data_t data = {{0}};

    self->conditions = (uint8_t)conditions;
    data.byte[7] = (uint8_t)(tick->tick & 0xFFu);
    for (uint16_t index = 0; index < bus->bus->rx_count; index++) {
        if (!bus->rx[index].taken_then) {
            continue;
        }
        if (filled == (unsigned)ARRIVALS) {
            data.byte[0] = (uint8_t)(conditions | (filled << 4));
            send(sink, config->arrivals, &data);
            filled = 0;
        }
        put16(&data.byte[1u + 2u * filled], bus->rx[index].age_ms);
        filled++;
        is_due = true;
    }
    if (is_due) {
        for (unsigned byte = 1u + 2u * filled; byte < 7u; byte++) {
            data.byte[byte] = 0;
        }
        data.byte[0] = (uint8_t)(conditions | (filled << 4));
        send(sink, config->arrivals, &data);
    }
}

/** One CanopyChange frame with one or two nodes, whose statuses count as sent. */
static void send_change(const canopy_trace_config_t *config, canopy_trace_state_t *self,
                        const canopy_tree_instance_t *tree, const sink_t *sink, const uint16_t pair[2])
{
    canopy_tx_trace_data_t data = {{self->sequence}};
    unsigned status_b = pair[1] != (uint16_t)NO_NODE ? tree->status[pair[1]] : (unsigned)NO_STATUS;

    put16(&data.byte[1], pair[0]);
    put16(&data.byte[3], pair[1]);
    data.byte[5] = (uint8_t)(tree->status[pair[0]] | (status_b << 4));
    data.byte[6] = config->tree;
    self->sequence++;
    send(sink, config->change, &data);
}

/** The first `changes` nodes whose statuses have changed, two a frame. */
static void send_changes(const canopy_trace_config_t *config, canopy_trace_state_t *self,
                         const canopy_tree_instance_t *tree, const sink_t *sink, uint32_t changes)
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
            send_change(config, self, tree, sink, pair);
            pair[1] = NO_NODE;
            filled = 0;
        }
    }
}

static void send_snapshot(const canopy_trace_config_t *config, canopy_trace_state_t *self,
                          const canopy_tree_instance_t *tree, const sink_t *sink)
{
    uint16_t count = tree->tree->node_count;
    canopy_tx_trace_data_t data;

    data.byte[0] = self->sequence;
    put16(&data.byte[1], self->next_node);
    for (unsigned place = 0; place < SNAPSHOT_NODES; place += 2u) {
        uint32_t node = self->next_node + place;
        unsigned low = node < count ? tree->status[node] : (unsigned)NO_STATUS;
        unsigned high = node + 1u < count ? tree->status[node + 1u] : (unsigned)NO_STATUS;

        data.byte[3u + (place / 2u)] = (uint8_t)(low | (high << 4));
    }
    self->next_node = self->next_node + (uint32_t)SNAPSHOT_NODES < count
                          ? (uint16_t)(self->next_node + (uint16_t)SNAPSHOT_NODES)
                          : 0u;
    self->sequence++;
    send(sink, config->snapshot, &data);
}

static void send_health(const canopy_trace_config_t *config, const sink_t *sink, const canopy_tree_instance_t *tree,
                        const canopy_trace_tick_t *tick)
{
    const canopy_bus_counters_t *counters = &tick->bus->counters;
    canopy_tx_counters_t tx;
    canopy_tx_trace_data_t data;

    canopy_tx_count(sink->tx, &tx);
    put16(&data.byte[0], at_most16(canopy_bus_rejected(counters)));
    put16(&data.byte[2], tick->is_filtered ? (uint32_t)FILTERED : at_most16(counters->unknown_id));
    put16(&data.byte[4], at_most16(canopy_sum(canopy_sum(tx.expired, tx.replaced), tx.trace_dropped)));
    put16(&data.byte[6], at_most16(tree->faults));
    send(sink, config->health, &data);
}

static void send_model(const canopy_trace_config_t *config, const sink_t *sink, const canopy_tree_t *tree)
{
    canopy_tx_trace_data_t data = {{0}};

    put16(&data.byte[0], tree->hash);
    put16(&data.byte[2], tree->hash >> 16);
    put16(&data.byte[4], tree->node_count);
    send(sink, config->model, &data);
}

void canopy_trace_send(const canopy_trace_config_t *config, canopy_trace_state_t *self,
                       const canopy_tree_instance_t *tree, canopy_tx_t *tx, const canopy_trace_tick_t *tick)
{
    const sink_t target = {.tx = tx, .until = tick->until};
    const sink_t *sink = &target;
    bool traces_nodes = config->change.id != CANOPY_TRACE_OFF;
    uint32_t changes = traces_nodes ? count_changes(self, tree, 2u * config->changes_max) : 0u;

    if (config->tick.id != CANOPY_TRACE_OFF) {
        send_tick(config, self, sink, tick, changes);
    }
    if (config->inputs.id != CANOPY_TRACE_OFF) {
        send_inputs(config, sink, tick);
    }
    if (config->arrivals.id != CANOPY_TRACE_OFF) {
        send_arrivals(config, self, sink, tick);
    }
    send_changes(config, self, tree, sink, changes);
    if (config->snapshot.id != CANOPY_TRACE_OFF) {
        send_snapshot(config, self, tree, sink);
    }
    if (config->health.id != CANOPY_TRACE_OFF && tick->tick % config->health_every == 0u) {
        send_health(config, sink, tree, tick);
    }
    if (config->model.id != CANOPY_TRACE_OFF && tick->tick % config->model_every == 0u) {
        send_model(config, sink, tree->tree);
    }
}
