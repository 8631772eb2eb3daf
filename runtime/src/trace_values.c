/* SPDX-License-Identifier: MIT */
/** @file Entries and reasons in the trace: those that have changed, in turn, and slowly all of them. */
#include <stddef.h>
#include <string.h>

#include "trace_parts.h"

/** A value that is not a whole number of 32 bits. By its own type, or, of floating point, byte by byte. */
static uint32_t read_other(const canopy_trace_value_t *value, const void *from)
{
    uint32_t word;
    uint64_t whole;

    switch ((canopy_trace_kind_t)value->kind) { /* not covered: no other value */
    case CANOPY_TRACE_U8:
        return *(const uint8_t *)from;
    case CANOPY_TRACE_I8:
        return (uint32_t)*(const int8_t *)from;
    case CANOPY_TRACE_U16:
        return *(const uint16_t *)from;
    case CANOPY_TRACE_I16:
        return (uint32_t)*(const int16_t *)from;
    case CANOPY_TRACE_LOW:
        return (uint32_t)(*(const uint64_t *)from & UINT32_MAX);
    case CANOPY_TRACE_HIGH:
        return (uint32_t)(*(const uint64_t *)from >> 32);
    case CANOPY_TRACE_FLOAT:
        memcpy(&word, from, sizeof word);
        return word;
    case CANOPY_TRACE_DOUBLE_LOW:
        memcpy(&whole, from, sizeof whole);
        return (uint32_t)(whole & UINT32_MAX);
    case CANOPY_TRACE_DOUBLE_HIGH:
        memcpy(&whole, from, sizeof whole);
        return (uint32_t)(whole >> 32);
    case CANOPY_TRACE_WORD: /* not covered: not here */
        break;
    }
    return 0; /* not covered: no other value */
}

/** The value as the trace tells it. */
static inline uint32_t read(const canopy_trace_value_t *value, const void *memory)
{
    const void *from = (const uint8_t *)memory + value->offset;

    return value->kind == (uint8_t)CANOPY_TRACE_WORD ? *(const uint32_t *)from : read_other(value, from);
}

static void choose(canopy_trace_choice_t *choice, uint16_t slot)
{
    choice->slot[choice->count] = slot;
    choice->count++;
}

/** Chooses the changed values in [from, to). @return the first one for which there is no room, or `to` */
static uint16_t choose_changed(const canopy_trace_config_t *config, const canopy_trace_state_t *state,
                               const void *memory, canopy_trace_choice_t *choice, uint16_t from, uint16_t to)
{
    const uint32_t *told = state->told;
    const canopy_trace_value_t *values = config->values;

    for (uint16_t slot = from; slot < to; slot++) {
        if (read(&values[slot], memory) == told[slot] || (choice->count > 0u && slot == choice->slot[0])) {
            continue;
        }
        if (choice->count == config->values_max) {
            choice->waiting = true;
            return slot;
        }
        choose(choice, slot);
    }
    return to;
}

void canopy_trace_choose(const canopy_trace_config_t *config, canopy_trace_state_t *state, const void *memory,
                         canopy_trace_choice_t *choice)
{
    uint16_t count = config->value_count;
    uint16_t start = state->next_value;

    if (canopy_trace_is_due(&state->value_in, config->values_every)) {
        choose(choice, state->next_refresh);
        state->next_refresh = state->next_refresh + 1u < count ? (uint16_t)(state->next_refresh + 1u) : 0u;
    }
    state->next_value = choose_changed(config, state, memory, choice, start, count);
    if (!choice->waiting) {
        state->next_value = choose_changed(config, state, memory, choice, 0, start);
    }
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
