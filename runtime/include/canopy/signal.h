/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Helpers of the generated codecs and images: raw values, sign extension, and who may write an output.
 * All are O(1) and have no state of their own; the bits that canopy_output_claim() works on belong to the loop's thread.
 */
#ifndef CANOPY_SIGNAL_H
#define CANOPY_SIGNAL_H

#include <stdbool.h>
#include <stdint.h>

/**
 * Raw value of a physical constant, rounded to the nearest. For constant expressions only, which the compiler folds:
 * then no floating point is left in the program (the build checks the runtime for that, not your leaves).
 */
#define CANOPY_RAW(type, physical, scale, offset)                                                   \
    ((type)(((((physical) - (offset)) / (scale)) < 0.0) ? (((physical) - (offset)) / (scale)) - 0.5 \
                                                        : (((physical) - (offset)) / (scale)) + 0.5))

/**
 * Raw value that is nearest to a physical one in fixed point, (value - offset) / step, halves away from 0; limited to
 * low..high. Exact for every value.
 * @param step   not 0. low * step + offset and high * step + offset fit an int64_t, and so do their parts
 */
static inline int64_t canopy_raw_of_fixed(int64_t value, int64_t step, int64_t offset, int64_t low, int64_t high)
{
    const bool up = step > 0;
    const int64_t smallest = (up ? low : high) * step + offset;
    const int64_t largest = (up ? high : low) * step + offset;
    int64_t raw, rest;

    if (value <= smallest) {
        return up ? low : high;
    }
    if (value >= largest) {
        return up ? high : low;
    }
    raw = (value - offset) / step;
    rest = (value - offset) % step;
    if ((rest < 0 ? -rest : rest) >= (up ? step : -step) - (rest < 0 ? -rest : rest)) {
        raw += (rest < 0) == up ? -1 : 1;
    }
    return raw;
}

/** Value of a two's complement number in the low `bits` (1..31) of raw; the bits above must be 0. */
static inline int32_t canopy_sign_extend32(uint32_t raw, unsigned bits)
{
    uint32_t sign = UINT32_C(1) << (bits - 1u);

    return (int32_t)(raw ^ sign) - (int32_t)sign;
}

/** As canopy_sign_extend32(), for 1..63 bits. */
static inline int64_t canopy_sign_extend64(uint64_t raw, unsigned bits)
{
    uint64_t sign = UINT64_C(1) << (bits - 1u);

    return (int64_t)(raw ^ sign) - (int64_t)sign;
}

/**
 * May this write to output number `signal` stand? Rule 5 of docs/semantics.md: what a ticked action writes wins over
 * what a halt handler writes in the same tick, whichever came first.
 *
 * @param written one bit a signal: it has been written by a ticked action in this tick
 * @param signal  0..32 * the number of words - 1; not checked
 * @param halting the write comes from a halt handler
 * @return true: write it. A ticked action's write may always stand.
 */
static inline bool canopy_output_claim(uint32_t *written, unsigned signal, bool halting)
{
    uint32_t bit = UINT32_C(1) << (signal % 32u);
    uint32_t *word = &written[signal / 32u];

    if (halting) {
        return (*word & bit) == 0u;
    }
    *word |= bit;
    return true;
}

#endif
