/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Opens a CAN bus by its name, as all Canopy tools take it on the command line:
 *
 *   socketcan:vcan0         an interface of the Linux kernel
 *   unixbus:bus0            a virtual bus (docs/unixbus.md)
 *   unixbus:/path/of/folder the same, with the folder itself
 *
 * Threads and blocking: as the driver chosen; see canopy/can/socketcan.h and canopy/can/unixbus.h.
 */
#ifndef CANOPY_CAN_OPEN_H
#define CANOPY_CAN_OPEN_H

#include <stddef.h>

#include "canopy/acceptance.h"
#include "canopy/can.h"
#include "canopy/can/socketcan.h"
#include "canopy/can/unixbus.h"
#include "canopy/status.h"

/** Size that is enough for any message of canopy_can_open() with a spec of up to 100 characters [bytes]. */
#define CANOPY_CAN_OPEN_MESSAGE 400u

/** An open bus of any kind. Owned by the caller, stays where it is while open; make it static (about 160 KiB). */
typedef struct {
    const canopy_can_t *can; /**< The driver: hand it to the loop. NULL when closed. */
    enum { CANOPY_CAN_OPEN_NONE, CANOPY_CAN_OPEN_SOCKETCAN, CANOPY_CAN_OPEN_UNIXBUS } kind; /**< Which of `driver`. */
    union {
        canopy_socketcan_t socketcan;
        canopy_unixbus_t unixbus;
    } driver;
} canopy_can_port_t;

/**
 * Opens a bus.
 *
 * @param port          the object
 * @param spec          "driver:bus", as above
 * @param acceptance    filter, which lives as long as the port is open: the application's `acceptance`,
 *                      CANOPY_CAN_ACCEPT_EVERYTHING, or a list of your own; NULL is an error
 * @param message       on failure receives one line: what is wrong and the way out
 * @param message_size  its size [bytes]; a longer message is shortened
 * @return CANOPY_OK; else the driver's error, or CANOPY_ERROR_ARGUMENT for a spec of no known form.
 */
canopy_error_t canopy_can_open(canopy_can_port_t *port, const char *spec, const canopy_can_acceptance_t *acceptance,
                               char *message, size_t message_size);

/**
 * What the user should know about the open bus now: what this driver cannot promise on it, and what to do. A program prints
 * it when it starts. O(1).
 * @param number 0 for the first text, 1 for the second ...
 * @return one line; NULL: no more
 */
const char *canopy_can_advice(const canopy_can_port_t *port, unsigned number);

/** Closes; nothing happens when it is closed already. Afterwards `can` is NULL: nothing may use the driver any more. */
void canopy_can_close(canopy_can_port_t *port);

#endif
