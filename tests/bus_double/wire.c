/* SPDX-License-Identifier: MIT */
/** @file A CAN wire; the contract is in wire.h. */
#include "wire.h"

#include <stddef.h>
#include <string.h>

#include "frame_bits.h"
#include "unity.h"

enum {
    ERROR_FLAG = 6,
    ERROR_DELIMITER = 8,
    ERRORS_EACH = 8, /* bits and errors, on a wire that is held dominant: rule 6 */
    TOLERATED = 14   /* dominant bits after the start of an error flag, before the first such step */
};

static nanoseconds_t bits(const wire_t *self, unsigned count)
{
    return (nanoseconds_t)count * self->bit_ns;
}

static void enter(wire_t *self, wire_phase_t phase, unsigned length)
{
    self->phase = phase;
    self->actor.due = self->world->now + bits(self, length);
}

static void end_recessive(wire_t *self)
{
    for (unsigned index = 0; index < self->count; index++) {
        controller_recover(self->controllers[index], self->recessive_since, self->world->now);
    }
}

/* --- a frame begins ------------------------------------------------------------------------------------------------- */

/** The lowest rank that is offered now; UINT32_MAX: nothing is. */
static uint32_t best_rank(const wire_t *self)
{
    uint32_t best = UINT32_MAX;

    for (unsigned index = 0; index < self->count; index++) {
        const controller_t *controller = self->controllers[index];
        int mailbox = controller_offer(controller);
        uint32_t rank = mailbox >= 0 ? frame_rank(&controller->mailboxes[mailbox].frame) : UINT32_MAX;

        best = rank < best ? rank : best;
    }
    return best;
}

/** The bit after which a frame differs from the one on the wire; 0: they are the same. */
static unsigned difference(const canopy_can_frame_t *one, const canopy_can_frame_t *other)
{
    uint8_t one_bits[FRAME_BITS_MAX];
    uint8_t other_bits[FRAME_BITS_MAX];
    unsigned count = frame_bits(one, one_bits);
    unsigned other_count = frame_bits(other, other_bits);

    count = other_count < count ? other_count : count;
    for (unsigned index = 0; index < count; index++) {
        if (one_bits[index] != other_bits[index]) {
            return index + 1u;
        }
    }
    return 0;
}

/** Lets all who have the winning rank send. @return bits up to an error; 0: none but a missing acknowledgement can come */
static unsigned arbitrate(wire_t *self, uint32_t rank)
{
    unsigned senders = 0;
    unsigned error_at = 0;

    for (unsigned index = 0; index < self->count; index++) {
        controller_t *controller = self->controllers[index];
        int mailbox = controller_offer(controller);

        if (mailbox < 0 || frame_rank(&controller->mailboxes[mailbox].frame) != rank) {
            continue;
        }
        controller->on_wire = mailbox;
        if (senders++ == 0u) {
            self->frame = controller->mailboxes[mailbox].frame;
        } else {
            error_at = difference(&self->frame, &controller->mailboxes[mailbox].frame);
        }
        if (controller->cannot_drive) {
            self->fails_for_sender = true;
            error_at = 1;
        }
    }
    return error_at;
}

/** When the wire is idle and nobody can send: the next moment at which that may change. */
static nanoseconds_t next_chance(const wire_t *self)
{
    nanoseconds_t next = NEVER;

    for (unsigned index = 0; index < self->count; index++) {
        const controller_t *controller = self->controllers[index];
        nanoseconds_t recovered = controller_recovered_at(controller, self->recessive_since);

        next = recovered < next ? recovered : next;
        if (controller->suspended_until > self->world->now && controller->suspended_until < next) {
            next = controller->suspended_until;
        }
    }
    return next;
}

static void idle(wire_t *self)
{
    uint8_t unused[FRAME_BITS_MAX];
    uint32_t rank;
    unsigned length;
    unsigned error_at;

    self->phase = WIRE_IDLE;
    end_recessive(self);
    rank = best_rank(self);
    if (rank == UINT32_MAX) {
        self->actor.due = next_chance(self);
        return;
    }
    self->start = self->world->now;
    self->fails_for_sender = false;
    error_at = arbitrate(self, rank);
    length = frame_bits(&self->frame, unused);
    if (error_at == 0u && self->disturbed > 0u) {
        self->disturbed--;
        error_at = random_between(&self->random, 1, length);
    }
    self->fails = error_at != 0u;
    enter(self, WIRE_FRAME, error_at != 0u ? error_at : length + (unsigned)ACK_SLOT_END);
}

/* --- a frame ends --------------------------------------------------------------------------------------------------- */

static bool is_acknowledged(const wire_t *self)
{
    for (unsigned index = 0; index < self->count; index++) {
        if (self->controllers[index]->on_wire < 0 && !self->controllers[index]->bus_off) {
            return true;
        }
    }
    return false;
}

/** @param acknowledged false: the error is that nobody has */
static void fail(wire_t *self, bool acknowledged)
{
    self->errors++;
    enter(self, WIRE_ERROR, (unsigned)ERROR_FLAG + (unsigned)ERROR_DELIMITER);
    self->recessive_since = self->world->now + bits(self, ERROR_FLAG);
    for (unsigned index = 0; index < self->count; index++) {
        controller_t *controller = self->controllers[index];

        if (controller->on_wire >= 0) {
            bool passive = controller->transmit_errors >= (unsigned)ERRORS_PASSIVE ||
                           controller->receive_errors >= (unsigned)ERRORS_PASSIVE;

            controller_failed(controller, acknowledged || !passive); /* rule 3, exception 1 */
        } else if (!self->fails_for_sender && !controller->bus_off) {
            controller_receive_error(controller, 1u);
        }
    }
}

