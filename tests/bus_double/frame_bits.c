/* SPDX-License-Identifier: MIT */
/** @file Frames as bits; the contract, and the source, are in frame_bits.h. */
#include "frame_bits.h"

#include <stdbool.h>

enum { BASE_ID_BITS = 11, EXTENSION_BITS = 18, CRC_BITS = 15, CRC_POLYNOMIAL = 0x4599, STUFFED_AFTER = 5 };

uint16_t frame_crc(const uint8_t *bits, unsigned count)
{
    unsigned crc = 0;

    for (unsigned index = 0; index < count; index++) {
        unsigned next = bits[index] ^ ((crc >> (CRC_BITS - 1)) & 1u);

        crc = (crc << 1) & 0x7FFFu;
        crc ^= next != 0u ? (unsigned)CRC_POLYNOMIAL : 0u;
    }
    return (uint16_t)crc;
}

/** Appends a number, its highest bit first. @return the new count */
static unsigned put(uint8_t *bits, unsigned count, uint32_t value, unsigned width)
{
    for (unsigned bit = width; bit > 0u; bit--) {
        bits[count++] = (uint8_t)((value >> (bit - 1u)) & 1u);
    }
    return count;
}

unsigned frame_fields(const canopy_can_frame_t *frame, uint8_t bits[FRAME_BITS_MAX])
{
    const uint32_t remote = (frame->flags & CANOPY_CAN_REMOTE) != 0u ? 1u : 0u;
    unsigned count = put(bits, 0, 0u, 1); /* start of frame */

    if ((frame->flags & CANOPY_CAN_EXTENDED) != 0u) {
        count = put(bits, count, frame->id >> EXTENSION_BITS, BASE_ID_BITS);
        count = put(bits, count, 3u, 2); /* SRR and IDE, recessive */
        count = put(bits, count, frame->id, EXTENSION_BITS);
        count = put(bits, count, remote, 1);
        count = put(bits, count, 0u, 2); /* r1, r0 */
    } else {
        count = put(bits, count, frame->id, BASE_ID_BITS);
        count = put(bits, count, remote, 1);
        count = put(bits, count, 0u, 2); /* IDE, r0 */
    }
    count = put(bits, count, frame->length, 4);
    for (unsigned byte = 0; remote == 0u && byte < frame->length; byte++) {
        count = put(bits, count, frame->data[byte], 8);
    }
    return count;
}

unsigned frame_bits(const canopy_can_frame_t *frame, uint8_t bits[FRAME_BITS_MAX])
{
    uint8_t plain[FRAME_BITS_MAX];
    unsigned fields = frame_fields(frame, plain);
    unsigned all = put(plain, fields, frame_crc(plain, fields), CRC_BITS);
    unsigned count = 0;
    unsigned run = 0;

    for (unsigned index = 0; index < all; index++) {
        run = count > 0u && bits[count - 1u] == plain[index] ? run + 1u : 1u;
        bits[count++] = plain[index];
        if (run == (unsigned)STUFFED_AFTER) {
            bits[count++] = (uint8_t)(plain[index] ^ 1u);
            run = 1;
        }
    }
    return count;
}

unsigned frame_length(const canopy_can_frame_t *frame)
{
    uint8_t bits[FRAME_BITS_MAX];

    return frame_bits(frame, bits) + (unsigned)FRAME_TAIL;
}

uint32_t frame_rank(const canopy_can_frame_t *frame)
{
    const uint32_t remote = (frame->flags & CANOPY_CAN_REMOTE) != 0u ? 1u : 0u;

    if ((frame->flags & CANOPY_CAN_EXTENDED) != 0u) {
        return ((frame->id >> EXTENSION_BITS) << 21) | (3u << 19) | ((frame->id & 0x3FFFFu) << 1) | remote;
    }
    return (frame->id << 21) | (remote << 20);
}
