/* SPDX-License-Identifier: MIT */
/** @file The transmit side as the loop sees it; the contract, and why no value is torn, are in tx.h. */
#include "canopy/tx.h"

#include <stddef.h>

#include "canopy/count.h"
#include "tx_parts.h"

static void start_slot(canopy_tx_slot_t *slot)
{
    atomic_init(&slot->latest, 0u);
    atomic_init(&slot->out, UINT32_MAX);
    atomic_init(&slot->reading, 0u);
    slot->posted = 0;
    slot->owed_after = 0;
    slot->owes = false;
    slot->taken = 0;
    slot->counter = 0;
    slot->flying = false;
}

static void start_trace_and_counters(canopy_tx_t *self)
{
    self->trace_full = 0;
    self->held = 0;
    self->in_flight = 0;
    self->trace_flying = false;
    self->watching = false;
    atomic_init(&self->trace_stopped, false);
    atomic_init(&self->trace_head, 0u);
    atomic_init(&self->trace_tail, 0u);
    atomic_init(&self->busy, false);
    atomic_init(&self->blocked, false);
    atomic_init(&self->sent, 0u);
    atomic_init(&self->replaced, 0u);
    atomic_init(&self->expired, 0u);
    atomic_init(&self->trace_sent, 0u);
    atomic_init(&self->trace_late, 0u);
}

static uint8_t mailboxes_of(const canopy_can_t *can)
{
    if (can->outcome == NULL || can->mailboxes == 0u) {
        return 1;
    }
    return can->mailboxes < CANOPY_CAN_MAILBOXES_MAX ? can->mailboxes : (uint8_t)CANOPY_CAN_MAILBOXES_MAX;
}

canopy_error_t canopy_tx_init(canopy_tx_t *self, const canopy_tx_message_t *messages, uint16_t count,
                              const canopy_tx_memory_t *memory, const canopy_can_t *can)
{
    const uint32_t capacity = memory->trace_capacity;

    if (memory->trace == NULL || capacity == 0u || (capacity & (capacity - 1u)) != 0u) {
        return CANOPY_ERROR_ARGUMENT;
    }
    if (count != 0u && (memory->slots == NULL || memory->data == NULL)) {
        return CANOPY_ERROR_ARGUMENT;
    }
    self->messages = messages;
    self->can = can;
    self->slots = memory->slots;
    self->data = memory->data;
    self->trace = memory->trace;
    self->trace_mask = capacity - 1u;
    self->count = count;
    self->mailbox_count = mailboxes_of(can);
    start_trace_and_counters(self);
    for (unsigned mailbox = 0; mailbox < CANOPY_CAN_MAILBOXES_MAX; mailbox++) {
        self->mailboxes[mailbox] = (canopy_tx_mailbox_t){0};
    }
    for (uint16_t index = 0; index < count; index++) {
        start_slot(&self->slots[index]);
    }
    return CANOPY_OK;
}

void canopy_tx_post(canopy_tx_t *self, uint16_t message, const void *output, canopy_time_t until)
{
    canopy_tx_slot_t *slot = &self->slots[message];
    uint32_t buffer;

    atomic_store(&slot->latest, 0u);
    buffer = atomic_load(&slot->reading) == 1u;
    self->messages[message].encode(output, canopy_tx_buffer(self, message, buffer));
    slot->until[buffer] = until;
    slot->posted = (slot->posted + 1u) & CANOPY_TX_VERSION_MAX;
    atomic_store_explicit(&slot->latest, (slot->posted << 2) | (buffer << 1) | 1u, memory_order_release);
}

void canopy_tx_owe(canopy_tx_t *self)
{
    for (uint16_t index = 0; index < self->count; index++) {
        self->slots[index].owed_after = self->slots[index].posted;
        self->slots[index].owes = true;
    }
}

bool canopy_tx_owes(canopy_tx_t *self, uint16_t message)
{
    canopy_tx_slot_t *slot = &self->slots[message];
    uint32_t out = atomic_load_explicit(&slot->out, memory_order_relaxed);
    uint32_t since_out = (slot->posted - out) & CANOPY_TX_VERSION_MAX;
    uint32_t since_owed = (slot->posted - slot->owed_after) & CANOPY_TX_VERSION_MAX;

    slot->owes = slot->owes && (out == UINT32_MAX || since_out >= since_owed);
    return slot->owes;
}

void canopy_tx_hold(canopy_tx_t *self)
{
    canopy_count(&self->held);
}

void canopy_tx_trace(canopy_tx_t *self, uint32_t id, uint8_t flags, const canopy_tx_trace_data_t *data,
                     canopy_time_t until)
{
    const uint32_t head = atomic_load_explicit(&self->trace_head, memory_order_relaxed);
    canopy_tx_trace_t *frame = &self->trace[head & self->trace_mask];

    if (head - atomic_load_explicit(&self->trace_tail, memory_order_acquire) > self->trace_mask) {
        canopy_count(&self->trace_full);
        return;
    }
    frame->until = until;
    frame->id = id;
    frame->flags = flags;
    frame->data = *data;
    atomic_store_explicit(&self->trace_head, head + 1u, memory_order_release);
}

void canopy_tx_stop_trace(canopy_tx_t *self)
{
    atomic_store_explicit(&self->trace_stopped, true, memory_order_relaxed);
}

bool canopy_tx_is_out(const canopy_tx_t *self)
{
    for (uint16_t index = 0; index < self->count; index++) {
        const canopy_tx_slot_t *slot = &self->slots[index];
        bool posted = atomic_load_explicit(&slot->latest, memory_order_relaxed) != 0u;

        if (posted && atomic_load_explicit(&slot->out, memory_order_relaxed) != slot->posted) {
            return false;
        }
    }
    return true;
}

void canopy_tx_count(const canopy_tx_t *self, canopy_tx_counters_t *counters)
{
    counters->sent = atomic_load_explicit(&self->sent, memory_order_relaxed);
    counters->replaced = canopy_tx_replaced(self);
    counters->expired = canopy_tx_expired(self);
    counters->trace_sent = atomic_load_explicit(&self->trace_sent, memory_order_relaxed);
    counters->trace_dropped =
        canopy_sum(self->trace_full, atomic_load_explicit(&self->trace_late, memory_order_relaxed));
}
