/* SPDX-License-Identifier: MIT */
/** @file Arithmetic of compiled scripts: it saturates and counts, and has no undefined results. */
#include "canopy/script.h"
#include "unity.h"

static uint32_t faults;

void setUp(void)
{
    faults = 0;
}

void tearDown(void)
{
}

/** The value, and whether it was counted as a fault. */
#define GIVES(expected, counted, call)                            \
    do {                                                          \
        faults = 0;                                               \
        TEST_ASSERT_TRUE_MESSAGE((call) == (expected), #call);    \
        TEST_ASSERT_EQUAL_UINT32_MESSAGE(counted, faults, #call); \
    } while (0)

static void limits(void)
{
    GIVES(5, 0, canopy_limit(5, -10, 10, &faults));
    GIVES(-10, 0, canopy_limit(-10, -10, 10, &faults));
    GIVES(10, 1, canopy_limit(11, -10, 10, &faults));
    GIVES(-10, 1, canopy_limit(-11, -10, 10, &faults));
    GIVES(7, 0, canopy_limit_unsigned(7, &faults));
    GIVES(INT64_MAX, 1, canopy_limit_unsigned(UINT64_MAX, &faults));
    GIVES(-1, 0, canopy_complement(0));
}

static void sums_saturate(void)
{
    GIVES(3, 0, canopy_add(1, 2, &faults));
    GIVES(INT64_MAX, 0, canopy_add(INT64_MAX - 1, 1, &faults));
    GIVES(INT64_MAX, 1, canopy_add(INT64_MAX, 1, &faults));
    GIVES(INT64_MIN, 1, canopy_add(INT64_MIN, -1, &faults));
    GIVES(-1, 0, canopy_subtract(1, 2, &faults));
    GIVES(INT64_MAX, 1, canopy_subtract(0, INT64_MIN, &faults));
    GIVES(INT64_MIN, 1, canopy_subtract(INT64_MIN, 1, &faults));
}

static void products_saturate(void)
{
    GIVES(-6, 0, canopy_multiply(-2, 3, &faults));
    GIVES(6, 0, canopy_multiply(-2, -3, &faults));
    GIVES(0, 0, canopy_multiply(0, INT64_MIN, &faults));
    GIVES(INT64_MIN, 0, canopy_multiply(INT64_MIN, 1, &faults));
    GIVES(INT64_MIN, 0, canopy_multiply(2, INT64_MIN / 2, &faults));
    GIVES(INT64_MAX, 1, canopy_multiply(INT64_MIN, -1, &faults));
    GIVES(INT64_MAX, 1, canopy_multiply(INT64_MAX, 2, &faults));
    GIVES(INT64_MIN, 1, canopy_multiply(INT64_MAX, -2, &faults));
}

static void floating_point_has_no_undefined_results(void)
{
    const volatile double zero = 0.0; /* so that no compiler divides by it beforehand */

    GIVES(2.5, 0, canopy_divide(5.0, 2.0, &faults));
    GIVES(-2.5, 0, canopy_divide(5.0, -2.0, &faults));
    GIVES(0.0, 1, canopy_divide(5.0, zero, &faults));
    GIVES(-2, 0, canopy_whole(-2.9, -100, 100, &faults));
    GIVES(100, 1, canopy_whole(1000.0, -100, 100, &faults));
    GIVES(100, 1, canopy_whole(1.0e300, -100, 100, &faults));
    GIVES(-100, 1, canopy_whole(-1.0e300, -100, 100, &faults));
    GIVES(0, 1, canopy_whole(zero / zero, -100, 100, &faults));
}

static void the_counter_of_faults_stays_at_its_largest_value(void)
{
    faults = UINT32_MAX;
    (void)canopy_limit(11, -10, 10, &faults);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, faults);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(limits);
    RUN_TEST(sums_saturate);
    RUN_TEST(products_saturate);
    RUN_TEST(floating_point_has_no_undefined_results);
    RUN_TEST(the_counter_of_faults_stays_at_its_largest_value);
    return UNITY_END();
}
