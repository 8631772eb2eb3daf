/* SPDX-License-Identifier: MIT */
/** @file The transmit context: from what was posted to the driver's mailboxes. The contract is in tx.h. */
#include <stddef.h>
#include <string.h>

#include "canopy/count.h"
#include "canopy/e2e.h"
#include "canopy/tx.h"
#include "tx_parts.h"

enum { NO_MAILBOX = CANOPY_CAN_MAILBOXES_MAX };

/* For a counter with a single writer: a load and a store cannot lose anything. It saturates. */
static void add(_Atomic uint32_t *counter, uint32_t more)
{
    uint32_t value = atomic_load_explicit(counter, memory_order_relaxed);

    atomic_store_explicit(counter, canopy_sum(value, more), memory_order_relaxed);
}

/** A frame was handed over and is not out at once: when nothing is out at its deadline, the bus is blocked. */
static void watch(canopy_tx_t *self, canopy_time_t until)
{
    if (!self->watching || !canopy_time_reached(until, self->watched_until)) {
        self->watching = true;
        self->watched_until = until;
    }
}

/** A newer value than `version` is there, or is being written. */
static bool is_replaced(const canopy_tx_slot_t *slot, uint32_t version)
{
    return atomic_load_explicit(&slot->latest, memory_order_relaxed) >> 2 != version;
}

static bool waits(const canopy_tx_slot_t *slot)
{
    uint32_t latest = atomic_load_explicit(&slot->latest, memory_order_relaxed);

    return latest != 0u && latest >> 2 != slot->taken && !slot->flying;
}

/** The most urgent message that waits, from `index` on; `count`: none. */
static uint16_t next_message(const canopy_tx_t *self, uint16_t index)
{
    while (index < self->count && !waits(&self->slots[index])) {
        index++;
    }
    return index;
}

/** The oldest trace frame gives up its place. */
static void forget_trace(canopy_tx_t *self)
{
    uint32_t tail = atomic_load_explicit(&self->trace_tail, memory_order_relaxed);

    atomic_store_explicit(&self->trace_tail, tail + 1u, memory_order_release);
}

/** A frame is out: the bus lets frames through. */
static void note_out(canopy_tx_t *self, const canopy_tx_mailbox_t *box)
{
    if (box->what == CANOPY_TX_TRACE) {
        forget_trace(self);
        add(&self->trace_sent, 1u);
    } else {
        canopy_tx_slot_t *slot = &self->slots[box->what - 1u];

        atomic_store_explicit(&slot->out, box->version, memory_order_relaxed);
        slot->counter = (uint8_t)(slot->counter + 1u < CANOPY_E2E_COUNTERS ? slot->counter + 1u : 0u);
        add(&self->sent, 1u);
    }
    self->watching = false;
    atomic_store_explicit(&self->blocked, false, memory_order_relaxed);
}

/** A command is not out and never will be; a trace frame just waits again. */
static void note_aborted(canopy_tx_t *self, const canopy_tx_mailbox_t *box, canopy_time_t now)
{
    canopy_tx_slot_t *slot = &self->slots[box->what - 1u];

    if (canopy_time_reached(now, box->until)) {
        add(&self->expired, 1u);
    } else if (is_replaced(slot, box->version)) {
        add(&self->replaced, 1u);
    } else {
        slot->taken = (box->version - 1u) & CANOPY_TX_VERSION_MAX; /* it waits again */
    }
}

static void set_flying(canopy_tx_t *self, const canopy_tx_mailbox_t *box, bool flying)
{
    if (box->what == CANOPY_TX_TRACE) {
        self->trace_flying = flying;
    } else {
        self->slots[box->what - 1u].flying = flying;
    }
}

/** Takes note of what has become of the frame in a mailbox, which `box` describes. */
static canopy_can_outcome_t settle(canopy_tx_t *self, uint8_t mailbox, const canopy_tx_mailbox_t *box,
                                   canopy_time_t now)
{
    const canopy_can_t *can = self->can;
    canopy_can_outcome_t outcome = can->outcome(can->context, mailbox);

    if (outcome == CANOPY_CAN_PENDING) {
        return outcome;
    }
    set_flying(self, box, false);
    if (outcome == CANOPY_CAN_SENT) {
        note_out(self, box);
    } else if (box->what != CANOPY_TX_TRACE) {
        note_aborted(self, box, now);
    }
    self->mailboxes[mailbox].what = 0;
    return outcome;
}

