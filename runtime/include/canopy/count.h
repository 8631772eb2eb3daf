/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Counting that does not start again at 0. Both are O(1), have no state of their own, and may be called from anywhere.
 */
#ifndef CANOPY_COUNT_H
#define CANOPY_COUNT_H

#include <stdint.h>

/** The sum, or the largest value where that is less. */
static inline uint32_t canopy_sum(uint32_t a, uint32_t b)
{
    return a <= UINT32_MAX - b ? a + b : UINT32_MAX;
}

/** Adds one, and stays at the largest value. */
static inline void canopy_count(uint32_t *counter)
{
    *counter += *counter != UINT32_MAX ? 1u : 0u;
}

#endif
