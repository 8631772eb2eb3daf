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
    self->now.low = clocks->real - clocks->after;
    self->now.high = clocks->real - clocks->before;
    self->before = self->now;
}

void canopy_arrival_look(canopy_arrival_t *self, const canopy_arrival_clocks_t *clocks)
{
    int64_t low = clocks->real - clocks->after;
    int64_t high = clocks->real - clocks->before;
    bool is_as_before = low <= self->now.high && high >= self->now.low;

    self->before = self->now;
    /* While nobody sets the clock, each look says more exactly what the difference is. */
    self->now.low = is_as_before && self->now.low > low ? self->now.low : low;
    self->now.high = is_as_before && self->now.high < high ? self->now.high : high;
}

int64_t canopy_arrival_of(const canopy_arrival_t *self, int64_t stamp, int64_t now)
{
    /* Each difference is known within bounds, so each candidate is a span, of which the oldest time counts. */
    const int64_t first[] = {stamp - self->now.high, stamp - self->before.high};
    const int64_t last[] = {stamp - self->now.low, stamp - self->before.low};
    int64_t oldest = now;
    bool found = false;

    for (unsigned index = 0; stamp != 0 && index < 2u; index++) {
        if (last[index] >= self->empty_at && first[index] <= oldest) {
            oldest = first[index] > self->empty_at ? first[index] : self->empty_at;
            found = true;
        }
    }
    return found ? oldest : self->empty_at;
}
