/* SPDX-License-Identifier: MIT */
/** @file A clock for tests that stands still where the test has put it, and on which nobody can wait. */
#ifndef CANOPY_TESTS_STILL_CLOCK_H
#define CANOPY_TESTS_STILL_CLOCK_H

#include "canopy/clock.h"

static canopy_time_t clock_now;

static inline canopy_time_t still_clock_now(void *context)
{
    (void)context;
    return clock_now;
}

static inline bool still_clock_wait(void *context, canopy_time_t deadline)
{
    (void)context;
    (void)deadline;
    return false;
}

static const canopy_clock_t still_clock = {.now = still_clock_now, .wait_until = still_clock_wait};

#endif
