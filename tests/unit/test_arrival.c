/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The kernel's stamps on the monotonic clock, with clocks of the test's own: whatever the wall clock does, no frame looks
 * younger than it is.
 */
#include "canopy/can/arrival.h"

#include <stdbool.h>

#include "unity.h"

#define MS INT64_C(1000000)
#define HOUR (INT64_C(3600000) * MS)
#define OFFSET (INT64_C(1700000000000) * MS) /* REALTIME - MONOTONIC at the start */

static canopy_arrival_t arrival;

void setUp(void)
{
    const canopy_arrival_clocks_t clocks = {.before = 0, .real = OFFSET, .after = 0};

    canopy_arrival_start(&arrival, &clocks);
}

void tearDown(void)
{
}

/** A look that ends at `now`, whose clocks are read `length` apart, with the wall clock in the middle. */
static void look(int64_t now, int64_t offset, int64_t length)
{
    const canopy_arrival_clocks_t clocks = {.before = now - length, .real = now - length / 2 + offset, .after = now};

    canopy_arrival_look(&arrival, &clocks);
}

static void expect_arrival(int64_t expected, int64_t stamp, int64_t now)
{
    TEST_ASSERT_TRUE(canopy_arrival_of(&arrival, stamp, now) == expected);
}

static void test_a_frame_arrived_when_it_was_stamped(void)
{
    look(100 * MS, OFFSET, 0);
    expect_arrival(30 * MS, OFFSET + 30 * MS, 100 * MS);
    expect_arrival(100 * MS, OFFSET + 100 * MS, 100 * MS);
}

static void test_setting_the_wall_clock_after_the_frame_changes_no_age(void)
{
    const int64_t steps[] = {HOUR, -HOUR, MS, -MS, INT64_C(10000) * HOUR, -OFFSET};

    for (unsigned index = 0; index < sizeof steps / sizeof steps[0]; index++) {
        setUp();
        arrival.empty_at = 29 * MS + MS / 2; /* so that even a step of 1 ms is told apart */
        look(30 * MS + MS / 4, OFFSET + steps[index], 0);
        expect_arrival(30 * MS, OFFSET + 30 * MS, 30 * MS + MS / 4);
    }
}

static void test_setting_it_before_the_frame_changes_no_age(void)
{
    look(100 * MS, OFFSET + HOUR, 0);
    expect_arrival(30 * MS, OFFSET + HOUR + 30 * MS, 100 * MS);
    setUp();
    look(100 * MS, OFFSET - HOUR, 0);
    expect_arrival(30 * MS, OFFSET - HOUR + 30 * MS, 100 * MS);
}

static void test_when_both_times_are_possible_the_frame_is_as_old_as_it_may_be(void)
{
    look(100 * MS, OFFSET + 20 * MS, 0); /* at 50 by the old difference, at 30 by the new one */
    expect_arrival(30 * MS, OFFSET + 50 * MS, 100 * MS);
    setUp();
    look(100 * MS, OFFSET - 20 * MS, 0);
    expect_arrival(50 * MS, OFFSET + 50 * MS, 100 * MS);
}

static void test_what_fits_no_difference_came_after_the_queue_was_empty(void)
{
    arrival.empty_at = 40 * MS;
    look(100 * MS, OFFSET, 0);
    expect_arrival(40 * MS, OFFSET + 39 * MS, 100 * MS);
    expect_arrival(40 * MS, OFFSET + 101 * MS, 100 * MS);
    expect_arrival(40 * MS, 0, 100 * MS); /* the kernel gave no stamp */
}

static void test_a_look_that_takes_long_makes_frames_older_but_not_for_long(void)
{
    const canopy_arrival_clocks_t slow = {.before = 0, .real = OFFSET + 5 * MS, .after = 5 * MS};

    canopy_arrival_start(&arrival, &slow); /* the difference may be OFFSET to OFFSET + 5 ms */
    expect_arrival(25 * MS, OFFSET + 30 * MS, 100 * MS);
    look(100 * MS, OFFSET, 0);
    look(101 * MS, OFFSET, 0);
    expect_arrival(30 * MS, OFFSET + 30 * MS, 101 * MS);
    look(200 * MS, OFFSET, 20 * MS); /* a later slow one does not spoil what is known */
    look(300 * MS, OFFSET, 20 * MS);
    expect_arrival(230 * MS, OFFSET + 230 * MS, 300 * MS);
}

static uint64_t seed;

static int64_t random_up_to(int64_t most)
{
    seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (int64_t)((seed >> 16) % ((uint64_t)most + 1u));
}

/** Frames, looks and steps at random, one step between two looks at most. */
static void test_at_random_no_frame_looks_younger_than_it_is(void)
{
    int64_t now = 0;
    int64_t offset = OFFSET;
    unsigned close = 0;
    unsigned younger = 0;

    seed = 1;
    for (unsigned round = 0; round < 20000u; round++) {
        int64_t from = now; /* the queue was empty then */
        int64_t length = random_up_to(200) * 1000;
        int64_t step_at = from + random_up_to(100 * MS);
        int64_t step = round % 3u == 0u ? random_up_to(200 * MS) - 100 * MS : 0;
        int64_t came = from + random_up_to(100 * MS);
        int64_t stamp = came + (came >= step_at ? offset + step : offset);
        int64_t told;

        now = from + 101 * MS;
        offset += step;
        arrival.empty_at = from;
        look(now, offset, length);
        told = canopy_arrival_of(&arrival, stamp, now);
        TEST_ASSERT_TRUE_MESSAGE(told <= came + length, "younger than it is"); /* a step may be shorter than a look */
        TEST_ASSERT_TRUE_MESSAGE(told >= from, "older than it can be");
        younger += told > came ? 1u : 0u;
        close += told >= came - 200000 ? 1u : 0u;
    }
    TEST_ASSERT_LESS_THAN_UINT(100, younger);
    TEST_ASSERT_GREATER_THAN_UINT(13000, close); /* two rounds of three have no step, and then it is known */
}

static void test_the_machines_clocks_are_read(void)
{
    const int64_t before = canopy_arrival_monotonic();
    const canopy_arrival_clocks_t clocks = canopy_arrival_clocks(before);

    TEST_ASSERT_TRUE(clocks.before == before);
    TEST_ASSERT_TRUE(clocks.after >= before);
    TEST_ASSERT_TRUE(clocks.real != 0);
    TEST_ASSERT_TRUE(canopy_arrival_monotonic() >= clocks.after);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_frame_arrived_when_it_was_stamped);
    RUN_TEST(test_setting_the_wall_clock_after_the_frame_changes_no_age);
    RUN_TEST(test_setting_it_before_the_frame_changes_no_age);
    RUN_TEST(test_when_both_times_are_possible_the_frame_is_as_old_as_it_may_be);
    RUN_TEST(test_what_fits_no_difference_came_after_the_queue_was_empty);
    RUN_TEST(test_a_look_that_takes_long_makes_frames_older_but_not_for_long);
    RUN_TEST(test_at_random_no_frame_looks_younger_than_it_is);
    RUN_TEST(test_the_machines_clocks_are_read);
    return UNITY_END();
}
