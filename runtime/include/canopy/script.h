/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Helpers of the C functions that scripts become (docs/scripts.md). The compiler knows the range of every expression and
 * calls these only where 64 bits, or the type of an entry, might not be enough: then the result is limited, and counted.
 *
 * `faults` is the application's counter of such results and of divisions by zero; it saturates. O(1), re-entrant.
 */
#ifndef CANOPY_SCRIPT_H
#define CANOPY_SCRIPT_H

#include <stdint.h>

/** Counts one result that was limited. */
static inline void canopy_script_fault(uint32_t *faults)
{
    if (*faults != UINT32_MAX) {
        (*faults)++;
    }
}

/** @return value, limited to [low, high] */
static inline int64_t canopy_limit(int64_t value, int64_t low, int64_t high, uint32_t *faults)
{
    if (value < low || value > high) {
        canopy_script_fault(faults);
    }
    return value < low ? low : value > high ? high : value;
}

/** @return an unsigned 64-bit value as a signed one, limited to INT64_MAX */
static inline int64_t canopy_limit_unsigned(uint64_t value, uint32_t *faults)
{
    if (value > (uint64_t)INT64_MAX) {
        canopy_script_fault(faults);
        return INT64_MAX;
    }
    return (int64_t)value;
}

/** @return ~value */
static inline int64_t canopy_complement(int64_t value)
{
    return ~value;
}

/** @return a + b, saturated */
static inline int64_t canopy_add(int64_t a, int64_t b, uint32_t *faults)
{
    if (b > 0 ? a > INT64_MAX - b : a < INT64_MIN - b) {
        canopy_script_fault(faults);
        return b > 0 ? INT64_MAX : INT64_MIN;
    }
    return a + b;
}

/** @return a - b, saturated */
static inline int64_t canopy_subtract(int64_t a, int64_t b, uint32_t *faults)
{
    if (b < 0 ? a > INT64_MAX + b : a < INT64_MIN + b) {
        canopy_script_fault(faults);
        return b < 0 ? INT64_MAX : INT64_MIN;
    }
    return a - b;
}

/** @return a * b, saturated */
static inline int64_t canopy_multiply(int64_t a, int64_t b, uint32_t *faults)
{
    uint64_t x = a < 0 ? UINT64_C(0) - (uint64_t)a : (uint64_t)a;
    uint64_t y = b < 0 ? UINT64_C(0) - (uint64_t)b : (uint64_t)b;
    uint64_t most = (uint64_t)INT64_MAX;
    uint64_t product;

    if ((a < 0) != (b < 0)) {
        most++;
    }
    if (x != 0u && y > most / x) {
        canopy_script_fault(faults);
        return (a < 0) != (b < 0) ? INT64_MIN : INT64_MAX;
    }
    product = x * y;
    if ((a < 0) == (b < 0)) {
        return (int64_t)product;
    }
    return product == most ? INT64_MIN : -(int64_t)product;
}

/** @return a / b; 0 when b is 0, which is counted. Only in applications that allow floating point. */
static inline double canopy_divide(double a, double b, uint32_t *faults)
{
    if (!(b < 0.0) && !(b > 0.0)) {
        canopy_script_fault(faults);
        return 0.0;
    }
    return a / b;
}

/** @return a floating-point number as a whole one, towards zero, limited to [low, high]; 0 for NaN, which is counted */
static inline int64_t canopy_whole(double value, int64_t low, int64_t high, uint32_t *faults)
{
    if (!(value >= -9223372036854775808.0) || !(value < 9223372036854775808.0)) {
        canopy_script_fault(faults);
        return value > 0.0 ? high : value < 0.0 ? low : 0;
    }
    return canopy_limit((int64_t)value, low, high, faults);
}

#endif
