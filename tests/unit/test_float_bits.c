/* SPDX-License-Identifier: MIT */
/** @file Order and range of IEEE numbers by their bits, without floating-point arithmetic. */
#include "canopy/float_bits.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

/* In rising order; the bits of infinities and NaN are written by hand. */
static const float floats[] = {-3.0e38f, -1.5f, -1.0e-40f, 0.0f, 1.0e-40f, 1.5f, 3.0e38f};
static const double doubles[] = {-1.0e308, -1.5, -1.0e-310, 0.0, 1.0e-310, 1.5, 1.0e308};
static const uint32_t not_finite_32[] = {0x7F800000u, 0xFF800000u, 0x7FC00000u, 0xFFC00001u};
static const uint64_t not_finite_64[] = {UINT64_C(0x7FF) << 52, UINT64_C(0xFFF) << 52, UINT64_C(0x7FF8) << 48};

enum { NUMBERS = 7 };

static void the_rank_rises_with_the_number(void)
{
    for (unsigned place = 1; place < NUMBERS; place++) {
        TEST_ASSERT_TRUE(canopy_float32_rank(canopy_float32_bits(floats[place - 1u])) <
                         canopy_float32_rank(canopy_float32_bits(floats[place])));
        TEST_ASSERT_TRUE(canopy_float64_rank(canopy_float64_bits(doubles[place - 1u])) <
                         canopy_float64_rank(canopy_float64_bits(doubles[place])));
    }
}

static void a_number_is_within_its_ends_only(void)
{
    for (unsigned place = 0; place < NUMBERS; place++) {
        uint32_t bits32 = canopy_float32_bits(floats[place]);
        uint64_t bits64 = canopy_float64_bits(doubles[place]);
        bool inside = place >= 2u && place <= 5u;

        TEST_ASSERT_EQUAL(
            inside, canopy_float32_within(bits32, canopy_float32_bits(floats[2]), canopy_float32_bits(floats[5])));
        TEST_ASSERT_EQUAL(
            inside, canopy_float64_within(bits64, canopy_float64_bits(doubles[2]), canopy_float64_bits(doubles[5])));
    }
}

static void minus_zero_is_zero(void)
{
    TEST_ASSERT_TRUE(canopy_float32_within(UINT32_C(1) << 31, 0, canopy_float32_bits(1.5f)));
    TEST_ASSERT_TRUE(canopy_float64_within(UINT64_C(1) << 63, 0, canopy_float64_bits(1.5)));
}

static void infinities_and_nan_are_not_finite_and_in_no_range(void)
{
    for (unsigned place = 0; place < sizeof not_finite_32 / sizeof not_finite_32[0]; place++) {
        TEST_ASSERT_FALSE(canopy_float32_finite(not_finite_32[place]));
        TEST_ASSERT_FALSE(canopy_float32_within(not_finite_32[place], canopy_float32_bits(floats[0]),
                                                canopy_float32_bits(floats[NUMBERS - 1])));
        TEST_ASSERT_EQUAL_HEX32(7, canopy_float32_limit(not_finite_32[place], 0, 1, 7));
    }
    for (unsigned place = 0; place < sizeof not_finite_64 / sizeof not_finite_64[0]; place++) {
        TEST_ASSERT_FALSE(canopy_float64_finite(not_finite_64[place]));
        TEST_ASSERT_FALSE(canopy_float64_within(not_finite_64[place], canopy_float64_bits(doubles[0]),
                                                canopy_float64_bits(doubles[NUMBERS - 1])));
        TEST_ASSERT_TRUE(canopy_float64_limit(not_finite_64[place], 0, 1, 7) == 7u);
    }
    for (unsigned place = 0; place < NUMBERS; place++) {
        TEST_ASSERT_TRUE(canopy_float32_finite(canopy_float32_bits(floats[place])));
        TEST_ASSERT_TRUE(canopy_float64_finite(canopy_float64_bits(doubles[place])));
    }
}

static void a_number_outside_becomes_the_nearer_end(void)
{
    const uint32_t low32 = canopy_float32_bits(-1.5f);
    const uint32_t high32 = canopy_float32_bits(1.5f);
    const uint64_t low64 = canopy_float64_bits(-1.5);
    const uint64_t high64 = canopy_float64_bits(1.5);

    TEST_ASSERT_EQUAL_HEX32(low32, canopy_float32_limit(canopy_float32_bits(-2.0f), low32, high32, 0));
    TEST_ASSERT_EQUAL_HEX32(high32, canopy_float32_limit(canopy_float32_bits(2.0f), low32, high32, 0));
    TEST_ASSERT_TRUE(canopy_float64_limit(canopy_float64_bits(-2.0), low64, high64, 0) == low64);
    TEST_ASSERT_TRUE(canopy_float64_limit(canopy_float64_bits(2.0), low64, high64, 0) == high64);
}

static void bits_and_values_are_the_same_number(void)
{
    for (unsigned place = 0; place < NUMBERS; place++) {
        uint32_t bits32 = canopy_float32_bits(floats[place]);
        uint64_t bits64 = canopy_float64_bits(doubles[place]);

        TEST_ASSERT_EQUAL_HEX32(bits32, canopy_float32_bits(canopy_float32_value(bits32)));
        TEST_ASSERT_TRUE(canopy_float64_bits(canopy_float64_value(bits64)) == bits64);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_rank_rises_with_the_number);
    RUN_TEST(a_number_is_within_its_ends_only);
    RUN_TEST(minus_zero_is_zero);
    RUN_TEST(infinities_and_nan_are_not_finite_and_in_no_range);
    RUN_TEST(a_number_outside_becomes_the_nearer_end);
    RUN_TEST(bits_and_values_are_the_same_number);
    return UNITY_END();
}
