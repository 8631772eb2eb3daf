/* SPDX-License-Identifier: MIT */
/** @file The kernel's receive stamps on CLOCK_MONOTONIC; the reasoning is in arrival.h. */
#include "canopy/can/arrival.h"

#include <stdbool.h>
#include <time.h>

#define NS_PER_S INT64_C(1000000000)

static int64_t read_clock(clockid_t clock)
{
    struct timespec now = {0};

    (void)clock_gettime(clock, &now); /* cannot fail: both clocks are POSIX's */
    return (int64_t)now.tv_sec * NS_PER_S + now.tv_nsec;
}

int64_t canopy_arrival_monotonic(void)
{
    return read_clock(CLOCK_MONOTONIC);
}

canopy_arrival_clocks_t canopy_arrival_clocks(int64_t before)
{
    canopy_arrival_clocks_t clocks = {.before = before};

    clocks.real = read_clock(CLOCK_REALTIME);
    clocks.after = read_clock(CLOCK_MONOTONIC);
    return clocks;
}

void canopy_arrival_start(canopy_arrival_t *self, const canopy_arrival_clocks_t *clocks)
{
    self->empty_at = clocks->before;
    self->low = clocks->real - clocks->after;
    self->high = clocks->real - clocks->before;
    self->before = self->high;
}

void canopy_arrival_look(canopy_arrival_t *self, const canopy_arrival_clocks_t *clocks)
{
    int64_t low = clocks->real - clocks->after;
    int64_t high = clocks->real - clocks->before;
    bool is_as_before = low <= self->high && high >= self->low;

    self->before = self->high;
    /* While nobody sets the clock, each look says more exactly what the difference is. */
    self->low = is_as_before && self->low > low ? self->low : low;
    self->high = is_as_before && self->high < high ? self->high : high;
}

int64_t canopy_arrival_of(const canopy_arrival_t *self, int64_t stamp, int64_t now)
{
    const int64_t candidates[] = {stamp - self->high, stamp - self->before};
    int64_t oldest = now;
    bool found = false;

    for (unsigned index = 0; stamp != 0 && index < 2u; index++) {
        if (candidates[index] >= self->empty_at && candidates[index] <= oldest) {
            oldest = candidates[index];
            found = true;
        }
    }
    return found ? oldest : self->empty_at;
}
