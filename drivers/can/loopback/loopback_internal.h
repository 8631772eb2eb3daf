/* SPDX-License-Identifier: MIT */
/** @file Between the files of the loopback driver: endpoints (loopback.c), and the controller's mailboxes that they share. */
#ifndef CANOPY_LOOPBACK_INTERNAL_H
#define CANOPY_LOOPBACK_INTERNAL_H

#include "canopy/can/loopback.h"

/** The frame in an endpoint's mailbox is out: the others get it. Or it never will be. */
void canopy_loopback_settle(canopy_loopback_endpoint_t *self, canopy_can_outcome_t outcome);

/** Takes note of what is out, and gives free mailboxes of the controller to the most urgent frames. */
void canopy_loopback_service(canopy_loopback_t *bus);

/** Takes the frame of an endpoint back, which is PENDING, as far as the controller can. */
void canopy_loopback_take_back(canopy_loopback_endpoint_t *self);

/** The mailboxes of an endpoint that leaves belong to nobody. */
void canopy_loopback_disown(canopy_loopback_endpoint_t *self);

#endif
