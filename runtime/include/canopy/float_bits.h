/* SPDX-License-Identifier: MIT */
/**
 * @file
 * IEEE 754 numbers as bits, for the generated codecs of buses with float signals. Nothing here computes with floats, so no
 * floating-point unit and no helper of the compiler's library is needed: values are only copied and compared as integers.
 *
 * All functions are O(1), have no state, and may be called from anywhere.
 *
 * How bits are compared: IEEE numbers are sign and magnitude, and for positive ones a larger number has larger bits. With
 * the magnitude's bits inverted where the sign is set, the bits as a two's complement integer are in the order of the
 * numbers:
 *
 *     -NaN < -infinity < ... < -1 < ... < -0 < +0 < ... < 1 < ... < +infinity < +NaN
 *
 * So one comparison with two finite ends refuses what is outside, both infinities, and every NaN.
 */
#ifndef CANOPY_FLOAT_BITS_H
#define CANOPY_FLOAT_BITS_H

#include <float.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

_Static_assert(sizeof(float) == 4 && FLT_MANT_DIG == 24 && FLT_MAX_EXP == 128, "float must be IEEE binary32");
_Static_assert(sizeof(double) == 8 && DBL_MANT_DIG == 53 && DBL_MAX_EXP == 1024,
               "double must be IEEE binary64: do not compile with -fshort-double");

/** The bits of a number. */
static inline uint32_t canopy_float32_bits(float value)
{
    uint32_t bits;

    (void)memcpy(&bits, &value, sizeof bits);
    return bits;
}

/** The number that has these bits. */
static inline float canopy_float32_value(uint32_t bits)
{
    float value;

    (void)memcpy(&value, &bits, sizeof value);
    return value;
}

/** Place of a number in the order above, as an unsigned integer: 0 is the least. */
static inline uint32_t canopy_float32_rank(uint32_t bits)
{
    const uint32_t sign = UINT32_C(1) << 31;

    return (bits & sign) != 0u ? ~bits : bits | sign;
}

/** Is a number a finite one in low..high? The ends are bits of finite numbers; -0 and +0 are the same number. */
static inline bool canopy_float32_within(uint32_t bits, uint32_t low, uint32_t high)
{
    const uint32_t number = bits == UINT32_C(1) << 31 ? 0u : bits;
    const uint32_t rank = canopy_float32_rank(number);

    return rank >= canopy_float32_rank(low) && rank <= canopy_float32_rank(high);
}

/** Is a number neither infinite nor NaN? */
static inline bool canopy_float32_finite(uint32_t bits)
{
    const uint32_t exponent = UINT32_C(0xFF) << 23;

    return (bits & exponent) != exponent;
}

/** What is sent for a number outside low..high: the nearer end, but `safe` for NaN and infinities. All are bits. */
static inline uint32_t canopy_float32_limit(uint32_t bits, uint32_t low, uint32_t high, uint32_t safe)
{
    if (!canopy_float32_finite(bits)) {
        return safe;
    }
    return canopy_float32_rank(bits) < canopy_float32_rank(low) ? low : high;
}

/** As canopy_float32_bits(). */
static inline uint64_t canopy_float64_bits(double value)
{
    uint64_t bits;

    (void)memcpy(&bits, &value, sizeof bits);
    return bits;
}

/** As canopy_float32_value(). */
static inline double canopy_float64_value(uint64_t bits)
{
    double value;

    (void)memcpy(&value, &bits, sizeof value);
    return value;
}

/** As canopy_float32_rank(). */
static inline uint64_t canopy_float64_rank(uint64_t bits)
{
    const uint64_t sign = UINT64_C(1) << 63;

    return (bits & sign) != 0u ? ~bits : bits | sign;
}

/** As canopy_float32_within(). */
static inline bool canopy_float64_within(uint64_t bits, uint64_t low, uint64_t high)
{
    const uint64_t number = bits == UINT64_C(1) << 63 ? 0u : bits;
    const uint64_t rank = canopy_float64_rank(number);

    return rank >= canopy_float64_rank(low) && rank <= canopy_float64_rank(high);
}

/** As canopy_float32_finite(). */
static inline bool canopy_float64_finite(uint64_t bits)
{
    const uint64_t exponent = UINT64_C(0x7FF) << 52;

    return (bits & exponent) != exponent;
}

/** As canopy_float32_limit(). */
static inline uint64_t canopy_float64_limit(uint64_t bits, uint64_t low, uint64_t high, uint64_t safe)
{
    if (!canopy_float64_finite(bits)) {
        return safe;
    }
    return canopy_float64_rank(bits) < canopy_float64_rank(low) ? low : high;
}

#endif
