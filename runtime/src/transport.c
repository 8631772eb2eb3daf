/* SPDX-License-Identifier: MIT */
/** @file Broadcasts of several packets (SAE J1939-21, 5.10): packets into a buffer, the whole into the input image. */
#include "canopy/transport.h"

#include "bus_parts.h"

/** Bits of an id: data page and PDU format with specific part, and what the message's id has of the announcement's. */
#define GROUP_BITS UINT32_C(0x03FFFF00)
#define SENDER_BITS UINT32_C(0x1C0000FF)
#define FOR_ALL UINT32_C(0xFF00)

enum { ANNOUNCEMENT = 0xEC, PACKET = 0xEB, BROADCAST = 32, PACKET_BYTES = 7, FRAME_BYTES = 8, ADDRESSED_TO = 240 };

static bool is_for_all(const canopy_can_frame_t *frame, uint32_t format)
{
    const uint8_t form = CANOPY_CAN_EXTENDED | CANOPY_CAN_FD | CANOPY_CAN_REMOTE | CANOPY_CAN_ERROR;

    return (frame->flags & form) == CANOPY_CAN_EXTENDED && (frame->id & GROUP_BITS) == ((format << 16) | FOR_ALL) &&
           frame->length == FRAME_BYTES;
}

static uint8_t source_of(const canopy_can_frame_t *frame)
{
    return (uint8_t)(frame->id & 0xFFu);
}

/** The id that a frame of the announced group would have, of one that goes to all. */
static uint32_t announced_id(const canopy_can_frame_t *frame)
{
    uint32_t id = (frame->id & SENDER_BITS) | ((uint32_t)frame->data[5] << 8) | ((uint32_t)frame->data[6] << 16) |
                  ((uint32_t)(frame->data[7] & 3u) << 24);

    return frame->data[6] < ADDRESSED_TO ? id | FOR_ALL : id;
}

static const canopy_rx_message_t *message_of(const canopy_bus_state_t *self, uint16_t index)
{
    return &self->bus->rx[self->bus->transports[index].message];
}

/** Which of the messages of several packets is announced; how many there are: none. */
static uint16_t find_announced(const canopy_bus_state_t *self, uint32_t id)
{
    uint16_t index = 0;

    while (index < self->bus->transport_count) {
        const canopy_rx_message_t *message = message_of(self, index);

        if (((id ^ message->id) & message->mask) == 0u) {
            break;
        }
        index++;
    }
    return index;
}

/** The one of which a source is sending packets; how many there are: none. */
static uint16_t find_open(const canopy_bus_state_t *self, uint8_t source)
{
    uint16_t index = 0;

    while (index < self->bus->transport_count &&
           (self->transports[index].size == 0u || self->transports[index].source != source)) {
        index++;
    }
    return index;
}

static void announce(canopy_bus_state_t *self, const canopy_can_frame_t *frame)
{
    uint16_t old = find_open(self, source_of(frame));
    uint16_t index = find_announced(self, announced_id(frame));
    uint16_t size = (uint16_t)(frame->data[1] | ((unsigned)frame->data[2] << 8));
    const canopy_rx_message_t *message;

    if (old < self->bus->transport_count) { /* a new broadcast ends the one before */
        self->transports[old].size = 0;
        canopy_count(&self->counters.wrong_sequence);
    }
    if (frame->data[0] != BROADCAST || index == self->bus->transport_count) {
        canopy_count(&self->counters.unknown_id);
        return;
    }
    message = message_of(self, index);
    if (size != message->length || frame->data[3] != (size + PACKET_BYTES - 1u) / PACKET_BYTES) {
        canopy_count(&self->counters.wrong_form);
        return;
    }
    self->transports[index] = (canopy_transport_state_t){
        .announced_at = frame->time, .last_at = frame->time, .size = size, .source = source_of(frame), .next = 1};
}

static bool is_next(const canopy_transport_state_t *state, const canopy_can_frame_t *frame)
{
    return frame->data[0] == state->next && !canopy_time_reached(frame->time, state->last_at + CANOPY_TRANSPORT_GAP_US);
}

/** Puts the packet's bytes behind those that are there. */
static void add(canopy_transport_state_t *state, uint8_t *target, const canopy_can_frame_t *frame)
{
    for (uint8_t byte = 1; byte <= PACKET_BYTES && state->received < state->size; byte++) {
        target[state->received++] = frame->data[byte];
    }
    state->last_at = frame->time;
    state->next++;
}

static void take_packet(canopy_bus_state_t *self, const canopy_can_frame_t *frame, canopy_time_t now)
{
    uint16_t index = find_open(self, source_of(frame));
    const canopy_transport_t *transport;
    canopy_transport_state_t *state;

    if (index == self->bus->transport_count) {
        canopy_count(&self->counters.unknown_id);
        return;
    }
    transport = &self->bus->transports[index];
    state = &self->transports[index];
    if (!is_next(state, frame)) {
        state->size = 0;
        canopy_count(&self->counters.wrong_sequence);
        return;
    }
    add(state, &self->transport_data[transport->place], frame);
    if (state->received == state->size) {
        const canopy_bus_content_t content = {.time = state->announced_at,
                                              .data = &self->transport_data[transport->place],
                                              .id = state->source,
                                              .length = state->size};

        state->size = 0;
        canopy_bus_take(self, transport->message, &content, now);
    }
}

bool canopy_transport_take(canopy_bus_state_t *self, const canopy_can_frame_t *frame, canopy_time_t now)
{
    if (is_for_all(frame, ANNOUNCEMENT)) {
        announce(self, frame);
        return true;
    }
    if (is_for_all(frame, PACKET)) {
        take_packet(self, frame, now);
        return true;
    }
    return false;
}
