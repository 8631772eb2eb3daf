/* SPDX-License-Identifier: MIT */
/** @file The transmit side; the contract, and why no value is torn, are in tx.h. */
#include "canopy/tx.h"

#include <stddef.h>

#include "canopy/e2e.h"

enum { TRACE_LENGTH = 8, NO_MAILBOX = CANOPY_CAN_MAILBOXES_MAX };

#define VERSION_MAX (UINT32_MAX >> 2)

/* --- the loop's side ------------------------------------------------------------------------------------------------ */

static void start_slot(canopy_tx_slot_t *slot)
{
    atomic_init(&slot->latest, 0u);
    atomic_init(&slot->out, UINT32_MAX);
    atomic_init(&slot->reading, 0u);
    slot->posted = 0;
    slot->taken = 0;
    slot->counter = 0;
    slot->flying = false;
}

static void start_counters(canopy_tx_t *self)
{
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
    canopy_error_t error = canopy_ring_init(&self->trace, memory->trace, memory->trace_capacity * sizeof *memory->trace,
                                            sizeof *memory->trace, memory->trace_capacity);

    if (error != CANOPY_OK || (count != 0u && (memory->slots == NULL || memory->data == NULL))) {
        return CANOPY_ERROR_ARGUMENT;
    }
    self->messages = messages;
    self->can = can;
    self->slots = memory->slots;
    self->data = memory->data;
    self->count = count;
    self->mailbox_count = mailboxes_of(can);
    self->trace_held = false;
    self->trace_flying = false;
    start_counters(self);
    for (unsigned mailbox = 0; mailbox < CANOPY_CAN_MAILBOXES_MAX; mailbox++) {
        self->mailboxes[mailbox] = (canopy_tx_mailbox_t){0};
    }
    for (uint16_t index = 0; index < count; index++) {
        start_slot(&self->slots[index]);
    }
    return CANOPY_OK;
}

static uint8_t *buffer_of(const canopy_tx_t *self, uint16_t index, uint32_t buffer)
{
    const canopy_tx_message_t *message = &self->messages[index];

    return &self->data[message->place + buffer * message->length];
}

void canopy_tx_post(canopy_tx_t *self, uint16_t message, const void *output, canopy_time_t until)
{
    canopy_tx_slot_t *slot = &self->slots[message];
    uint32_t buffer;

    atomic_store(&slot->latest, 0u);
    buffer = atomic_load(&slot->reading) == 1u ? 1u : 0u;
    self->messages[message].encode(output, buffer_of(self, message, buffer));
    slot->until[buffer] = until;
    slot->posted = (slot->posted + 1u) & VERSION_MAX;
    atomic_store(&slot->latest, (slot->posted << 2) | (buffer << 1) | 1u);
}

void canopy_tx_trace(canopy_tx_t *self, uint32_t id, uint8_t flags, const uint8_t data[8], canopy_time_t until)
{
    canopy_tx_trace_t frame;

    frame.until = until;
    frame.id = id;
    frame.flags = flags;
    for (unsigned byte = 0; byte < (unsigned)TRACE_LENGTH; byte++) {
        frame.data[byte] = data[byte];
    }
    (void)canopy_ring_push(&self->trace, &frame); /* a full ring counts */
}

void canopy_tx_kick(canopy_tx_t *self, canopy_time_t now)
{
    if (self->can->request != NULL) {
        self->can->request(self->can->context);
    } else {
        canopy_tx_service(self, now);
    }
}

bool canopy_tx_is_busy(const canopy_tx_t *self)
{
    return atomic_load_explicit(&self->busy, memory_order_relaxed);
}

bool canopy_tx_is_blocked(const canopy_tx_t *self)
{
    return atomic_load_explicit(&self->blocked, memory_order_relaxed);
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
    counters->replaced = atomic_load_explicit(&self->replaced, memory_order_relaxed);
    counters->expired = atomic_load_explicit(&self->expired, memory_order_relaxed);
    counters->trace_sent = atomic_load_explicit(&self->trace_sent, memory_order_relaxed);
    counters->trace_dropped =
        canopy_ring_dropped(&self->trace) + atomic_load_explicit(&self->trace_late, memory_order_relaxed);
}

/* --- the transmit context ------------------------------------------------------------------------------------------- */

/* For a counter with a single writer: a load and a store cannot lose anything. It saturates. */
static void add(_Atomic uint32_t *counter, uint32_t more)
{
    uint32_t value = atomic_load_explicit(counter, memory_order_relaxed);

    atomic_store_explicit(counter, value <= UINT32_MAX - more ? value + more : UINT32_MAX, memory_order_relaxed);
}

