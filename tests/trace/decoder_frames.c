/* SPDX-License-Identifier: MIT */
/** @file The frames without a Sequence: CanopyInputs, CanopyArrivals, CanopyValue, CanopyHealth, CanopyModel. */
#include <string.h>

#include "decoder.h"

enum { AGES_ARE_MORE = 3, ARRIVAL_BYTES = 7 };

static void add_ages(decoder_inputs_t *inputs, const uint8_t *bytes, unsigned count)
{
    for (unsigned i = 0; i < count && inputs->age_bytes < DECODER_AGES_MAX; i++) {
        inputs->ages[inputs->age_bytes++] = bytes[i];
    }
}

bool decoder_inputs(decoder_t *self, const uint8_t *data)
{
    decoder_tick_t *tick = &self->tick;
    decoder_inputs_t *inputs = &tick->inputs;
    uint8_t ages = (data[5] >> 5) & 3u;

    if ((data[5] & 7u) > 6u) {
        return false;
    }
    if (!self->is_at_hand || tick->is_followed) {
        decoder_stray(self);
        return true;
    }
    inputs->came = true;
    inputs->now = decoder_u16(data) | ((uint32_t)data[2] << 16);
    inputs->taken = data[3];
    inputs->check = data[4];
    inputs->can_state = data[5] & 7u;
    inputs->overload = (data[5] & 0x08u) != 0;
    inputs->returning = (data[5] & 0x10u) != 0;
    inputs->many = (data[5] & 0x80u) != 0;
    tick->arrivals_open = ages == AGES_ARE_MORE;
    inputs->is_whole = !tick->arrivals_open;
    add_ages(inputs, &data[6], ages == AGES_ARE_MORE ? 2u : ages);
    return true;
}

bool decoder_arrivals(decoder_t *self, const uint8_t *data)
{
    decoder_tick_t *tick = &self->tick;
    unsigned bytes = (data[0] >> 4) & 7u;

    if (bytes == 0) {
        return false;
    }
    if (!self->has_ticked || (data[0] & 15u) != tick->number % 16u || tick->snapshot_came || tick->has_node ||
        tick->values_came > 0) {
        decoder_stray(self);
        return true;
    }
    if (self->is_at_hand && tick->arrivals_open) { /* without CanopyInputs nobody knows what these ages are */
        add_ages(&tick->inputs, &data[1], bytes);
        tick->arrivals_open = data[0] >> 7 == 0;
        tick->inputs.is_whole = !tick->arrivals_open;
        tick->inputs.is_sure = true;
    }
    return true;
}

bool decoder_value(decoder_t *self, const uint8_t *data)
{
    decoder_tick_t *tick = &self->tick;
    uint16_t slot = decoder_u16(data) & 0xFFFu;
    bool is_here;

    if (slot >= self->model->slot_count) {
        return false;
    }
    is_here = self->is_at_hand && data[1] >> 4 == tick->number % 16u && tick->values_came < tick->values;
    if (is_here && self->slots[slot].marked == self->mark) {
        return false;
    }
    if (!is_here) {
        decoder_stray(self);
        return true;
    }
    tick->arrivals_open = false; /* the rest of the ages would have come before */
    tick->values_came++;
    tick->inputs.is_sure = tick->inputs.came;
    tick->slots_wait = tick->slots_wait || (data[2] & 1u) != 0;
    self->slots[slot].told = decoder_u32(&data[4]);
    self->slots[slot].is_known = true;
    self->slots[slot].marked = self->mark;
    return true;
}

static void take_lateness(decoder_health_t *health, const uint8_t *data)
{
    for (unsigned i = 0; i < DECODER_BINS; i++) {
        health->lateness[i] = i % 2u == 0 ? data[1u + i / 2u] & 15u : data[1u + i / 2u] >> 4;
    }
}

bool decoder_health(decoder_t *self, const uint8_t *data)
{
    decoder_health_t *health = &self->health;
    uint16_t first = decoder_u16(&data[1]);
    uint16_t second = decoder_u16(&data[3]);
    uint16_t third = decoder_u16(&data[5]);

    switch (data[0] & 15u) {
    case 0:
        health->filtered = (data[0] & 0x10u) != 0;
        health->rx_rejected = first;
        health->rx_unknown = second;
        health->rx_lost = third;
        health->rx_backlogs = data[7];
        break;
    case 1:
        health->tx_replaced = first;
        health->tx_expired = second;
        health->trace_dropped = third;
        health->restarts = data[7];
        break;
    case 2:
        health->overruns = first;
        health->longest_cycle = decoder_u16(&data[3]) | ((uint32_t)data[5] << 16);
        health->latest_start = 10u * (uint32_t)decoder_u16(&data[6]);
        break;
    case 3:
        take_lateness(health, data);
        health->slips = data[7];
        break;
    case 4:
        health->leaf_faults = first;
        health->rx_errors = second;
        health->timeouts = third;
        break;
    default:
        return false;
    }
    health->pages |= (uint8_t)(1u << (data[0] & 15u));
    return true;
}

bool decoder_tree(decoder_t *self, const uint8_t *data)
{
    unsigned page = data[0] & 15u;

    if (data[0] >> 4 != DECODER_VERSION) {
        self->stop = DECODER_OTHER_VERSION;
    } else if (page == 0 &&
               (decoder_u32(&data[1]) != self->model->hash || decoder_u16(&data[5]) != self->model->node_count)) {
        self->stop = DECODER_OTHER_TREE;
    } else if (page == 1u) {
        self->has_upper = true;
        self->upper_tick = decoder_u16(&data[1]);
        self->upper_now = decoder_u16(&data[3]) | ((uint32_t)data[5] << 16);
    }
    return page <= 1u;
}
