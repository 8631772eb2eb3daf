/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The other side of an application's bus, made from the application's own tables: sends each message that the application
 * receives, at a period, protected; and checks each command as a receiver does that knows E2E.
 *
 * Two bytes of each sent message are a number (behind the E2E header, of a short message the first two), by which a test
 * knows on the wire again what a leaf sees. It goes round after PEER_NUMBERS messages.
 */
#ifndef CANOPY_TESTS_PEER_H
#define CANOPY_TESTS_PEER_H

#include "canopy/e2e.h"
#include "canopy/loop.h"
#include "controller.h"
#include "wire.h"

enum { PEER_MESSAGES_MAX = 8, PEER_NUMBERS = 512 };

/** What a receiver has seen of one command. */
typedef struct {
    canopy_e2e_receiver_t e2e;
    uint32_t accepted;
    uint32_t refused; /**< By the E2E check. */
    uint8_t value;    /**< The last byte of the last accepted one. */
} peer_command_t;

typedef struct {
    const canopy_app_t *app;
    controller_t controller;
    actor_t timer;
    nanoseconds_t period;
    bool silent; /**< Sends no more; it still acknowledges. */
    uint8_t counter[PEER_MESSAGES_MAX];
    bool loaded[PEER_MESSAGES_MAX];
    uint16_t first_number; /**< Change it before the run where the values of a message must be in another range. */
    uint16_t number;       /**< Of the last message. */
    nanoseconds_t on_wire_at[PEER_NUMBERS]; /**< By number: the end of the frame. */
    nanoseconds_t last_on_wire;
    uint32_t sent;
    peer_command_t commands[PEER_MESSAGES_MAX];
} peer_t;

/** Puts the other side to the wire. Its first messages come at once, then each period. */
void peer_init(peer_t *self, wire_t *wire, const canopy_app_t *app, nanoseconds_t period);

/** The number in a message of the other side. */
uint16_t peer_number(const canopy_can_frame_t *frame);

/** Tells it of a frame on the wire. */
void peer_watch(peer_t *self, const canopy_can_frame_t *frame, nanoseconds_t end);

#endif
