/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Time: 64-bit microseconds, monotonic, from any start. The engine never reads a clock; the loop does, through this.
 */
#ifndef CANOPY_CLOCK_H
#define CANOPY_CLOCK_H

#include <stdbool.h>
#include <stdint.h>

/** A point in time or a duration [µs]. */
typedef uint64_t canopy_time_t;

/** A clock driver: functions and the object they work on. Both are called from the loop's thread only. */
typedef struct {
    /** The driver's object; handed to every function. */
    void *context;
    /** Now [µs]. Never goes back. */
    canopy_time_t (*now)(void *context);
    /**
     * Returns when now() has reached deadline (at once when it is past), or earlier when the program shall stop.
     * @return true when the deadline was reached, false when the loop shall end (a signal, end of a simulation).
     */
    bool (*wait_until)(void *context, canopy_time_t deadline);
} canopy_clock_t;

/**
 * True when the time `now` is at or after `deadline`; right across the wrap-around of the 64-bit count, as long as the
 * two are less than 2^63 us apart. O(1); may be called from anywhere.
 */
/*@ assigns \nothing;
    ensures \forall integer turns, elapsed; now == deadline + elapsed + turns * (UINT64_MAX + 1) &&
            -0x8000000000000000 <= elapsed < 0x8000000000000000 ==> (\result == true <==> elapsed >= 0);
*/
static inline bool canopy_time_reached(canopy_time_t now, canopy_time_t deadline)
{
    return (now - deadline) < (UINT64_C(1) << 63);
}

#endif
