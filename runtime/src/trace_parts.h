/* SPDX-License-Identifier: MIT */
/** @file What the trace's files share: where frames go, and how numbers are written. Private to the runtime. */
#ifndef CANOPY_TRACE_PARTS_H
#define CANOPY_TRACE_PARTS_H

#include "canopy/loop.h"
#include "canopy/trace.h"

/** Sequence is counted modulo 64. */
#define CANOPY_TRACE_SEQUENCE_MASK 63u

/** A tick's trace on its way. */
typedef struct {
    const canopy_trace_config_t *config;
    canopy_trace_state_t *state;
    canopy_tree_instance_t *tree;
    canopy_tx_t *tx;
    canopy_time_t until;
    uint32_t tick;
} canopy_trace_sink_t;

/** Values that a tick tells, chosen before CanopyTick announces them. */
typedef struct {
    uint16_t slot[CANOPY_TRACE_VALUES_MAX];
    uint8_t count;
    bool waiting; /**< More have changed than fit. */
} canopy_trace_choice_t;

static inline void canopy_trace_put16(uint8_t *data, uint32_t value)
{
    data[0] = (uint8_t)(value & 0xFFu);
    data[1] = (uint8_t)((value >> 8) & 0xFFu);
}

static inline void canopy_trace_post(const canopy_trace_sink_t *sink, canopy_trace_message_t message,
                                     const canopy_tx_trace_data_t *data)
{
    canopy_tx_trace(sink->tx, sink->config->id + (uint32_t)message, sink->config->flags, data, sink->until);
}

/** The sequence number of the next frame that has one. */
static inline uint8_t canopy_trace_number(canopy_trace_state_t *state)
{
    uint8_t number = state->sequence;

    state->sequence = (uint8_t)((number + 1u) & CANOPY_TRACE_SEQUENCE_MASK);
    return number;
}

/** Is what comes in every so-many-th tick due now? The first time, it is. */
static inline bool canopy_trace_is_due(uint16_t *left, uint16_t every)
{
    bool is_due = *left == 0u;

    *left = (uint16_t)((is_due ? every : *left) - 1u);
    return is_due;
}

/** Marks all nodes up to the first one whose status code is not the one told last. @return that one, or the number of nodes */
uint16_t canopy_trace_first_change(canopy_trace_state_t *state, const canopy_tree_instance_t *tree);

/** CanopyChange frames of nodes from `first` on, before which nothing has changed. Marks them. */
void canopy_trace_changes(const canopy_trace_sink_t *sink, uint16_t first);

/** A CanopySnapshot but for its number. Its nodes count as told. */
void canopy_trace_show(const canopy_trace_sink_t *sink, canopy_tx_trace_data_t *data);

/** Which values are told in this tick. */
void canopy_trace_choose(const canopy_trace_config_t *config, canopy_trace_state_t *state, const void *memory,
                         canopy_trace_choice_t *choice);

/** CanopyValue frames of these. */
void canopy_trace_values(const canopy_trace_sink_t *sink, const void *memory, const canopy_trace_choice_t *choice);

/** A page of CanopyHealth, when it is due. */
void canopy_trace_health(const canopy_loop_t *loop, canopy_time_t until);

#endif
