/* SPDX-License-Identifier: MIT */
/**
 * @file
 * End-to-end protection of a message: AUTOSAR E2E Profile 11 (the newer name of Profile 1), DataIDMode BOTH.
 *
 * Byte 0 is a CRC-8 (SAE J1850's polynomial 0x1D, but start value and final XOR 0) over the 16-bit data id, low byte
 * first, and bytes 1..length-1. The low half of byte 1 is a counter 0..14. The data id is not sent: a frame that carries the right
 * bytes under the wrong arbitration id does not pass.
 *
 * Threads: the functions have no state of their own, never block, and may be called from anywhere; a receiver's memory
 * belongs to one thread.
 *
 * Source: AUTOSAR PRS_E2EProtocol, Profile 11. The tests compare with the PyPI package `autosar-e2e`.
 */
#ifndef CANOPY_E2E_H
#define CANOPY_E2E_H

#include <stdbool.h>
#include <stdint.h>

/** The counter runs 0..14; 15 is not a valid counter. */
#define CANOPY_E2E_COUNTERS 15u

/** Largest step of the counter that is accepted: up to two frames in a row may be lost. */
#define CANOPY_E2E_DELTA_MAX 3u

/** What the check says of a frame. */
typedef enum {
    CANOPY_E2E_OK = 0,        /**< Use it. */
    CANOPY_E2E_WRONG_CRC,     /**< Damaged, or not this message. Nothing was changed. */
    CANOPY_E2E_REPEATED,      /**< The same frame again: the sender's application may be stuck. */
    CANOPY_E2E_WRONG_SEQUENCE /**< Too many lost, or the sender restarted: not used, but the next one in order is. */
} canopy_e2e_result_t;

/** A receiver's memory for one message. All zero is the start: the first good frame is accepted. */
typedef struct {
    uint8_t counter; /**< Of the last frame with a right CRC. */
    bool started;
} canopy_e2e_receiver_t;

/**
 * The CRC that belongs into byte 0 of a protected message.
 * @param data   `length` bytes; byte 0 is not looked at
 * @param length 2..64; not checked
 *
 * O(length), 5 instructions per byte on Cortex-M4 with -O2, 6 with -Os, and 12 more; with a table of 256 bytes in flash.
 */
uint8_t canopy_e2e_crc(uint16_t data_id, const uint8_t *data, uint8_t length);

/**
 * Writes counter (0..14, not checked) and CRC into a message of 2..64 bytes. The high half of byte 1 is kept. O(length).
 */
void canopy_e2e_protect(uint16_t data_id, uint8_t counter, uint8_t *data, uint8_t length);

/** Checks a message of 2..64 bytes (not checked) and moves the receiver's memory on, unless the CRC is wrong. O(length). */
canopy_e2e_result_t canopy_e2e_check(canopy_e2e_receiver_t *receiver, uint16_t data_id, const uint8_t *data,
                                     uint8_t length);

#endif
