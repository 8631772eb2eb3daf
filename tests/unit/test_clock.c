/* SPDX-License-Identifier: MIT */
/**
 * @file
 * canopy_time_reached(): before, at and after a deadline, also across the wrap-around of the 64-bit count.
 */
#include "canopy/clock.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

static void test_deadline_is_not_reached_before_it(void)
{
    TEST_ASSERT_FALSE(canopy_time_reached(0, 1));
    TEST_ASSERT_FALSE(canopy_time_reached(49999, 50000));
}

static void test_deadline_is_reached_at_it_and_after(void)
{
    TEST_ASSERT_TRUE(canopy_time_reached(0, 0));
    TEST_ASSERT_TRUE(canopy_time_reached(50000, 50000));
    TEST_ASSERT_TRUE(canopy_time_reached(50001, 50000));
}

static void test_deadline_past_the_wrap_around_is_not_reached_before_it(void)
{
    canopy_time_t now = UINT64_MAX - 9;

    TEST_ASSERT_FALSE(canopy_time_reached(now, now + 50000));
    TEST_ASSERT_TRUE(canopy_time_reached(now + 50000, now + 50000));
}

static void test_deadline_before_the_wrap_around_is_reached_after_it(void)
{
    TEST_ASSERT_TRUE(canopy_time_reached(3, UINT64_MAX));
}

static void test_half_the_range_separates_past_from_future(void)
{
    canopy_time_t half = UINT64_C(1) << 63;

    TEST_ASSERT_TRUE(canopy_time_reached(half - 1, 0));
    TEST_ASSERT_FALSE(canopy_time_reached(half, 0));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_deadline_is_not_reached_before_it);
    RUN_TEST(test_deadline_is_reached_at_it_and_after);
    RUN_TEST(test_deadline_past_the_wrap_around_is_not_reached_before_it);
    RUN_TEST(test_deadline_before_the_wrap_around_is_reached_after_it);
    RUN_TEST(test_half_the_range_separates_past_from_future);
    return UNITY_END();
}
