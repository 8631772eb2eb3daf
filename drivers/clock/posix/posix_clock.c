/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Clock driver for POSIX systems; the contract is in clock/posix.h.
 */
#include <stdbool.h>
#include <stddef.h>
#include <time.h>

#include "canopy/clock/posix.h"

#define US_PER_S UINT64_C(1000000)

static canopy_time_t posix_now(void *context)
{
    (void)context;
    struct timespec now = {0};
    /* Cannot fail: the clock's id is a constant that POSIX demands. */
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (canopy_time_t)now.tv_sec * US_PER_S + (canopy_time_t)now.tv_nsec / 1000u;
}

static bool posix_wait_until(void *context, canopy_time_t deadline)
{
    const canopy_posix_clock_t *self = context;
    for (;;) {
        if (self->stop != NULL && atomic_load_explicit(self->stop, memory_order_relaxed)) {
            return false;
        }
        const canopy_time_t now = posix_now(context);
        if (canopy_time_reached(now, deadline)) {
            return true;
        }
        /* In slices: a signal that comes between the look at the flag and the sleep must not cost a whole period. */
        const canopy_time_t left = deadline - now;
        const canopy_time_t until = left > CANOPY_POSIX_CLOCK_SLICE_US ? now + CANOPY_POSIX_CLOCK_SLICE_US : deadline;
        const struct timespec wake = {.tv_sec = (time_t)(until / US_PER_S),
                                      .tv_nsec = (long)(until % US_PER_S) * 1000L};
        (void)clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &wake, NULL);
    }
}

void canopy_posix_clock_init(canopy_posix_clock_t *self, const atomic_bool *stop)
{
    self->clock = (canopy_clock_t){.context = self, .now = posix_now, .wait_until = posix_wait_until};
    self->stop = stop;
}
