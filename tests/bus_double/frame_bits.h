/* SPDX-License-Identifier: MIT */
/**
 * @file
 * A classic CAN frame as its bits on the wire: field by field, CRC-15 and stuff bits of the actual content.
 * Source: Bosch, "CAN Specification 2.0", part B, chapters 3 (frames) and 5 (bit stuffing); ISO 11898-1 says the same.
 */
#ifndef CANOPY_TESTS_FRAME_BITS_H
#define CANOPY_TESTS_FRAME_BITS_H

#include <stdint.h>

#include "canopy/can.h"

enum {
    FRAME_BITS_MAX = 160, /**< Start of frame to the CRC's last bit, 29-bit id, 8 bytes, most stuff bits: 147. */
    ACK_SLOT_END = 2,     /**< From the end of the CRC: its delimiter, then the slot. */
    VALID_FOR_RECEIVER =
        7, /**< From the end of the slot: the slot's delimiter, and 6 of the 7 bits of the end of frame. */
    INTERMISSION = 3,
    FRAME_TAIL = ACK_SLOT_END + VALID_FOR_RECEIVER + 1 + INTERMISSION /**< 13: what comes after the CRC. */
};

/** CRC-15 (polynomial 0x4599) of bits, the first one first. */
uint16_t frame_crc(const uint8_t *bits, unsigned count);

/**
 * The fields from the start of frame to the last bit of data, without stuff bits, each bit a byte 0 (dominant) or 1.
 * @param frame classic, 0..8 bytes; not checked
 * @return how many, at most 103
 */
unsigned frame_fields(const canopy_can_frame_t *frame, uint8_t bits[FRAME_BITS_MAX]);

/** The same, with the CRC and all stuff bits: what is on the wire up to the CRC's delimiter. @return how many */
unsigned frame_bits(const canopy_can_frame_t *frame, uint8_t bits[FRAME_BITS_MAX]);

/** Bits from the start of frame to the end of the intermission: what the frame takes of the bus. */
unsigned frame_length(const canopy_can_frame_t *frame);

/** Who wins the arbitration: the lower one. Standard before extended, data before remote, with the same first 11 bits. */
uint32_t frame_rank(const canopy_can_frame_t *frame);

#endif
