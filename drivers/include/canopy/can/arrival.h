/* SPDX-License-Identifier: MIT */
/**
 * @file
 * When a frame arrived, on CLOCK_MONOTONIC, from the kernel's stamp, which is on CLOCK_REALTIME (SO_TIMESTAMPNS).
 *
 * The difference of the two clocks is constant until somebody sets the wall clock. Both are read together at each look at
 * the queue, so a frame was stamped with the difference of the last look or with that of the look before. And a frame that
 * is taken arrived after the last time at which the queue was found empty, and before now. Of the two possible times the
 * one within these bounds counts; of two the older; without any, the time at which the queue was empty. So a frame never
 * looks younger than it is when the wall clock is set, once between two looks, by more than such a look takes (microseconds).
 *
 * Pure but for canopy_arrival_clocks(); no state but the object. All times in ns.
 */
#ifndef CANOPY_CAN_ARRIVAL_H
#define CANOPY_CAN_ARRIVAL_H

#include <stdint.h>

/** What is known of the queue and of the clocks. */
typedef struct {
    int64_t empty_at; /**< Monotonic: whatever is taken from now on arrived later than this. */
    struct {
        int64_t low;  /**< CLOCK_REALTIME minus CLOCK_MONOTONIC is at least this, */
        int64_t high; /**< and at most this. */
    } now, before;    /**< At the last look, and at the one before. */
} canopy_arrival_t;

/** Both clocks, read one after the other. */
typedef struct {
    int64_t before; /**< Monotonic, read first. */
    int64_t real;   /**< The wall clock. */
    int64_t after;  /**< Monotonic, read last: this is now. */
} canopy_arrival_clocks_t;

/** Reads CLOCK_MONOTONIC. */
int64_t canopy_arrival_monotonic(void);

/**
 * Completes a look at the clocks: reads CLOCK_REALTIME and then CLOCK_MONOTONIC.
 * @param before canopy_arrival_monotonic(), read earlier, but not long ago
 */
canopy_arrival_clocks_t canopy_arrival_clocks(int64_t before);

/** Starts with an empty queue. */
void canopy_arrival_start(canopy_arrival_t *self, const canopy_arrival_clocks_t *clocks);

/** Takes a look at the clocks, after frames were taken and before they are asked about. */
void canopy_arrival_look(canopy_arrival_t *self, const canopy_arrival_clocks_t *clocks);

/**
 * When a frame arrived.
 * @param stamp the kernel's stamp, CLOCK_REALTIME; 0: it has none
 * @param now   `after` of the last look
 * @return CLOCK_MONOTONIC, `empty_at`..`now`
 */
int64_t canopy_arrival_of(const canopy_arrival_t *self, int64_t stamp, int64_t now);

#endif
