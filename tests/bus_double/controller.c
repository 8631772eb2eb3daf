/* SPDX-License-Identifier: MIT */
/** @file A CAN controller; the contract, and the sources, are in controller.h. */
#include "controller.h"

#include <stddef.h>

#include "frame_bits.h"
#include "unity.h"
#include "wire.h"

enum {
    ERRORS_PER_TRANSMIT = 8,
    RECEIVE_ERRORS_MAX = 255,
    RECEIVE_ERRORS_AFTER_GOOD = 119, /* rule 8: 119..127 */
    SUSPEND_BITS = 8,
    RECOVERY_SEQUENCES = 128,
    RECOVERY_BITS = 11
};

static void interrupt(void *context)
{
    controller_t *self = context;

    if (self->isr != NULL) {
        self->isr(self->isr_context);
    }
}

void controller_init(controller_t *self, wire_t *wire, const char *name, const controller_config_t *config)
{
    *self = (controller_t){.world = wire->world, .name = name, .config = *config, .on_wire = -1, .random = 0x9E3779B9u};
    world_add(self->world, &self->interrupt, interrupt, self);
    wire_plug(wire, self);
}

void controller_filter(controller_t *self, controller_filter_t filter)
{
    TEST_ASSERT_LESS_THAN_MESSAGE(CONTROLLER_FILTERS_MAX, self->filter_count, "raise CONTROLLER_FILTERS_MAX");
    self->filters[self->filter_count++] = filter;
}

void controller_raise(controller_t *self)
{
    if (self->interrupt.due == NEVER) {
        self->interrupt.due = self->world->now + self->config.latency_ns +
                              random_between(&self->random, 0, self->config.latency_jitter_ns);
    }
}

/* --- transmission --------------------------------------------------------------------------------------------------- */

bool controller_send(controller_t *self, uint8_t mailbox, const canopy_can_frame_t *frame)
{
    mailbox_t *box = &self->mailboxes[mailbox];

    if (mailbox >= self->config.mailboxes || box->state != MAILBOX_FREE || frame->length > 8u ||
        (frame->flags & (CANOPY_CAN_FD | CANOPY_CAN_ERROR)) != 0u) {
        return false;
    }
    *box = (mailbox_t){.frame = *frame, .state = MAILBOX_PENDING, .order = self->order++};
    wire_poke(self->wire);
    return true;
}

static void finish(controller_t *self, mailbox_t *box, mailbox_state_t state)
{
    box->state = state;
    controller_raise(self);
}

void controller_abort(controller_t *self, uint8_t mailbox)
{
    mailbox_t *box = &self->mailboxes[mailbox];

    if (box->state != MAILBOX_PENDING) {
        return;
    }
    if (self->on_wire == (int)mailbox) {
        box->abort = true;
    } else {
        finish(self, box, MAILBOX_ABORTED);
    }
}

void controller_release(controller_t *self, uint8_t mailbox)
{
    if (self->mailboxes[mailbox].state != MAILBOX_PENDING) {
        self->mailboxes[mailbox].state = MAILBOX_FREE;
    }
}

static bool goes_before(const controller_t *self, const mailbox_t *one, const mailbox_t *other)
{
    if (self->config.in_order) {
        return one->order < other->order;
    }
    return frame_rank(&one->frame) < frame_rank(&other->frame);
}

int controller_offer(const controller_t *self)
{
    int best = -1;

    if (self->bus_off || self->world->now < self->suspended_until) {
        return -1;
    }
    for (int mailbox = 0; mailbox < self->config.mailboxes; mailbox++) {
        const mailbox_t *box = &self->mailboxes[mailbox];

        if (box->state == MAILBOX_PENDING && (best < 0 || goes_before(self, box, &self->mailboxes[best]))) {
            best = mailbox;
        }
    }
    return best;
}

static void go_bus_off(controller_t *self)
{
    self->bus_off = true;
    self->bus_offs++;
    for (unsigned mailbox = 0; mailbox < CONTROLLER_MAILBOXES_MAX; mailbox++) {
        mailbox_t *box = &self->mailboxes[mailbox];

        if (box->state == MAILBOX_PENDING && (box->abort || !self->config.keeps_at_bus_off)) {
            box->state = MAILBOX_ABORTED;
        }
    }
    controller_raise(self);
}

void controller_transmit_error(controller_t *self)
{
    self->transmit_errors += (unsigned)ERRORS_PER_TRANSMIT;
    if (self->transmit_errors >= (unsigned)ERRORS_BUS_OFF && !self->bus_off) {
        go_bus_off(self);
    }
}

static void suspend(controller_t *self)
{
    if (self->transmit_errors >= (unsigned)ERRORS_PASSIVE || self->receive_errors >= (unsigned)ERRORS_PASSIVE) {
        self->suspended_until = wire_free_at(self->wire) + (nanoseconds_t)SUSPEND_BITS * self->wire->bit_ns;
    }
}

void controller_sent(controller_t *self)
{
    mailbox_t *box = &self->mailboxes[self->on_wire];

    self->on_wire = -1;
    self->sent++;
    self->transmit_errors -= self->transmit_errors > 0u ? 1u : 0u;
    suspend(self);
    finish(self, box, MAILBOX_SENT);
}

