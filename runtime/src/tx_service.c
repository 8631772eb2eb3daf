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

/** The oldest trace frame gives up its place. */
static void forget_trace(canopy_tx_t *self)
{
    uint32_t tail = atomic_load_explicit(&self->trace_tail, memory_order_relaxed);

    atomic_store_explicit(&self->trace_tail, tail + 1u, memory_order_release);
}

/** A frame is out: the bus lets frames through. */
static void note_free(canopy_tx_t *self)
{
    self->watching = false;
    atomic_store_explicit(&self->blocked, false, memory_order_relaxed);
}

static void note_command_out(canopy_tx_t *self, canopy_tx_slot_t *slot, uint32_t version)
{
    const uint8_t counter = slot->counter;

    atomic_store_explicit(&slot->out, version, memory_order_relaxed);
    slot->counter = counter != CANOPY_E2E_COUNTERS - 1u ? (uint8_t)(counter + 1u) : 0u;
    add(&self->sent, 1u);
    note_free(self);
}

static void note_trace_out(canopy_tx_t *self)
{
    forget_trace(self);
    add(&self->trace_sent, 1u);
    note_free(self);
}

/** A command is not out and never will be. */
static void note_aborted(canopy_tx_t *self, canopy_tx_slot_t *slot, const canopy_tx_mailbox_t *box, canopy_time_t now)
{
    if (canopy_time_reached(now, box->until)) {
        add(&self->expired, 1u);
    } else if (is_replaced(slot, box->version)) {
        add(&self->replaced, 1u);
    } else {
        slot->taken = (box->version - 1u) & CANOPY_TX_VERSION_MAX; /* it waits again */
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
    if (box->what == CANOPY_TX_TRACE) {
        self->trace_flying = false;
        if (outcome == CANOPY_CAN_SENT) {
            note_trace_out(self); /* else it waits again, where it was */
        }
    } else {
        canopy_tx_slot_t *slot = &self->slots[box->what - 1u];

        slot->flying = false;
        if (outcome == CANOPY_CAN_SENT) {
            note_command_out(self, slot, box->version);
        } else {
            note_aborted(self, slot, box, now);
        }
    }
    self->mailboxes[mailbox].what = 0;
    self->in_flight--;
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

static bool trace_is_stopped(const canopy_tx_t *self)
{
    return atomic_load_explicit(&self->trace_stopped, memory_order_relaxed);
}

/** Must the frame in a mailbox not get out any more? */
static bool is_void(const canopy_tx_t *self, const canopy_tx_mailbox_t *box, canopy_time_t now)
{
    if (canopy_time_reached(now, box->until)) {
        return true;
    }
    return box->what == CANOPY_TX_TRACE ? trace_is_stopped(self)
                                        : is_replaced(&self->slots[box->what - 1u], box->version);
}

/** Empties mailboxes: what is out, and what must not get out any more. */
static void collect(canopy_tx_t *self, canopy_time_t now)
{
    for (uint8_t mailbox = 0; mailbox < self->mailbox_count; mailbox++) {
        const canopy_tx_mailbox_t *box = &self->mailboxes[mailbox];

        if (box->what == 0u || settle(self, mailbox, box, now) != CANOPY_CAN_PENDING) {
            continue;
        }
        if (is_void(self, box, now)) {
            (void)take_back(self, mailbox, now);
        }
    }
}

/** A free mailbox, for a message one that a less urgent frame gives up; NO_MAILBOX: there is none. */
static uint8_t find_mailbox(canopy_tx_t *self, uint32_t what, canopy_time_t now)
{
    uint8_t least = NO_MAILBOX;
    uint32_t least_what = what;

    if (self->in_flight == 0u) {
        return 0;
    }
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
static void take(canopy_tx_t *self, canopy_tx_slot_t *slot, uint32_t version)
{
    const uint32_t skipped = (version - slot->taken - 1u) & CANOPY_TX_VERSION_MAX;

    if (skipped != 0u) {
        add(&self->replaced, skipped);
    }
    slot->taken = version;
}

/**
 * The driver has taken a frame, which is in its mailbox until it has its outcome.
 * @return 1; 0 when the frame has come back at once: it waits for the next service
 */
static int fly(canopy_tx_t *self, uint8_t mailbox, canopy_tx_mailbox_t box, canopy_time_t now)
{
    watch(self, box.until);
    self->mailboxes[mailbox] = box;
    self->in_flight++;
    if (box.what == CANOPY_TX_TRACE) {
        self->trace_flying = true;
    } else {
        self->slots[box.what - 1u].flying = true;
    }
    return settle(self, mailbox, &box, now) != CANOPY_CAN_ABORTED ? 1 : 0;
}

/**
 * Copies what was posted last, unless the loop is just writing it: its bytes into `data`, what else it is into `box`.
 * @return false: it cannot be had now; the loop asks for another service when it has written.
 */
static bool copy(canopy_tx_t *self, uint16_t index, uint8_t *data, canopy_tx_mailbox_t *box)
{
    canopy_tx_slot_t *slot = &self->slots[index];
    uint32_t latest = atomic_load_explicit(&slot->latest, memory_order_relaxed);
    uint32_t buffer = (latest >> 1) & 1u;

    atomic_store(&slot->reading, (uint8_t)(buffer + 1u));
    if (latest == 0u || atomic_load(&slot->latest) != latest) {
        atomic_store_explicit(&slot->reading, 0u, memory_order_release);
        return false;
    }
    memcpy(data, canopy_tx_buffer(self, index, buffer), self->messages[index].length);
    *box = (canopy_tx_mailbox_t){
        .until = slot->until[buffer], .version = latest >> 2, .what = (uint16_t)(index + 1u), .aborting = false};
    atomic_store_explicit(&slot->reading, 0u, memory_order_release);
    return true;
}

/**
 * Hands a message to a mailbox, or drops it when it is too late.
 * @param frame with its data and its time
 * @return 1 it is out, in the mailbox, or dropped; else as send() of the driver, and 0 too when it has come back at once
 */
static int send_command(canopy_tx_t *self, uint8_t mailbox, canopy_can_frame_t *frame, const canopy_tx_mailbox_t *box)
{
    const canopy_can_t *can = self->can;
    const canopy_tx_message_t *message = &self->messages[box->what - 1u];
    canopy_tx_slot_t *slot = &self->slots[box->what - 1u];
    int result;

    if (canopy_time_reached(frame->time, box->until)) {
        add(&self->expired, 1u);
        take(self, slot, box->version);
        return 1;
    }
    frame->id = message->id;
    frame->flags = message->flags;
    frame->length = message->length;
    if (message->data_id != CANOPY_E2E_NONE) {
        canopy_e2e_protect((uint16_t)message->data_id, slot->counter, frame->data, frame->length);
    }
    result = can->send(can->context, mailbox, frame);
    if (result != 1) {
        watch(self, box->until);
        return result;
    }
    take(self, slot, box->version);
    if (can->outcome != NULL) {
        return fly(self, mailbox, *box, frame->time);
    }
    note_command_out(self, slot, box->version);
    return 1;
}

/** @return 1 no message waits that could be sent, 0 one finds no room, negative: the driver cannot send now. */
static int send_commands(canopy_tx_t *self, canopy_time_t now)
{
    canopy_can_frame_t frame;

    frame.time = now;
    for (uint16_t index = 0; index < self->count; index++) {
        canopy_tx_mailbox_t box;
        uint8_t mailbox;

        if (!waits(&self->slots[index])) {
            continue;
        }
        mailbox = find_mailbox(self, index + 1u, now);
        if (mailbox == (uint8_t)NO_MAILBOX) {
            return 0;
        }
        if (copy(self, index, frame.data, &box)) {
            int result = send_command(self, mailbox, &frame, &box);

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

/** Hands a trace frame to a mailbox. @param frame with its time and its length @return as send_command() */
static int send_trace(canopy_tx_t *self, uint8_t mailbox, const canopy_tx_trace_t *trace, canopy_can_frame_t *frame)
{
    const canopy_can_t *can = self->can;
    int result;

    frame->id = trace->id;
    frame->flags = trace->flags;
    copy_trace_data(frame->data, trace->data);
    result = can->send(can->context, mailbox, frame);
    if (result != 1) {
        watch(self, trace->until);
        return result;
    }
    if (can->outcome != NULL) {
        return fly(self, mailbox, (canopy_tx_mailbox_t){.until = trace->until, .what = CANOPY_TX_TRACE}, frame->time);
    }
    note_trace_out(self);
    return 1;
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
    canopy_can_frame_t frame;

    frame.time = now;
    frame.length = CANOPY_TX_TRACE_LENGTH;
    for (; tail != head && !self->trace_flying; tail++) {
        const canopy_tx_trace_t *trace = &self->trace[tail & self->trace_mask];

        if (canopy_time_reached(now, trace->until)) {
            forget_trace(self);
            add(&self->trace_late, 1u);
        } else {
            int result = mailbox != (uint8_t)NO_MAILBOX ? send_trace(self, mailbox, trace, &frame) : 0;

            if (result != 1) {
                return result;
            }
        }
    }
    return 1;
}

/** Drops what waits, unless its oldest frame is in a mailbox: then it has to stay where it is. */
static void drop_traces(canopy_tx_t *self)
{
    const uint32_t head = atomic_load_explicit(&self->trace_head, memory_order_acquire);

    if (!self->trace_flying) {
        add(&self->trace_late, head - atomic_load_explicit(&self->trace_tail, memory_order_relaxed));
        atomic_store_explicit(&self->trace_tail, head, memory_order_release);
    }
}

void canopy_tx_service(canopy_tx_t *self, canopy_time_t now)
{
    int result;

    if (self->in_flight != 0u) {
        collect(self, now);
    }
    if (self->watching && canopy_time_reached(now, self->watched_until)) {
        atomic_store_explicit(&self->blocked, true, memory_order_relaxed);
    }
    result = send_commands(self, now);
    if (trace_is_stopped(self)) {
        drop_traces(self);
    } else if (result == 1) {
        result = send_traces(self, now);
    }
    atomic_store_explicit(&self->busy, result == 0 || self->in_flight != 0u, memory_order_relaxed);
}
