/* SPDX-License-Identifier: MIT */
/**
 * @file
 * canopy_time_reached(): before, at and after a deadline, also across the wrap-around of the 64-bit count; and
 * canopy_time_of_stamp(): when a controller's timer had a value.
 */
#include "canopy/can.h"
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

/* Counts are whole: up to one more has gone by, and a frame must not look younger than it is. */
static void test_a_stamp_is_as_long_ago_as_the_timer_has_gone_since(void)
{
    TEST_ASSERT_EQUAL_UINT64(4998, canopy_time_of_stamp(5000, 77, 77, 16, 2000)); /* a bit at 500 kbit/s */
    TEST_ASSERT_EQUAL_UINT64(4978, canopy_time_of_stamp(5000, 87, 77, 16, 2000));
    TEST_ASSERT_EQUAL_UINT64(4999, canopy_time_of_stamp(5000, 1, 0, 32, 1)); /* and rounded to the earlier us */
    TEST_ASSERT_EQUAL_UINT64(4999, canopy_time_of_stamp(5000, 999, 0, 32, 1));
    TEST_ASSERT_EQUAL_UINT64(4998, canopy_time_of_stamp(5000, 1000, 0, 32, 1));
}

static void test_a_stamp_is_right_across_the_turn_of_the_timer_and_of_time(void)
{
    TEST_ASSERT_EQUAL_UINT64(4978, canopy_time_of_stamp(5000, 3, 65529, 16, 2000));
    TEST_ASSERT_EQUAL_UINT64(UINT64_C(100000) - 65536,
                             canopy_time_of_stamp(100000, 6, 7, 16, 1000)); /* almost one turn */
    TEST_ASSERT_EQUAL_UINT64(UINT64_C(10000000000) - 4294967296,
                             canopy_time_of_stamp(UINT64_C(10000000000), 6, 7, 32, 1000));
    TEST_ASSERT_EQUAL_UINT64(4998, canopy_time_of_stamp(5000, 0, 1, 1, 1000));
    TEST_ASSERT_EQUAL_UINT64(UINT64_MAX, canopy_time_of_stamp(9, 9, 0, 16, 1000)); /* before time began again */
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_deadline_is_not_reached_before_it);
    RUN_TEST(test_deadline_is_reached_at_it_and_after);
    RUN_TEST(test_deadline_past_the_wrap_around_is_not_reached_before_it);
    RUN_TEST(test_deadline_before_the_wrap_around_is_reached_after_it);
    RUN_TEST(test_half_the_range_separates_past_from_future);
    RUN_TEST(test_a_stamp_is_as_long_ago_as_the_timer_has_gone_since);
    RUN_TEST(test_a_stamp_is_right_across_the_turn_of_the_timer_and_of_time);
    return UNITY_END();
}