static void expire(canopy_tx_t *self, _Atomic uint32_t *counter)
{
    add(counter, 1u);
    atomic_store_explicit(&self->blocked, true, memory_order_relaxed);
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

static void settle_command(canopy_tx_t *self, const canopy_tx_mailbox_t *box, bool sent, canopy_time_t now)
{
    canopy_tx_slot_t *slot = &self->slots[box->what - 1u];

    slot->flying = false;
    if (sent) {
        atomic_store_explicit(&slot->out, box->version, memory_order_relaxed);
        slot->counter = (uint8_t)(slot->counter + 1u < CANOPY_E2E_COUNTERS ? slot->counter + 1u : 0u);
        add(&self->sent, 1u);
        atomic_store_explicit(&self->blocked, false, memory_order_relaxed);
    } else if (canopy_time_reached(now, box->until)) {
        expire(self, &self->expired);
    } else if (is_replaced(slot, box->version)) {
        add(&self->replaced, 1u);
    } else {
        slot->taken = (box->version - 1u) & VERSION_MAX; /* it waits again */
    }
}

static void settle_trace(canopy_tx_t *self, bool sent)
{
    self->trace_flying = false;
    if (sent) {
        self->trace_held = false;
        add(&self->trace_sent, 1u);
        atomic_store_explicit(&self->blocked, false, memory_order_relaxed);
    }
}

/** Takes note of a frame's outcome. @return false: it is still pending. */
static bool settle(canopy_tx_t *self, uint8_t mailbox, canopy_time_t now)
{
    const canopy_can_t *can = self->can;
    canopy_tx_mailbox_t *box = &self->mailboxes[mailbox];
    canopy_can_outcome_t outcome =
        can->outcome != NULL ? can->outcome(can->context, mailbox) : CANOPY_CAN_SENT;

    if (outcome == CANOPY_CAN_PENDING) {
        return false;
    }
    if (box->what == CANOPY_TX_TRACE) {
        settle_trace(self, outcome == CANOPY_CAN_SENT);
    } else {
        settle_command(self, box, outcome == CANOPY_CAN_SENT, now);
    }
    box->what = 0;
    return true;
}

/** Asks for a frame back. @return true: the mailbox is free already. */
static bool take_back(canopy_tx_t *self, uint8_t mailbox, canopy_time_t now)
{
    if (self->can->abort == NULL || self->mailboxes[mailbox].aborting) {
        return false;
    }
    self->mailboxes[mailbox].aborting = true;
    self->can->abort(self->can->context, mailbox);
    return settle(self, mailbox, now);
}

/** Empties mailboxes: what is out, and what must not get out any more. */
static void collect(canopy_tx_t *self, canopy_time_t now)
{
    for (uint8_t mailbox = 0; mailbox < self->mailbox_count; mailbox++) {
        const canopy_tx_mailbox_t *box = &self->mailboxes[mailbox];

        if (box->what == 0u || settle(self, mailbox, now)) {
            continue;
        }
        if (canopy_time_reached(now, box->until)) {
            atomic_store_explicit(&self->blocked, true, memory_order_relaxed);
            (void)take_back(self, mailbox, now);
        } else if (box->what != CANOPY_TX_TRACE && is_replaced(&self->slots[box->what - 1u], box->version)) {
            (void)take_back(self, mailbox, now);
        }
    }
}

/** A free mailbox, for a message one that a less urgent frame gives up; NO_MAILBOX: there is none. */
static uint8_t find_mailbox(canopy_tx_t *self, uint32_t what, canopy_time_t now)
{
    uint8_t least = NO_MAILBOX;
    uint32_t least_what = what;

    for (uint8_t mailbox = 0; mailbox < self->mailbox_count; mailbox++) {
        uint32_t other = self->mailboxes[mailbox].what;

        if (other == 0u) {
            return mailbox;
        }
        if (other > least_what) {
            least = mailbox;
            least_what = other;
        }
    }
    return least != (uint8_t)NO_MAILBOX && take_back(self, least, now) ? least : (uint8_t)NO_MAILBOX;
}

static int load(canopy_tx_t *self, uint8_t mailbox, const canopy_can_frame_t *frame, const canopy_tx_mailbox_t *box)
{
    int result = self->can->send(self->can->context, mailbox, frame);

    if (result == 1) {
        self->mailboxes[mailbox] = *box;
    }
    return result;
}

/**
 * Copies what was posted last, unless the loop is just writing it.
 * @return false: it cannot be had now; the loop asks for another service when it has written.
 */
static bool copy(canopy_tx_t *self, uint16_t index, canopy_can_frame_t *frame, canopy_tx_mailbox_t *box)
{
    const canopy_tx_message_t *message = &self->messages[index];
    canopy_tx_slot_t *slot = &self->slots[index];
    uint32_t latest = atomic_load(&slot->latest);
    uint32_t buffer = (latest >> 1) & 1u;
    const uint8_t *data = buffer_of(self, index, buffer);

    atomic_store(&slot->reading, (uint8_t)(buffer + 1u));
    if (latest == 0u || atomic_load(&slot->latest) != latest) {
        atomic_store(&slot->reading, 0u);
        return false;
    }
    for (uint8_t byte = 0; byte < message->length; byte++) {
        frame->data[byte] = data[byte];
    }
    box->until = slot->until[buffer];
    atomic_store(&slot->reading, 0u);
    box->version = latest >> 2;
    box->what = (uint16_t)(index + 1u);
    box->aborting = false;
    return true;
}

/** Hands a message to a mailbox, or drops it when it is too late. @return as send() of the driver; 1 when dropped. */
static int send_command(canopy_tx_t *self, uint8_t mailbox, canopy_can_frame_t *frame, const canopy_tx_mailbox_t *box,
                        canopy_time_t now)
{
    const canopy_tx_message_t *message = &self->messages[box->what - 1u];
    canopy_tx_slot_t *slot = &self->slots[box->what - 1u];
    int result = 1;

    if (canopy_time_reached(now, box->until)) {
        expire(self, &self->expired);
    } else {
        frame->time = now;
        frame->id = message->id;
        frame->flags = message->flags;
        frame->length = message->length;
        if (message->data_id != CANOPY_E2E_NONE) {
            canopy_e2e_protect((uint16_t)message->data_id, slot->counter, frame->data, frame->length);
        }
        result = load(self, mailbox, frame, box);
        slot->flying = result == 1;
    }
    if (result == 1) {
        add(&self->replaced, (box->version - slot->taken - 1u) & VERSION_MAX);
        slot->taken = box->version;
    }
    return result;
}

/** @return 1 no message waits that could be sent, 0 one finds no room, negative: the driver cannot send now. */
static int send_commands(canopy_tx_t *self, canopy_time_t now)
{
    for (uint16_t index = next_message(self, 0); index < self->count; index = next_message(self, index + 1u)) {
        uint8_t mailbox = find_mailbox(self, index + 1u, now);
        canopy_tx_mailbox_t box;
        canopy_can_frame_t frame;
        int result;

        if (mailbox == (uint8_t)NO_MAILBOX) {
            return 0;
        }
        if (!copy(self, index, &frame, &box)) {
            continue; /* the loop asks for another service when it has written */
        }
        result = send_command(self, mailbox, &frame, &box, now);
        if (result != 1) {
            return result;
        }
        (void)(self->mailboxes[mailbox].what != 0u && settle(self, mailbox, now));
    }
    return 1;
}

/** Is a trace frame there that is not too late? It is `held` then. */
static bool holds_trace(canopy_tx_t *self, canopy_time_t now)
{
    while (self->trace_held || canopy_ring_pop(&self->trace, &self->held)) {
        self->trace_held = true;
        if (!canopy_time_reached(now, self->held.until)) {
            return true;
        }
        self->trace_held = false;
        expire(self, &self->trace_late);
    }
    return false;
}

static int send_trace(canopy_tx_t *self, uint8_t mailbox, canopy_time_t now)
{
    const canopy_tx_mailbox_t box = {.until = self->held.until, .what = CANOPY_TX_TRACE};
    canopy_can_frame_t frame;
    int result;

    frame.time = now;
    frame.id = self->held.id;
    frame.flags = self->held.flags;
    frame.length = TRACE_LENGTH;
    for (unsigned byte = 0; byte < (unsigned)TRACE_LENGTH; byte++) {
        frame.data[byte] = self->held.data[byte];
    }
    result = load(self, mailbox, &frame, &box);
    self->trace_flying = result == 1;
    return result;
}

/** One after the other, so that they keep their order whatever the hardware does with several. @return as above. */
static int send_traces(canopy_tx_t *self, canopy_time_t now)
{
    while (!self->trace_flying && holds_trace(self, now)) {
        uint8_t mailbox = find_mailbox(self, CANOPY_TX_TRACE, now);
        int result = mailbox != (uint8_t)NO_MAILBOX ? send_trace(self, mailbox, now) : 0;

        if (result != 1) {
            return result;
        }
        (void)settle(self, mailbox, now);
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
