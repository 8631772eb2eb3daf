/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Datagram format of the unixbus, version 1 (docs/unixbus.md).
 */
#include <string.h>

#include "unixbus_internal.h"

enum { VERSION = 1 };

size_t canopy_unixbus_encode(uint8_t *datagram, const canopy_can_frame_t *frame)
{
    const size_t size = (frame->flags & CANOPY_CAN_REMOTE) != 0 ? 0u : frame->length;
    datagram[0] = VERSION;
    datagram[1] = frame->flags;
    datagram[2] = frame->length;
    datagram[CANOPY_UNIXBUS_LOST] = 0;
    for (unsigned i = 0; i < 4u; i++) {
        datagram[4u + i] = (uint8_t)(frame->id >> (8u * i));
    }
    memcpy(datagram + CANOPY_UNIXBUS_HEADER, frame->data, size);
    return CANOPY_UNIXBUS_HEADER + size;
}

bool canopy_unixbus_decode(canopy_can_frame_t *frame, const uint8_t *datagram, size_t size)
{
    if (size < CANOPY_UNIXBUS_HEADER || datagram[0] != VERSION) {
        return false;
    }
    frame->flags = datagram[1];
    frame->length = datagram[2];
    frame->id = 0;
    for (unsigned i = 0; i < 4u; i++) {
        frame->id |= (uint32_t)datagram[4u + i] << (8u * i);
    }
    const size_t data_size = (frame->flags & CANOPY_CAN_REMOTE) != 0 ? 0u : frame->length;
    if (!canopy_can_frame_is_valid(frame) || size != CANOPY_UNIXBUS_HEADER + data_size) {
        return false;
    }
    memcpy(frame->data, datagram + CANOPY_UNIXBUS_HEADER, data_size);
    return true;
}
