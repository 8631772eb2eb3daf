/* SPDX-License-Identifier: MIT */
/** @file Numbers wider than a state word: state words are 16 bit, so that small states stay small. */
#ifndef CANOPY_STATE_H
#define CANOPY_STATE_H

#include "canopy/node.h"

/** A 32-bit number in two words. */
static inline uint32_t canopy_get32(const uint16_t words[2])
{
    return (uint32_t)words[0] | ((uint32_t)words[1] << 16);
}

static inline void canopy_set32(uint16_t words[2], uint32_t value)
{
    words[0] = (uint16_t)(value & 0xFFFFu);
    words[1] = (uint16_t)(value >> 16);
}

/** A time in four words: sets it to msec after now. */
static inline void canopy_start_timer(const canopy_tree_instance_t *self, uint16_t words[4], int32_t msec)
{
    canopy_time_t deadline = self->now + ((canopy_time_t)msec * 1000u);

    for (unsigned word = 0; word < 4u; word++) {
        words[word] = (uint16_t)((deadline >> (16u * word)) & 0xFFFFu);
    }
}

/** Is the time in these words reached? */
static inline bool canopy_timer_is_over(const canopy_tree_instance_t *self, const uint16_t words[4])
{
    canopy_time_t deadline = 0;

    for (unsigned word = 0; word < 4u; word++) {
        deadline |= (canopy_time_t)words[word] << (16u * word);
    }
    return canopy_time_reached(self->now, deadline);
}

#endif