void controller_failed(controller_t *self, bool counts)
{
    mailbox_t *box = &self->mailboxes[self->on_wire];

    self->on_wire = -1;
    self->error_frames++;
    if (counts) {
        controller_transmit_error(self);
    }
    suspend(self);
    if (box->abort && box->state == MAILBOX_PENDING) {
        finish(self, box, MAILBOX_ABORTED);
    }
}

/* --- reception ------------------------------------------------------------------------------------------------------ */

uint32_t controller_timer(const controller_t *self)
{
    const uint32_t mask = UINT32_MAX >> (32u - self->config.stamp_bits);

    return (uint32_t)(self->world->now / self->config.stamp_ns) & mask;
}

/** @return the FIFO into which the frame goes; -1: it is filtered out */
static int fifo_of(const controller_t *self, const canopy_can_frame_t *frame)
{
    const bool extended = (frame->flags & CANOPY_CAN_EXTENDED) != 0u;

    for (unsigned index = 0; index < self->filter_count; index++) {
        const controller_filter_t *filter = &self->filters[index];

        if (filter->extended == extended && ((frame->id ^ filter->id) & filter->mask) == 0u) {
            return filter->fifo;
        }
    }
    return self->filter_count == 0u ? 0 : -1;
}

static void store(controller_t *self, fifo_t *fifo, const canopy_can_frame_t *frame)
{
    uint32_t place = fifo->count;

    if (fifo->count == self->config.depth) {
        fifo->lost++;
        if (!self->config.overwrites) {
            return;
        }
        place = fifo->count - 1u;
    } else {
        fifo->count++;
    }
    fifo->frames[(fifo->first + place) % self->config.depth] =
        (received_t){.frame = *frame, .stamp = controller_timer(self)};
}

void controller_hear(controller_t *self, const canopy_can_frame_t *frame)
{
    int fifo = fifo_of(self, frame);

    if (self->receive_errors >= (unsigned)ERRORS_PASSIVE) {
        self->receive_errors = (unsigned)RECEIVE_ERRORS_AFTER_GOOD;
    } else if (self->receive_errors > 0u) {
        self->receive_errors--;
    }
    if (fifo >= 0) {
        store(self, &self->fifos[fifo], frame);
        controller_raise(self);
    }
}

bool controller_receive(controller_t *self, unsigned fifo, received_t *received)
{
    fifo_t *queue = &self->fifos[fifo];

    if (queue->count == 0u) {
        return false;
    }
    *received = queue->frames[queue->first];
    queue->first = (queue->first + 1u) % self->config.depth;
    queue->count--;
    return true;
}

void controller_receive_error(controller_t *self, unsigned errors)
{
    self->error_frames++;
    self->receive_errors += errors;
    if (self->receive_errors > (unsigned)RECEIVE_ERRORS_MAX) {
        self->receive_errors = (unsigned)RECEIVE_ERRORS_MAX;
    }
}

/* --- states --------------------------------------------------------------------------------------------------------- */

canopy_can_controller_t controller_state(const controller_t *self)
{
    unsigned errors = self->transmit_errors > self->receive_errors ? self->transmit_errors : self->receive_errors;

    if (self->bus_off) {
        return CANOPY_CAN_CONTROLLER_BUS_OFF;
    }
    if (errors >= (unsigned)ERRORS_PASSIVE) {
        return CANOPY_CAN_CONTROLLER_PASSIVE;
    }
    return errors >= (unsigned)ERRORS_WARNING ? CANOPY_CAN_CONTROLLER_WARNING : CANOPY_CAN_CONTROLLER_ACTIVE;
}

void controller_restart(controller_t *self)
{
    if (self->bus_off && !self->recovering) {
        self->recovering = true;
        self->recovery_left = (unsigned)RECOVERY_SEQUENCES;
        self->recovery_from = self->world->now;
        wire_poke(self->wire);
    }
}

static nanoseconds_t recovery_start(const controller_t *self, nanoseconds_t recessive_since)
{
    return self->recovery_from > recessive_since ? self->recovery_from : recessive_since;
}

nanoseconds_t controller_recovered_at(const controller_t *self, nanoseconds_t recessive_since)
{
    if (!self->recovering) {
        return NEVER;
    }
    return recovery_start(self, recessive_since) +
           (nanoseconds_t)self->recovery_left * (nanoseconds_t)RECOVERY_BITS * self->wire->bit_ns;
}

void controller_recover(controller_t *self, nanoseconds_t recessive_since, nanoseconds_t until)
{
    nanoseconds_t start = recovery_start(self, recessive_since);
    nanoseconds_t sequences;

    if (!self->recovering || until <= start) {
        return;
    }
    sequences = (until - start) / ((nanoseconds_t)RECOVERY_BITS * self->wire->bit_ns);
    if (sequences < self->recovery_left) {
        self->recovery_left -= (unsigned)sequences;
        self->recovery_from = start + sequences * (nanoseconds_t)RECOVERY_BITS * self->wire->bit_ns;
        return;
    }
    self->recovering = false;
    self->bus_off = false;
    self->transmit_errors = 0;
    self->receive_errors = 0;
    self->suspended_until = 0;
    controller_raise(self);
}
