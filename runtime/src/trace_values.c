/* SPDX-License-Identifier: MIT */
/** @file Entries and reasons in the trace: those that have changed, in turn, and slowly all of them. */
#include <stddef.h>
#include <string.h>

#include "trace_parts.h"

static uint32_t extended(uint32_t value, unsigned bits, bool is_signed)
{
    uint32_t sign = UINT32_C(1) << (bits - 1u);

    return is_signed ? (value ^ sign) - sign : value;
}

/** The value as the trace tells it. */
static uint32_t read(const canopy_trace_value_t *value, const void *memory)
{
    const uint8_t *from = (const uint8_t *)memory + value->offset;
    uint8_t byte;
    uint16_t half;
    uint32_t word;
    uint64_t whole;

    switch (value->size) {
    case sizeof byte:
        memcpy(&byte, from, sizeof byte);
        return extended(byte, 8, value->is_signed);
    case sizeof half:
        memcpy(&half, from, sizeof half);
        return extended(half, 16, value->is_signed);
    case sizeof word:
        memcpy(&word, from, sizeof word);
        return word;
    default:
        memcpy(&whole, from, sizeof whole);
        return (uint32_t)((value->is_high ? whole >> 32 : whole) & UINT32_MAX);
    }
}

static uint16_t after(uint16_t slot, uint16_t count)
{
    return slot + 1u < count ? (uint16_t)(slot + 1u) : 0u;
}

static void choose(canopy_trace_choice_t *choice, uint16_t slot)
{
    choice->slot[choice->count] = slot;
    choice->count++;
}

void canopy_trace_choose(const canopy_trace_config_t *config, canopy_trace_state_t *state, const void *memory,
                         canopy_trace_choice_t *choice)
{
    uint16_t refreshed = UINT16_MAX;
    uint16_t slot = state->next_value;

    if (canopy_trace_is_due(&state->value_in, config->values_every)) {
        refreshed = state->next_refresh;
        state->next_refresh = after(refreshed, config->value_count);
        choose(choice, refreshed);
    }
    for (uint16_t seen = 0; seen < config->value_count; seen++) {
        if (slot != refreshed && read(&config->values[slot], memory) != state->told[slot]) {
            if (choice->count == config->values_max) {
                choice->waiting = true;
                break;
            }
            choose(choice, slot);
        }
        slot = after(slot, config->value_count);
    }
    state->next_value = slot;
}

void canopy_trace_values(const canopy_trace_sink_t *sink, const void *memory, const canopy_trace_choice_t *choice)
{
    canopy_tx_trace_data_t data = {{0}};

    for (uint8_t number = 0; number < choice->count; number++) {
        uint16_t slot = choice->slot[number];
        uint32_t value = read(&sink->config->values[slot], memory);

        sink->state->told[slot] = value;
        canopy_trace_put16(&data.byte[0], slot | ((sink->tick & 15u) << 12));
        data.byte[2] = choice->waiting ? 1u : 0u;
        canopy_trace_put16(&data.byte[4], value);
        canopy_trace_put16(&data.byte[6], value >> 16);
        canopy_trace_post(sink, CANOPY_TRACE_VALUE, &data);
    }
}
