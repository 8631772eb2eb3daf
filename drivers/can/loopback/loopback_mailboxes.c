/* SPDX-License-Identifier: MIT */
/** @file How endpoints share the mailboxes of a controller; the contract is in loopback.h. */
#include "loopback_internal.h"

enum { NO_MAILBOX = CANOPY_CAN_MAILBOXES_MAX, BASE_SHIFT = 19, EXTENDED_SHIFT = 18, EXTENSION_MASK = 0x3FFFF };

/** Order of arbitration (ISO 11898-1): less wins. Of equal base ids the standard frame. */
static uint32_t rank(const canopy_can_frame_t *frame)
{
    if ((frame->flags & CANOPY_CAN_EXTENDED) == 0) {
        return frame->id << BASE_SHIFT;
    }
    return ((frame->id >> EXTENDED_SHIFT) << BASE_SHIFT) | (UINT32_C(1) << EXTENDED_SHIFT) |
           (frame->id & (uint32_t)EXTENSION_MASK);
}

static uint8_t mailbox_count(const canopy_can_t *controller)
{
    if (controller->outcome == NULL || controller->mailboxes == 0u) {
        return 1;
    }
    return controller->mailboxes < CANOPY_CAN_MAILBOXES_MAX ? controller->mailboxes : (uint8_t)CANOPY_CAN_MAILBOXES_MAX;
}

/** Takes note of what became of a mailbox's frame. @return true: the mailbox is free. */
static bool collect(canopy_loopback_t *bus, uint8_t mailbox)
{
    const canopy_can_t *controller = bus->controller;
    canopy_loopback_endpoint_t *owner = bus->mailboxes[mailbox].owner;
    canopy_can_outcome_t outcome = CANOPY_CAN_SENT;

    if (!bus->mailboxes[mailbox].used) {
        return true;
    }
    if (controller->outcome != NULL) {
        outcome = controller->outcome(controller->context, mailbox);
    }
    if (outcome == CANOPY_CAN_PENDING) {
        return false;
    }
    bus->mailboxes[mailbox].used = false;
    if (owner == NULL) {
        return true;
    }
    owner->loaded = false;
    if (outcome == CANOPY_CAN_ABORTED && owner->giving && !owner->dropping) {
        owner->giving = false; /* it waits again: a more urgent one wanted its mailbox */
    } else {
        canopy_loopback_settle(owner, outcome);
    }
    return true;
}

static void ask_back(const canopy_loopback_t *bus, uint8_t mailbox)
{
    canopy_loopback_endpoint_t *owner = bus->mailboxes[mailbox].owner;

    if (bus->controller->abort != NULL && owner != NULL && !owner->giving) {
        owner->giving = true;
        bus->controller->abort(bus->controller->context, mailbox);
    }
}

static canopy_loopback_endpoint_t *most_urgent(const canopy_loopback_t *bus)
{
    canopy_loopback_endpoint_t *best = NULL;

    for (canopy_loopback_endpoint_t *peer = bus->first; peer != NULL; peer = peer->next) {
        bool waits = peer->outcome == CANOPY_CAN_PENDING && !peer->loaded;

        if (waits && (best == NULL || rank(&peer->held) < rank(&best->held))) {
            best = peer;
        }
    }
    return best;
}

/** A free mailbox, or one that a less urgent frame gives up. */
static uint8_t find_mailbox(canopy_loopback_t *bus, const canopy_can_frame_t *frame)
{
    uint8_t least = NO_MAILBOX;
    uint32_t least_rank = rank(frame);

    for (uint8_t mailbox = 0; mailbox < mailbox_count(bus->controller); mailbox++) {
        const canopy_loopback_endpoint_t *owner = bus->mailboxes[mailbox].owner;

        if (!bus->mailboxes[mailbox].used) {
            return mailbox;
        }
        if (owner != NULL && rank(&owner->held) > least_rank) {
            least = mailbox;
            least_rank = rank(&owner->held);
        }
    }
    if (least != (uint8_t)NO_MAILBOX) {
        ask_back(bus, least);
        if (!collect(bus, least)) {
            return NO_MAILBOX;
        }
    }
    return least;
}

void canopy_loopback_service(canopy_loopback_t *bus)
{
    const canopy_can_t *controller = bus->controller;
    canopy_loopback_endpoint_t *next;

    for (uint8_t mailbox = 0; mailbox < mailbox_count(controller); mailbox++) {
        (void)collect(bus, mailbox);
    }
    while ((next = most_urgent(bus)) != NULL) {
        uint8_t mailbox = find_mailbox(bus, &next->held);
        int result = mailbox != (uint8_t)NO_MAILBOX ? controller->send(controller->context, mailbox, &next->held) : 0;

        if (result == 0) {
            return;
        }
        if (result < 0) {
            next->error = result;
            canopy_loopback_settle(next, CANOPY_CAN_ABORTED);
            continue;
        }
        next->loaded = true;
        bus->mailboxes[mailbox].used = true;
        bus->mailboxes[mailbox].owner = next;
        (void)collect(bus, mailbox);
    }
}

void canopy_loopback_take_back(canopy_loopback_endpoint_t *self)
{
    if (!self->loaded) {
        canopy_loopback_settle(self, CANOPY_CAN_ABORTED);
        return;
    }
    self->dropping = true;
    for (uint8_t mailbox = 0; mailbox < CANOPY_CAN_MAILBOXES_MAX; mailbox++) {
        if (self->bus->mailboxes[mailbox].used && self->bus->mailboxes[mailbox].owner == self) {
            ask_back(self->bus, mailbox);
        }
    }
    canopy_loopback_service(self->bus);
}

void canopy_loopback_disown(canopy_loopback_endpoint_t *self)
{
    for (uint8_t mailbox = 0; mailbox < CANOPY_CAN_MAILBOXES_MAX; mailbox++) {
        if (self->bus->mailboxes[mailbox].owner == self) {
            self->bus->mailboxes[mailbox].owner = NULL;
        }
    }
}