/** Asks for a frame back. @return true: the mailbox is free already. */
static bool take_back(canopy_tx_t *self, uint8_t mailbox, canopy_time_t now)
{
    canopy_tx_mailbox_t *box = &self->mailboxes[mailbox];

    if (self->can->abort == NULL || box->aborting) {
        return false;
    }
    box->aborting = true;
    self->can->abort(self->can->context, mailbox);
    return settle(self, mailbox, box, now) != CANOPY_CAN_PENDING;
}

/** Empties mailboxes: what is out, and what must not get out any more. */
static void collect(canopy_tx_t *self, canopy_time_t now)
{
    for (uint8_t mailbox = 0; mailbox < self->mailbox_count; mailbox++) {
        const canopy_tx_mailbox_t *box = &self->mailboxes[mailbox];

        if (box->what == 0u || settle(self, mailbox, box, now) != CANOPY_CAN_PENDING) {
            continue;
        }
        if (canopy_time_reached(now, box->until) ||
            (box->what != CANOPY_TX_TRACE && is_replaced(&self->slots[box->what - 1u], box->version))) {
            (void)take_back(self, mailbox, now);
        }
    }
    if (self->watching && canopy_time_reached(now, self->watched_until)) {
        atomic_store_explicit(&self->blocked, true, memory_order_relaxed);
    }
}

/** A free mailbox, for a message one that a less urgent frame gives up; NO_MAILBOX: there is none. */
static uint8_t find_mailbox(canopy_tx_t *self, uint32_t what, canopy_time_t now)
{
    uint8_t least = NO_MAILBOX;
    uint32_t least_what = what;

    for (uint8_t mailbox = 0; mailbox < self->mailbox_count; mailbox++) {
        const canopy_tx_mailbox_t *box = &self->mailboxes[mailbox];

        if (box->what == 0u) {
            return mailbox;
        }
        if (box->what > least_what) {
            least = mailbox;
            least_what = box->what;
        }
    }
    return least != (uint8_t)NO_MAILBOX && take_back(self, least, now) ? least : (uint8_t)NO_MAILBOX;
}

/** From now on only a newer value of the message waits. */
static void take(canopy_tx_t *self, const canopy_tx_mailbox_t *box)
{
    canopy_tx_slot_t *slot = &self->slots[box->what - 1u];

    add(&self->replaced, (box->version - slot->taken - 1u) & CANOPY_TX_VERSION_MAX);
    slot->taken = box->version;
}

/**
 * Hands a frame to a mailbox, which `box` then describes.
 * @return as send() of the driver; 0 too when the frame has come back at once: it waits for the next service
 */
static int load(canopy_tx_t *self, uint8_t mailbox, const canopy_can_frame_t *frame, const canopy_tx_mailbox_t *box)
{
    const canopy_can_t *can = self->can;
    int result = can->send(can->context, mailbox, frame);

    if (result != 1) {
        watch(self, box->until);
        return result;
    }
    if (box->what != CANOPY_TX_TRACE) {
        take(self, box);
    }
    if (can->outcome == NULL) {
        note_out(self, box);
        return 1;
    }
    watch(self, box->until);
    self->mailboxes[mailbox] = *box;
    set_flying(self, box, true);
    return settle(self, mailbox, box, frame->time) != CANOPY_CAN_ABORTED ? 1 : 0;
}

/**
 * Copies what was posted last, unless the loop is just writing it.
 * @return false: it cannot be had now; the loop asks for another service when it has written.
 */
static bool copy(canopy_tx_t *self, uint16_t index, canopy_can_frame_t *frame, canopy_tx_mailbox_t *box)
{
    const canopy_tx_message_t *message = &self->messages[index];
    canopy_tx_slot_t *slot = &self->slots[index];
    uint32_t latest = atomic_load_explicit(&slot->latest, memory_order_relaxed);
    uint32_t buffer = (latest >> 1) & 1u;
    const uint8_t *data = canopy_tx_buffer(self, index, buffer);

    atomic_store(&slot->reading, (uint8_t)(buffer + 1u));
    if (latest == 0u || atomic_load(&slot->latest) != latest) {
        atomic_store_explicit(&slot->reading, 0u, memory_order_release);
        return false;
    }
    memcpy(frame->data, data, message->length);
    box->until = slot->until[buffer];
    atomic_store_explicit(&slot->reading, 0u, memory_order_release);
    box->version = latest >> 2;
    box->what = (uint16_t)(index + 1u);
    box->aborting = false;
    return true;
}

