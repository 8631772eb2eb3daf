/* SPDX-License-Identifier: MIT */
/** @file Frames into the input image, the output image into frames. */
#include "canopy/bus.h"

#include <stddef.h>

#include "bus_parts.h"

#define MS UINT32_C(1000) /* [us] */

/** Order of the table: standard ids before extended ones, and behind all the driver's error frames: no message is one. */
static uint32_t rank(uint32_t id, uint8_t flags)
{
    return id | ((uint32_t)(flags & (CANOPY_CAN_EXTENDED | CANOPY_CAN_ERROR)) << 29);
}

static uint32_t rank_at(const canopy_bus_t *bus, uint16_t index)
{
    return rank(bus->rx[index].id, bus->rx[index].flags);
}

/** How many messages are one id each; the masked ones are behind them. */
static uint16_t exact_count(const canopy_bus_t *bus)
{
    return (uint16_t)(bus->rx_count - bus->rx_masked);
}

/** The message with this rank; `rx_count`: there is none. */
static uint16_t search(const canopy_bus_t *bus, uint32_t wanted)
{
    uint16_t low = 0;
    uint16_t high = exact_count(bus);

    while (low < high) {
        uint16_t middle = (uint16_t)((low + high) / 2u);

        if (rank_at(bus, middle) < wanted) {
            low = (uint16_t)(middle + 1u);
        } else {
            high = middle;
        }
    }
    return low < exact_count(bus) && rank_at(bus, low) == wanted ? low : bus->rx_count;
}

/**
 * As search(). Frames that wait at the same time come in the order of their ids, so the next message of the table is a good
 * guess, in each cycle from the first one on.
 */
static uint16_t find_exact(canopy_bus_state_t *self, uint32_t wanted)
{
    const canopy_bus_t *bus = self->bus;
    uint16_t index = self->expected;

    if (index >= exact_count(bus) || rank_at(bus, index) != wanted) {
        index = search(bus, wanted);
    }
    if (index < bus->rx_count) {
        self->expected = (uint16_t)(index + 1u);
    }
    return index;
}

/** The first message of whose id only a part counts, that the frame can be. */
static uint16_t find_masked(const canopy_bus_t *bus, const canopy_can_frame_t *frame)
{
    const uint8_t form = CANOPY_CAN_EXTENDED | CANOPY_CAN_ERROR;
    uint16_t index = exact_count(bus);

    if ((frame->flags & form) != CANOPY_CAN_EXTENDED) {
        return bus->rx_count;
    }
    while (index < bus->rx_count && (frame->id & bus->rx[index].mask) != bus->rx[index].id) {
        index++;
    }
    return index;
}

static uint16_t find(canopy_bus_state_t *self, const canopy_can_frame_t *frame)
{
    uint16_t index = find_exact(self, rank(frame->id, frame->flags));

    return index < self->bus->rx_count ? index : find_masked(self->bus, frame);
}

static bool form_fits(const canopy_rx_message_t *message, const canopy_can_frame_t *frame)
{
    const uint8_t form = CANOPY_CAN_EXTENDED | CANOPY_CAN_FD | CANOPY_CAN_REMOTE;

    return (frame->flags & form) == message->flags && frame->length >= message->length &&
           frame->length <= message->length + message->more;
}

uint8_t canopy_bus_check(uint8_t check, uint32_t id, const uint8_t *data, uint16_t length)
{
    uint8_t result = (uint8_t)(((unsigned)check << 3) | ((unsigned)check >> 5));

    result ^= (uint8_t)(id & 0xFFu);
    for (uint16_t byte = 0; byte < length; byte++) {
        result ^= data[byte];
    }
    return result;
}

/** An age in whole ms, rounded up; CANOPY_AGE_MAX at most. */
static uint16_t age_in_ms(canopy_time_t age)
{
    if (age <= MS * (CANOPY_AGE_MAX - 1u)) {
        return (uint16_t)(((uint32_t)age + MS - 1u) / MS); /* in 32 bits: there is a divider for them */
    }
    return canopy_time_reached(age, 0) ? CANOPY_AGE_MAX : 0u; /* 0: it has come since the cycle began */
}

/** Notes when the values arrived that are in the input image now. What is not told in whole ms is not known. */
static void note_arrival(canopy_rx_state_t *state, const canopy_rx_message_t *message, uint16_t age, canopy_time_t now)
{
    state->age_ms = age;
    state->arrived_at = now - MS * age;
    state->received = age < CANOPY_AGE_MAX || message->timeout == 0u;
}

/** Notes that something has come with the id of a message. */
static void note_taken(canopy_bus_state_t *self, uint16_t index)
{
    self->taken++;
    self->rx[index].taken = true;
}

