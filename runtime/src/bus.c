/* SPDX-License-Identifier: MIT */
/** @file Frames into the input image, the output image into frames. */
#include "canopy/bus.h"

#include <stddef.h>

/** Order of the table: standard ids before extended ones. The driver's error frames are behind all: no message is one. */
static uint32_t rank(uint32_t id, uint8_t flags)
{
    uint32_t extended = (flags & CANOPY_CAN_EXTENDED) != 0u ? UINT32_C(0x40000000) : 0u;
    uint32_t error = (flags & CANOPY_CAN_ERROR) != 0u ? UINT32_C(0x80000000) : 0u;

    return id | extended | error;
}

static uint16_t find(const canopy_bus_t *bus, uint32_t wanted)
{
    uint16_t low = 0;
    uint16_t high = bus->rx_count;

    while (low < high) {
        uint16_t middle = (uint16_t)((low + high) / 2u);

        if (rank(bus->rx[middle].id, bus->rx[middle].flags) < wanted) {
            low = (uint16_t)(middle + 1u);
        } else {
            high = middle;
        }
    }
    if (low < bus->rx_count && rank(bus->rx[low].id, bus->rx[low].flags) == wanted) {
        return low;
    }
    return bus->rx_count;
}

static bool form_fits(const canopy_rx_message_t *message, const canopy_can_frame_t *frame)
{
    const uint8_t form = CANOPY_CAN_EXTENDED | CANOPY_CAN_FD | CANOPY_CAN_REMOTE;

    return (frame->flags & form) == message->flags && frame->length == message->length;
}

uint8_t canopy_bus_check(uint8_t check, uint32_t id, const uint8_t *data, uint8_t length)
{
    uint8_t result = (uint8_t)(((unsigned)check << 3) | ((unsigned)check >> 5));

    result ^= (uint8_t)(id & 0xFFu);
    for (uint8_t byte = 0; byte < length; byte++) {
        result ^= data[byte];
    }
    return result;
}

void canopy_bus_receive(canopy_bus_state_t *self, const canopy_can_frame_t *frame, canopy_time_t now)
{
    uint16_t index = find(self->bus, rank(frame->id, frame->flags));
    const canopy_rx_message_t *message;
    canopy_rx_state_t *state;

    if (index == self->bus->rx_count) {
        canopy_count(&self->counters.unknown_id);
        return;
    }
    message = &self->bus->rx[index];
    state = &self->rx[index];
    self->taken++;
    if (!form_fits(message, frame)) {
        canopy_count(&self->counters.wrong_form);
        return;
    }
    self->check = canopy_bus_check(self->check, frame->id, frame->data, frame->length);
    if (message->data_id != CANOPY_E2E_NONE) {
        canopy_e2e_result_t result =
            canopy_e2e_check(&state->e2e, (uint16_t)message->data_id, frame->data, frame->length);

        if (result != CANOPY_E2E_OK) {
            canopy_count(result == CANOPY_E2E_WRONG_CRC ? &self->counters.wrong_crc : &self->counters.wrong_sequence);
            return;
        }
    }
    if (!message->decode(self->input, frame->data)) {
        canopy_count(&self->counters.out_of_range);
        return;
    }
    canopy_count(&self->counters.accepted);
    state->received_at = now;
    state->received = true;
}

void canopy_bus_begin_tick(canopy_bus_state_t *self, canopy_time_t now)
{
    for (uint16_t index = 0; index < self->bus->rx_count; index++) {
        const canopy_rx_message_t *message = &self->bus->rx[index];
        canopy_rx_state_t *state = &self->rx[index];
        bool in_time = message->timeout == 0u || !canopy_time_reached(now, state->received_at + message->timeout);
        bool fresh = state->received && in_time;

        if (state->fresh && !fresh) {
            canopy_count(&self->counters.timeouts);
        }
        state->received = fresh;
        state->fresh = fresh;
        message->set_fresh(self->input, fresh);
    }
    self->bus->set_now(self->input, now);
    self->bus->reset_output(self->output);
}

void canopy_bus_commit(canopy_bus_state_t *self, const canopy_can_t *can, uint32_t tick)
{
    for (uint16_t index = 0; index < self->bus->tx_count; index++) {
        const canopy_tx_message_t *message = &self->bus->tx[index];
        canopy_can_frame_t frame;

        if (tick % message->every != 0u) {
            continue;
        }
        frame.id = message->id;
        frame.flags = message->flags;
        frame.length = message->length;
        message->encode(self->output, frame.data);
        if (message->data_id != CANOPY_E2E_NONE) {
            uint8_t counter = self->tx_counters[index];

            canopy_e2e_protect((uint16_t)message->data_id, counter, frame.data, frame.length);
            self->tx_counters[index] = (uint8_t)((counter + 1u) % CANOPY_E2E_COUNTERS);
        }
        canopy_count(can->send(can->context, &frame) == 1 ? &self->counters.sent : &self->counters.tx_dropped);
    }
}

uint32_t canopy_bus_rejected(const canopy_bus_counters_t *counters)
{
    return canopy_sum(canopy_sum(counters->wrong_form, counters->wrong_crc),
                      canopy_sum(counters->wrong_sequence, counters->out_of_range));
}
