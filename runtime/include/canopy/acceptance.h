/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Which frames a CAN driver hands to the loop, and which it takes from it: the same words for every driver.
 * The functions have no state, never block, and may be called from anywhere.
 */
#ifndef CANOPY_ACCEPTANCE_H
#define CANOPY_ACCEPTANCE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "canopy/can.h"

/** Or-ed to an id of the list: the id is a 29-bit one. The same bit as SocketCAN's and the DBC's. */
#define CANOPY_CAN_ACCEPT_EXTENDED (UINT32_C(1) << 31)

/** Most ids in a list and those that it continues with (the limit of SocketCAN). */
#define CANOPY_CAN_ACCEPT_MAX 512u

/**
 * A set of ids: those with (id ^ `id`) & `mask` == 0. Bit 31 is 1 in an extended id (CANOPY_CAN_ACCEPT_EXTENDED). Standard
 * ids are in bits 0..10, extended ones in bits 0..28. Bits 11..30 of a standard mask are 0.
 */
typedef struct {
    uint32_t id;
    uint32_t mask;
} canopy_can_mask_t;

/**
 * The acceptance filter: an exact list of ids, and of sets of ids. Data and remote frames with an id of the list are handed over (that a
 * remote frame is not the message is the codec's business, which counts it), all others vanish uncounted, as in a CAN
 * controller's filter. An application has the list of what it receives in `canopy_app_t.acceptance`; to receive more, make
 * a list that continues with it.
 */
typedef struct canopy_can_acceptance {
    const uint32_t *ids;            /**< Lives as long as the driver is open. NULL when count is 0. */
    uint16_t count;                 /**< 0..CANOPY_CAN_ACCEPT_MAX */
    uint16_t mask_count;            /**< 0..CANOPY_CAN_ACCEPT_MAX; both together at most that. */
    bool everything;                /**< Every data and remote frame, whatever the ids: for tools that watch. */
    bool error_frames;              /**< Error frames too (flag CANOPY_CAN_ERROR); they are counted in any case. */
    const canopy_can_mask_t *masks; /**< With bit 31 in each mask. Lives as long. NULL when mask_count is 0. */
    const struct canopy_can_acceptance *next; /**< The list continues there; NULL: it ends. */
} canopy_can_acceptance_t;

/* No compound literal: drivers keep the pointer, and a literal within a function would be gone by then. */
static const canopy_can_acceptance_t canopy_can_everything = {.everything = true};

/** Every data and remote frame. */
#define CANOPY_CAN_ACCEPT_EVERYTHING (&canopy_can_everything)

/** True when the list is one that a driver can be opened with: not NULL, no id too many, no circle. O(lists). */
static inline bool canopy_can_acceptance_is_valid(const canopy_can_acceptance_t *acceptance)
{
    uint32_t count = 0;
    uint32_t lists = 0;

    for (const canopy_can_acceptance_t *list = acceptance; list != NULL; list = list->next) {
        count += (uint32_t)list->count + list->mask_count;
        lists++;
        if (count > CANOPY_CAN_ACCEPT_MAX || lists > CANOPY_CAN_ACCEPT_MAX ||
            (list->ids == NULL) != (list->count == 0u) || (list->masks == NULL) != (list->mask_count == 0u)) {
            return false;
        }
    }
    return acceptance != NULL;
}

/** True when some list of the filter asks for every frame. O(lists). */
static inline bool canopy_can_accepts_everything(const canopy_can_acceptance_t *acceptance)
{
    for (const canopy_can_acceptance_t *list = acceptance; list != NULL; list = list->next) {
        if (list->everything) {
            return true;
        }
    }
    return false;
}

/** True when some of the sets has the id; `id` with CANOPY_CAN_ACCEPT_EXTENDED for a 29-bit one. O(count). */
static inline bool canopy_can_masks_accept(const canopy_can_mask_t *masks, uint16_t count, uint32_t id)
{
    for (uint16_t index = 0; index < count; index++) {
        if (((masks[index].id ^ id) & masks[index].mask) == 0u) {
            return true;
        }
    }
    return false;
}

/** True when the list, or one that it continues with, has the id; as for canopy_can_masks_accept(). O(ids). */
static inline bool canopy_can_is_listed(const canopy_can_acceptance_t *acceptance, uint32_t id)
{
    for (const canopy_can_acceptance_t *list = acceptance; list != NULL; list = list->next) {
        for (uint16_t index = 0; index < list->count; index++) {
            if (list->ids[index] == id) {
                return true;
            }
        }
        if (canopy_can_masks_accept(list->masks, list->mask_count, id)) {
            return true;
        }
    }
    return false;
}

/** True when the frame shall be handed to the loop. O(ids): the lists of a robot's node are short. */
static inline bool canopy_can_accepts(const canopy_can_acceptance_t *acceptance, const canopy_can_frame_t *frame)
{
    const bool error = (frame->flags & CANOPY_CAN_ERROR) != 0;
    const uint32_t id = frame->id | ((frame->flags & CANOPY_CAN_EXTENDED) != 0 ? CANOPY_CAN_ACCEPT_EXTENDED : 0u);

    for (const canopy_can_acceptance_t *list = acceptance; list != NULL; list = list->next) {
        if (error ? list->error_frames : list->everything) {
            return true;
        }
    }
    return !error && canopy_can_is_listed(acceptance, id);
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