static inline void take_content(canopy_bus_state_t *self, uint16_t index, const canopy_bus_content_t *content,
                                canopy_time_t now)
{
    const canopy_rx_message_t *message = &self->bus->rx[index];
    canopy_rx_state_t *state = &self->rx[index];

    self->check = canopy_bus_check(self->check, content->id, content->data, content->length);
    if (message->data_id != CANOPY_E2E_NONE) {
        canopy_e2e_result_t result =
            canopy_e2e_check(&state->e2e, (uint16_t)message->data_id, content->data, (uint8_t)content->length);

        if (result != CANOPY_E2E_OK) {
            canopy_count(result == CANOPY_E2E_WRONG_CRC ? &self->counters.wrong_crc : &self->counters.wrong_sequence);
            return;
        }
    }
    if (!message->decode(self->input, content->data)) {
        canopy_count(&self->counters.out_of_range);
        return;
    }
    canopy_count(&self->counters.accepted);
    note_arrival(state, message, age_in_ms(now - content->time), now);
}

void canopy_bus_take(canopy_bus_state_t *self, uint16_t index, const canopy_bus_content_t *content, canopy_time_t now)
{
    note_taken(self, index);
    take_content(self, index, content, now);
}

void canopy_bus_receive(canopy_bus_state_t *self, const canopy_can_frame_t *frame, canopy_time_t now)
{
    uint16_t index;

    if (self->bus->transport_count != 0u && canopy_transport_take(self, frame, now)) {
        return;
    }
    index = find(self, frame);
    if (index == self->bus->rx_count) {
        canopy_count(&self->counters.unknown_id);
        return;
    }
    note_taken(self, index);
    if (!form_fits(&self->bus->rx[index], frame)) {
        canopy_count(&self->counters.wrong_form);
        return;
    }
    take_content(
        self, index,
        &(canopy_bus_content_t){.time = frame->time, .data = frame->data, .id = frame->id, .length = frame->length},
        now);
}

/** What a replay must know of a message in this tick goes into the check. */
static void check_age(canopy_bus_state_t *self, uint16_t age_ms)
{
    const uint8_t age[2] = {(uint8_t)(age_ms & 0xFFu), (uint8_t)(age_ms >> 8)};

    self->check = canopy_bus_check(self->check, 0, age, sizeof age);
}

static void begin_message(canopy_bus_state_t *self, const canopy_rx_message_t *message, canopy_rx_state_t *state,
                          canopy_time_t now)
{
    canopy_time_t age = now - state->arrived_at;
    bool fresh = state->received && (message->timeout == 0u || age < message->timeout);

    if (state->fresh && !fresh) {
        canopy_count(&self->counters.timeouts);
    }
    state->received = fresh;
    state->fresh = fresh;
    message->set_age(self->input, fresh, fresh ? age_in_ms(age) : CANOPY_AGE_MAX);
    if (state->taken) {
        check_age(self, state->age_ms);
    }
    state->taken_then = state->taken;
    state->taken = false;
}

void canopy_bus_begin_tick(canopy_bus_state_t *self, const canopy_cycle_t *cycle)
{
    const canopy_bus_t *bus = self->bus;
    const canopy_time_t now = cycle->now;

    for (uint32_t index = 0; index < bus->rx_count; index++) {
        begin_message(self, &bus->rx[index], &self->rx[index], now);
    }
    self->expected = 0;
    self->check = canopy_bus_check(self->check, (uint32_t)cycle->can_state | (cycle->overload ? 8u : 0u), NULL, 0);
    self->bus->set_cycle(self->input, cycle);
    self->bus->reset_output(self->output);
}

void canopy_bus_commit(const canopy_bus_state_t *self, canopy_tx_t *tx, uint32_t tick, canopy_time_t now)
{
    const canopy_bus_t *bus = self->bus;

    for (uint16_t index = 0; index < bus->tx_count; index++) {
        const canopy_tx_message_t *message = &bus->tx[index];

        if (tick % message->every == 0u) {
            canopy_tx_post(tx, index, self->output, now + message->deadline);
        }
    }
}

void canopy_bus_commit_all(const canopy_bus_state_t *self, canopy_tx_t *tx, canopy_time_t until)
{
    for (uint16_t index = 0; index < self->bus->tx_count; index++) {
        canopy_tx_post(tx, index, self->output, until);
    }
}

void canopy_bus_commit_owed(const canopy_bus_state_t *self, canopy_tx_t *tx, canopy_time_t until)
{
    for (uint16_t index = 0; index < self->bus->tx_count; index++) {
        if (canopy_tx_owes(tx, index)) {
            canopy_tx_post(tx, index, self->output, until);
        } else {
            canopy_tx_hold(tx);
        }
    }
}

uint32_t canopy_bus_rejected(const canopy_bus_counters_t *counters)
{
    return canopy_sum(canopy_sum(counters->wrong_form, counters->wrong_crc),
                      canopy_sum(counters->wrong_sequence, counters->out_of_range));
}
