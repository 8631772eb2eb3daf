/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Clock driver for POSIX systems, and the program's stop flag.
 *
 * Threads: any; the functions share nothing but the stop flag, which is atomic.
 * Blocking: only wait_until blocks.
 */
#ifndef CANOPY_CLOCK_POSIX_H
#define CANOPY_CLOCK_POSIX_H

#include <stdatomic.h>

#include "canopy/clock.h"
#include "canopy/status.h"

/** Longest time after which a stop flag is noticed that was set without a signal to the waiting thread [µs]. */
#define CANOPY_POSIX_CLOCK_SLICE_US 100000u

/** The driver's object. Owned by the caller, stays where it is. */
typedef struct {
    canopy_clock_t clock;    /**< The driver: hand &posix_clock.clock to the loop. Time is CLOCK_MONOTONIC. */
    const atomic_bool *stop; /* private */
} canopy_posix_clock_t;

/**
 * Makes the clock; it needs no closing.
 *
 * @param self  the object
 * @param stop  wait_until() ends with false soon after this has become true, also when the deadline is past then;
 *              NULL: never
 */
void canopy_posix_clock_init(canopy_posix_clock_t *self, const atomic_bool *stop);

/**
 * Lets SIGINT and SIGTERM set the program's stop flag, so that the loop ends in good order. Only the first of each:
 * the second kills the program, should it hang. Blocking system calls end with EINTR.
 *
 * @param stop  receives the address of the flag (static, one for the program)
 * @return CANOPY_OK; CANOPY_ERROR_ARGUMENT: NULL; CANOPY_ERROR_IO: sigaction() failed, with errno.
 */
canopy_error_t canopy_posix_stop_on_signals(const atomic_bool **stop);

#endif
