/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Drivers behind canopy_can_t over a controller of the double, as they are written for a microcontroller.
 *
 * PORT_INTERRUPT: one interrupt takes received frames into a ring, with their time from the stamps, and is the transmit
 * context. PORT_POLLED: no interrupt; the loop's thread reads the FIFOs and mailboxes.
 */
#ifndef CANOPY_TESTS_PORT_H
#define CANOPY_TESTS_PORT_H

#include "canopy/acceptance.h"
#include "canopy/can.h"
#include "canopy/ring.h"
#include "canopy/tx.h"
#include "controller.h"
#include "wire.h"

enum { PORT_RING = 1024 };

typedef enum { PORT_INTERRUPT, PORT_POLLED } port_kind_t;

typedef struct {
    canopy_can_t can;
    controller_t controller;
    canopy_tx_t *tx;
    canopy_ring_t ring;
    canopy_can_frame_t ring_storage[PORT_RING];
    received_t heads[CONTROLLER_FIFOS]; /* the oldest frame of each FIFO, once it was read */
    bool has_head[CONTROLLER_FIFOS];
    uint32_t taken_back; /* by abort() */
    uint32_t received;
} port_t;

/** How a driver is made. */
typedef struct {
    port_kind_t kind;
    bool can_abort;
    const canopy_can_acceptance_t *acceptance; /**< Becomes filters, one an id; NULL: everything, not filtered. */
    unsigned fifos;                            /**< 1, or 2: every second id goes to the second one. */
} port_config_t;

/** Puts a controller to the wire, and a driver over it. `tx` is the application's transmit side. */
void port_init(port_t *self, wire_t *wire, const controller_config_t *controller, const port_config_t *config,
               canopy_tx_t *tx);

#endif
