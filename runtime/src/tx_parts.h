/* SPDX-License-Identifier: MIT */
/** @file What both sides of the transmit side know of a message's place. Private to the runtime. */
#ifndef CANOPY_TX_PARTS_H
#define CANOPY_TX_PARTS_H

#include "canopy/count.h"
#include "canopy/tx.h"

/** Versions are counted modulo this + 1: 30 bits, what canopy_tx_slot_t.latest has room for. */
#define CANOPY_TX_VERSION_MAX (UINT32_MAX >> 2)

/** The bytes of one of a message's two buffers. */
static inline uint8_t *canopy_tx_buffer(const canopy_tx_t *self, uint16_t index, uint32_t buffer)
{
    const canopy_tx_message_t *message = &self->messages[index];

    return &self->data[message->place + buffer * message->length];
}

/** As canopy_tx_counters_t.replaced. Loop's thread. */
static inline uint32_t canopy_tx_replaced(const canopy_tx_t *self)
{
    return canopy_sum(self->held, atomic_load_explicit(&self->replaced, memory_order_relaxed));
}

/** As canopy_tx_counters_t.expired. Loop's thread. */
static inline uint32_t canopy_tx_expired(const canopy_tx_t *self)
{
    return atomic_load_explicit(&self->expired, memory_order_relaxed);
}

#endif