static void deliver(wire_t *self)
{
    const controller_t *from = NULL;

    for (unsigned index = 0; index < self->count; index++) {
        controller_t *controller = self->controllers[index];

        if (controller->on_wire < 0 && !controller->bus_off) {
            controller_hear(controller, &self->frame);
        } else if (controller->on_wire >= 0) {
            from = controller;
        }
    }
    if (self->watch != NULL) {
        self->watch(self->watch_context, &self->frame, from, self->start, self->world->now + bits(self, 1));
    }
}

static void complete(wire_t *self)
{
    self->frames++;
    self->busy_ns += self->world->now + bits(self, INTERMISSION) - self->start;
    enter(self, WIRE_INTERMISSION, INTERMISSION);
    for (unsigned index = 0; index < self->count; index++) {
        if (self->controllers[index]->on_wire >= 0) {
            controller_sent(self->controllers[index]);
        }
    }
}

/** Another 8 dominant bits: rule 6. The transmitter of the frame that was hit goes bus-off; the others get passive. */
static void stay_dominant(wire_t *self)
{
    bool more = false;

    for (unsigned index = 0; index < self->count; index++) {
        controller_t *controller = self->controllers[index];

        if (controller->bus_off) {
            continue;
        }
        if (controller->on_wire >= 0) {
            controller_transmit_error(controller);
        } else if (controller->receive_errors < (unsigned)ERRORS_PASSIVE) {
            controller_receive_error(controller, ERRORS_EACH);
        }
        if (controller->bus_off) {
            controller->on_wire = -1;
        }
        more = more || controller->on_wire >= 0 || controller->receive_errors < (unsigned)ERRORS_PASSIVE;
    }
    if (more) {
        enter(self, WIRE_DOMINANT, ERRORS_EACH);
    }
}

static void act(void *context)
{
    wire_t *self = context;

    switch (self->phase) {
    case WIRE_FRAME:
        self->recessive_since = self->world->now;
        if (self->fails) {
            fail(self, true);
        } else if (is_acknowledged(self)) {
            enter(self, WIRE_END_OF_FRAME, VALID_FOR_RECEIVER);
        } else {
            fail(self, false);
        }
        break;
    case WIRE_END_OF_FRAME:
        enter(self, WIRE_LAST_BIT, 1);
        deliver(self);
        break;
    case WIRE_LAST_BIT:
        complete(self);
        break;
    case WIRE_ERROR:
        enter(self, WIRE_INTERMISSION, INTERMISSION);
        break;
    case WIRE_INTERMISSION:
    case WIRE_IDLE:
        idle(self);
        break;
    case WIRE_DOMINANT:
        stay_dominant(self);
        break;
    }
}

/* --- what tests and controllers do ---------------------------------------------------------------------------------- */

void wire_init(wire_t *self, world_t *world, uint32_t bit_rate)
{
    *self = (wire_t){.world = world, .bit_ns = (uint32_t)(NS_PER_S / bit_rate), .random = 0x2545F491u};
    world_add(world, &self->actor, act, self);
    self->actor.is_last = true;
}

static void unplug(wire_t *self, controller_t *controller)
{
    unsigned kept = 0;

    if (controller->on_wire >= 0) {
        if (self->phase == WIRE_DOMINANT) {
            controller->on_wire = -1;
        } else {
            fail(self, true);
        }
    }
    for (unsigned index = 0; index < self->count; index++) {
        if (self->controllers[index] != controller) {
            self->controllers[kept++] = self->controllers[index];
        }
    }
    self->count = kept;
}

void wire_plug(wire_t *self, controller_t *controller)
{
    if (controller->wire != NULL) {
        unplug(controller->wire, controller);
    }
    TEST_ASSERT_LESS_THAN_MESSAGE(WIRE_CONTROLLERS_MAX, self->count, "raise WIRE_CONTROLLERS_MAX");
    controller->wire = self;
    self->controllers[self->count++] = controller;
    wire_poke(self);
}

void wire_set_watch(wire_t *self, wire_watch_t watch, void *context)
{
    self->watch = watch;
    self->watch_context = context;
}

void wire_hold(wire_t *self, bool dominant)
{
    if (dominant == self->dominant) {
        return;
    }
    self->dominant = dominant;
    if (dominant) {
        if (self->phase == WIRE_IDLE || self->phase == WIRE_INTERMISSION) {
            end_recessive(self);
        }
        self->phase = WIRE_DOMINANT;
        self->actor.due = self->world->now + bits(self, (unsigned)ERROR_FLAG + (unsigned)TOLERATED);
        return;
    }
    self->recessive_since = self->world->now;
    enter(self, WIRE_ERROR, ERROR_DELIMITER);
    for (unsigned index = 0; index < self->count; index++) {
        if (self->controllers[index]->on_wire >= 0) {
            controller_failed(self->controllers[index], true);
        }
    }
}

void wire_disturb(wire_t *self, uint32_t frames)
{
    self->disturbed += frames;
}

void wire_poke(wire_t *self)
{
    if (self->phase == WIRE_IDLE) {
        self->actor.due = self->world->now;
    }
}

nanoseconds_t wire_free_at(const wire_t *self)
{
    switch (self->phase) {
    case WIRE_INTERMISSION:
        return self->actor.due;
    case WIRE_LAST_BIT:
    case WIRE_ERROR:
        return self->actor.due + bits(self, INTERMISSION);
    case WIRE_IDLE:
    case WIRE_FRAME:
    case WIRE_END_OF_FRAME:
    case WIRE_DOMINANT:
        break;
    }
    return self->world->now;
}
