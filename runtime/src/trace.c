/* SPDX-License-Identifier: MIT */
/** @file A tick as CAN frames: CanopyTick, CanopyInputs, CanopyArrivals, CanopyModel; nodes and values are elsewhere. */
#include "canopy/trace.h"

#include <stddef.h>

#include "canopy/e2e.h"
#include "trace_parts.h"

enum { HAS_SNAPSHOT = 0x40, HAS_CHANGES = 0x80 };            /* of CanopyTick's byte 6 */
enum { OVERLOAD = 0x08, RETURNING = 0x10, MANY = 0x80 };     /* of CanopyInputs' byte 5 */
enum { AGES_AT = 5, AGES_IN_INPUTS = 2, AGES_AND_MORE = 3 }; /* bits 5 and 6 there */
enum { ANNOUNCEMENTS = 3 };                                  /* of another tree: in so many ticks */
enum { AGES_IN_FRAME = 7, LAST = 0x80, LONG_AGE = 255, MANY_FRAMES = 256 };

static void send_tick(const canopy_trace_sink_t *sink, const canopy_trace_tick_t *tick, unsigned flags, uint8_t values)
{
    const canopy_trace_config_t *config = sink->config;
    canopy_trace_state_t *state = sink->state;
    canopy_tx_trace_data_t data = {{0, CANOPY_TRACE_VERSION << 4}};
    unsigned number = canopy_trace_number(state);

    if (tick->tick == 0u && number == 0u && state->has_begun) {
        number = canopy_trace_number(state); /* 0 and 0 together is the start, not tick 2^32 */
    }
    state->has_begun = true;
    canopy_trace_put16(&data.byte[2], tick->tick);
    canopy_trace_put16(&data.byte[4], tick->tick >> 16);
    data.byte[6] = (uint8_t)(number | flags);
    data.byte[7] = (uint8_t)((unsigned)tick->root | ((unsigned)values << 3) | ((tick->overruns & 3u) << 6));
    if (config->data_id != CANOPY_E2E_NONE) {
        canopy_e2e_protect((uint16_t)config->data_id, state->counter, data.byte, CANOPY_TX_TRACE_LENGTH);
        state->counter = state->counter + 1u < CANOPY_E2E_COUNTERS ? (uint8_t)(state->counter + 1u) : 0u;
    }
    canopy_trace_post(sink, CANOPY_TRACE_TICK, &data);
}

/** The list of ages: first in CanopyInputs, then in CanopyArrivals. */
typedef struct {
    const canopy_trace_sink_t *sink;
    canopy_tx_trace_data_t data;
    uint8_t filled;
    bool in_inputs;
} ages_t;

static void end_arrivals(ages_t *self, unsigned last)
{
    self->data.byte[0] = (uint8_t)((self->sink->tick & 15u) | ((unsigned)self->filled << 4) | last);
    for (unsigned byte = 1u + self->filled; byte < (unsigned)CANOPY_TX_TRACE_LENGTH; byte++) {
        self->data.byte[byte] = 0;
    }
    canopy_trace_post(self->sink, CANOPY_TRACE_ARRIVALS, &self->data);
}

static void end_inputs(ages_t *self, unsigned ages)
{
    self->data.byte[5] = (uint8_t)(self->data.byte[5] | (ages << AGES_AT));
    canopy_trace_post(self->sink, CANOPY_TRACE_INPUTS, &self->data);
}

static void put_age_byte(ages_t *self, uint32_t value)
{
    if (self->in_inputs && self->filled == (uint8_t)AGES_IN_INPUTS) {
        end_inputs(self, AGES_AND_MORE);
        self->in_inputs = false;
        self->filled = 0;
    } else if (!self->in_inputs && self->filled == (uint8_t)AGES_IN_FRAME) {
        end_arrivals(self, 0);
        self->filled = 0;
    }
    self->data.byte[(self->in_inputs ? 6u : 1u) + self->filled] = (uint8_t)(value & 0xFFu);
    self->filled++;
}

static void put_age(ages_t *self, uint16_t age_ms)
{
    if (age_ms < (uint16_t)LONG_AGE) {
        put_age_byte(self, age_ms);
        return;
    }
    put_age_byte(self, LONG_AGE);
    put_age_byte(self, age_ms);
    put_age_byte(self, (uint32_t)age_ms >> 8);
}

