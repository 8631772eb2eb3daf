/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Which frames a CAN driver hands to the loop, and which it takes from it: the same words for every driver.
 * The functions have no state, never block, and may be called from anywhere.
 */
#ifndef CANOPY_CAN_ACCEPTANCE_H
#define CANOPY_CAN_ACCEPTANCE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "canopy/can.h"

/** Or-ed to an id of the list: the id is a 29-bit one. The same bit as SocketCAN's and the DBC's. */
#define CANOPY_CAN_ACCEPT_EXTENDED (UINT32_C(1) << 31)

/** Most ids in a list (the limit of SocketCAN). */
#define CANOPY_CAN_ACCEPT_MAX 512u

/**
 * The acceptance filter: an exact list of ids. Data and remote frames with an id of the list are handed over (that a
 * remote frame is not the message is the codec's business, which counts it), all others vanish uncounted, as in a CAN
 * controller's filter. Where a driver takes a pointer to this, NULL means: every data and remote frame.
 */
typedef struct {
    const uint32_t *ids; /**< Lives as long as the driver is open. NULL (and count 0): every id. */
    size_t count;        /**< 0..CANOPY_CAN_ACCEPT_MAX */
    bool error_frames;   /**< Hand error frames over too (flag CANOPY_CAN_ERROR); they are counted in any case. */
} canopy_can_acceptance_t;

/** True when the list is one that a driver can be opened with. O(1). */
static inline bool canopy_can_acceptance_is_valid(const canopy_can_acceptance_t *acceptance)
{
    return acceptance == NULL ||
           (acceptance->count <= CANOPY_CAN_ACCEPT_MAX && (acceptance->ids == NULL) == (acceptance->count == 0u));
}

/** True when the frame shall be handed to the loop. O(count): the lists of a robot's node are short. */
static inline bool canopy_can_accepts(const canopy_can_acceptance_t *acceptance, const canopy_can_frame_t *frame)
{
    if ((frame->flags & CANOPY_CAN_ERROR) != 0) {
        return acceptance != NULL && acceptance->error_frames;
    }
    if (acceptance == NULL || acceptance->count == 0u) {
        return true;
    }
    const uint32_t extended = (frame->flags & CANOPY_CAN_EXTENDED) != 0 ? CANOPY_CAN_ACCEPT_EXTENDED : 0u;
    for (size_t i = 0; i < acceptance->count; i++) {
        if (acceptance->ids[i] == (frame->id | extended)) {
            return true;
        }
    }
    return false;
}

/**
 * True when the frame can exist on a CAN bus (ISO 11898-1): id within its 11 or 29 bits, a length that has a DLC,
 * no remote request and no bit-rate switch where the format has none. O(1).
 */
static inline bool canopy_can_frame_is_valid(const canopy_can_frame_t *frame)
{
    static const uint8_t fd_lengths[] = {12, 16, 20, 24, 32, 48, 64};
    const unsigned flags = frame->flags;
    const bool fd = (flags & CANOPY_CAN_FD) != 0u;
    if ((flags & ~(2u * CANOPY_CAN_ERROR_STATE - 1u)) != 0u) {
        return false;
    }
    if (fd && (flags & (CANOPY_CAN_REMOTE | CANOPY_CAN_ERROR)) != 0u) {
        return false;
    }
    if (!fd && (flags & (CANOPY_CAN_BITRATE_SWITCH | CANOPY_CAN_ERROR_STATE)) != 0u) {
        return false;
    }
    /* The id of an error frame is a set of error classes, wider than 11 bits. */
    if (frame->id > ((flags & (CANOPY_CAN_EXTENDED | CANOPY_CAN_ERROR)) != 0u ? UINT32_C(0x1FFFFFFF) : 0x7FFu)) {
        return false;
    }
    if (frame->length <= 8u) {
        return true;
    }
    for (size_t i = 0; fd && i < sizeof fd_lengths; i++) {
        if (frame->length == fd_lengths[i]) {
            return true;
        }
    }
    return false;
}

/** True when the loop may send the frame: a valid one, and no error frame (those are the driver's alone). O(1). */
static inline bool canopy_can_frame_can_be_sent(const canopy_can_frame_t *frame)
{
    return (frame->flags & CANOPY_CAN_ERROR) == 0 && canopy_can_frame_is_valid(frame);
}

#endif
