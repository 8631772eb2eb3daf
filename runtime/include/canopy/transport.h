/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Messages that come in several packets: the broadcasts of J1939's transport protocol (SAE J1939-21, TP.BAM). An
 * announcement says which parameter group comes and how long it is; packets of 7 bytes follow, in order and without a gap
 * of more than CANOPY_TRANSPORT_GAP_US. A sender has one broadcast at a time. What is not whole is dropped and counted.
 *
 * Threads: the loop's thread only.
 */
#ifndef CANOPY_TRANSPORT_H
#define CANOPY_TRANSPORT_H

#include <stdint.h>

#include "canopy/clock.h"

/** Most bytes of such a message: 255 packets of 7. */
#define CANOPY_TRANSPORT_BYTES_MAX 1785u

/** J1939-21's T1: the longest time from one packet to the next [us]. */
#define CANOPY_TRANSPORT_GAP_US 750000u

/** One message of several packets that the controller receives. Constant. */
typedef struct {
    uint16_t message; /**< Its place in canopy_bus_t.rx. */
    uint16_t place;   /**< Of its bytes in canopy_bus_state_t.transport_data; there is room for its longest. */
} canopy_transport_t;

/** What has come of it so far. */
typedef struct {
    canopy_time_t announced_at; /**< When its values were told to be there: from here their age counts. */
    canopy_time_t last_at;      /**< When the last packet came. */
    uint16_t size;              /**< Bytes that are announced; 0: nothing is awaited. */
    uint16_t received;          /**< Bytes that are there. */
    uint8_t source;             /**< The sender's address. */
    uint8_t next;               /**< Number of the packet that is next. */
} canopy_transport_state_t;

#endif