/** What the tick worked with: time, frames and their ages, the state of the bus. */
static void send_inputs(const canopy_trace_sink_t *sink, const canopy_trace_tick_t *tick)
{
    const canopy_bus_state_t *bus = tick->bus;
    uint32_t now = (uint32_t)(tick->cycle->now & UINT32_MAX);
    uint32_t frames = bus->taken - sink->state->taken;
    ages_t ages = {.sink = sink, .in_inputs = true};

    sink->state->taken = bus->taken;
    canopy_trace_put16(&ages.data.byte[0], now);
    ages.data.byte[2] = (uint8_t)((now >> 16) & 0xFFu);
    ages.data.byte[3] = (uint8_t)(bus->taken & 0xFFu);
    ages.data.byte[4] = bus->check;
    ages.data.byte[5] = (uint8_t)((unsigned)tick->cycle->can_state | (tick->cycle->overload ? (unsigned)OVERLOAD : 0u) |
                                  (tick->returning ? (unsigned)RETURNING : 0u) |
                                  (frames >= (uint32_t)MANY_FRAMES ? (unsigned)MANY : 0u));
    if (frames >= (uint32_t)MANY_FRAMES) {
        for (unsigned byte = 0; byte < 4u; byte++) {
            put_age_byte(&ages, frames >> (8u * byte));
        }
    }
    for (uint16_t index = 0; index < bus->bus->rx_count && frames > 0u; index++) {
        if (bus->rx[index].taken_then) {
            put_age(&ages, bus->rx[index].age_ms);
        }
    }
    if (ages.in_inputs) {
        end_inputs(&ages, ages.filled);
    } else {
        end_arrivals(&ages, LAST);
    }
}

static void send_model(const canopy_trace_sink_t *sink)
{
    const canopy_tree_t *tree = sink->tree->tree;
    canopy_tx_trace_data_t data = {{CANOPY_TRACE_VERSION << 4}};

    canopy_trace_put16(&data.byte[1], tree->hash);
    canopy_trace_put16(&data.byte[3], tree->hash >> 16);
    canopy_trace_put16(&data.byte[5], tree->node_count);
    canopy_trace_post(sink, CANOPY_TRACE_MODEL, &data);
}

static void send_clock(const canopy_trace_sink_t *sink, uint32_t upper)
{
    canopy_tx_trace_data_t data = {{(CANOPY_TRACE_VERSION << 4) | 1u}};

    canopy_trace_put16(&data.byte[1], sink->tick);
    canopy_trace_put16(&data.byte[3], upper);
    data.byte[5] = (uint8_t)((upper >> 16) & 0xFFu);
    canopy_trace_post(sink, CANOPY_TRACE_MODEL, &data);
}

/** Which tree this is, at a slow rate, and the upper bits of the time, also when they change. */
static void send_slow(const canopy_trace_sink_t *sink, canopy_time_t now)
{
    canopy_trace_state_t *state = sink->state;
    uint32_t upper = (uint32_t)((now >> 24) & 0xFFFFFFu);
    bool is_due = canopy_trace_is_due(&state->model_in, sink->config->model_every);

    if (state->announcements > 0u) {
        state->announcements--;
        is_due = true;
    }
    if (is_due) {
        send_model(sink);
    }
    if (is_due || upper != state->upper) {
        send_clock(sink, upper);
        state->upper = upper;
    }
}

void canopy_trace_send(const canopy_trace_config_t *config, canopy_trace_state_t *self, canopy_tree_instance_t *tree,
                       canopy_tx_t *tx, const canopy_trace_tick_t *tick)
{
    const canopy_trace_sink_t sink = {
        .config = config, .state = self, .tree = tree, .tx = tx, .until = tick->until, .tick = tick->tick};
    bool shows = canopy_trace_is_due(&self->snapshot_in, config->snapshot_every);
    canopy_trace_choice_t choice = {.count = 0};
    canopy_tx_trace_data_t snapshot;
    uint16_t first;

    if (shows) {
        canopy_trace_show(&sink, &snapshot); /* before the statuses are marked as old */
    }
    first = canopy_trace_first_change(self, tree);
    if (config->value_count > 0u) {
        canopy_trace_choose(config, self, tree->application, &choice);
    }
    send_tick(&sink, tick,
              (shows ? (unsigned)HAS_SNAPSHOT : 0u) | (first < tree->tree->node_count ? (unsigned)HAS_CHANGES : 0u),
              choice.count);
    send_inputs(&sink, tick);
    send_slow(&sink, tick->cycle->now);
    if (shows) {
        snapshot.byte[0] = canopy_trace_number(self);
        canopy_trace_post(&sink, CANOPY_TRACE_SNAPSHOT, &snapshot);
    }
    if (first < tree->tree->node_count) {
        canopy_trace_changes(&sink, first);
    }
    if (choice.count > 0u) {
        canopy_trace_values(&sink, tree->application, &choice);
    }
}

void canopy_trace_start(const canopy_trace_config_t *config, canopy_trace_state_t *self, uint16_t nodes)
{
    *self = (canopy_trace_state_t){.sent = self->sent, .told = self->told};
    for (uint16_t node = 0; node < nodes; node++) {
        self->sent[node] = (uint8_t)CANOPY_STATUS_NEVER;
    }
    for (uint16_t slot = 0; slot < config->value_count; slot++) {
        self->told[slot] = 0;
    }
}

void canopy_trace_follow_exchange(canopy_trace_state_t *self)
{
    self->next_node = 0;
    self->next_shown = 0;
    self->snapshot_in = 0;
    self->announcements = (uint8_t)ANNOUNCEMENTS;
}