/** Hands a message to a mailbox, or drops it when it is too late. @return as load(); 1 when dropped. */
static int send_command(canopy_tx_t *self, uint8_t mailbox, canopy_can_frame_t *frame, const canopy_tx_mailbox_t *box,
                        canopy_time_t now)
{
    const canopy_tx_message_t *message = &self->messages[box->what - 1u];

    if (canopy_time_reached(now, box->until)) {
        add(&self->expired, 1u);
        take(self, box);
        return 1;
    }
    frame->time = now;
    frame->id = message->id;
    frame->flags = message->flags;
    frame->length = message->length;
    if (message->data_id != CANOPY_E2E_NONE) {
        canopy_e2e_protect((uint16_t)message->data_id, self->slots[box->what - 1u].counter, frame->data, frame->length);
    }
    return load(self, mailbox, frame, box);
}

/** @return 1 no message waits that could be sent, 0 one finds no room, negative: the driver cannot send now. */
static int send_commands(canopy_tx_t *self, canopy_time_t now)
{
    for (uint16_t index = next_message(self, 0); index < self->count; index = next_message(self, index + 1u)) {
        uint8_t mailbox = find_mailbox(self, index + 1u, now);
        canopy_tx_mailbox_t box;
        canopy_can_frame_t frame;

        if (mailbox == (uint8_t)NO_MAILBOX) {
            return 0;
        }
        if (copy(self, index, &frame, &box)) { /* else the loop asks for another service when it has written */
            int result = send_command(self, mailbox, &frame, &box, now);

            if (result != 1) {
                return result;
            }
        }
    }
    return 1;
}

/* By value and one by one: a compiler makes two words of it, where the core can read and write those anywhere. */
static void copy_trace_data(uint8_t *to, canopy_tx_trace_data_t from)
{
    to[0] = from.byte[0];
    to[1] = from.byte[1];
    to[2] = from.byte[2];
    to[3] = from.byte[3];
    to[4] = from.byte[4];
    to[5] = from.byte[5];
    to[6] = from.byte[6];
    to[7] = from.byte[7];
}

static int send_trace(canopy_tx_t *self, uint8_t mailbox, const canopy_tx_trace_t *trace, canopy_time_t now)
{
    const canopy_tx_mailbox_t box = {.until = trace->until, .what = CANOPY_TX_TRACE};
    canopy_can_frame_t frame;

    frame.time = now;
    frame.id = trace->id;
    frame.flags = trace->flags;
    frame.length = CANOPY_TX_TRACE_LENGTH;
    copy_trace_data(frame.data, trace->data);
    return load(self, mailbox, &frame, &box);
}

/**
 * Sends what waits, and drops what is too late. One after the other, so that they keep their order whatever the hardware
 * does with several.
 * @return as send_commands()
 */
static int send_traces(canopy_tx_t *self, canopy_time_t now)
{
    const uint32_t head = atomic_load_explicit(&self->trace_head, memory_order_acquire);
    uint32_t tail = atomic_load_explicit(&self->trace_tail, memory_order_relaxed);
    uint8_t mailbox = tail != head ? find_mailbox(self, CANOPY_TX_TRACE, now) : (uint8_t)NO_MAILBOX;

    for (; tail != head && !self->trace_flying; tail++) {
        const canopy_tx_trace_t *trace = &self->trace[tail & self->trace_mask];

        if (canopy_time_reached(now, trace->until)) {
            forget_trace(self);
            add(&self->trace_late, 1u);
        } else {
            int result = mailbox != (uint8_t)NO_MAILBOX ? send_trace(self, mailbox, trace, now) : 0;

            if (result != 1) {
                return result;
            }
        }
    }
    return 1;
}

void canopy_tx_service(canopy_tx_t *self, canopy_time_t now)
{
    bool busy;
    int result;

    collect(self, now);
    result = send_commands(self, now);
    if (result == 1) {
        result = send_traces(self, now);
    }
    busy = result == 0;
    for (uint8_t mailbox = 0; mailbox < self->mailbox_count; mailbox++) {
        busy = busy || self->mailboxes[mailbox].what != 0u;
    }
    atomic_store_explicit(&self->busy, busy, memory_order_relaxed);
}
