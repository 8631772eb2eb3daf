/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The POSIX clock and the stop flag. Machines are busy: times are tested for "not too early", never for jitter.
 */
#include <signal.h>
#include <stdbool.h>
#include <sys/time.h>

#include "canopy/clock/posix.h"
#include "unity.h"

#define SECOND_US UINT64_C(1000000)

static canopy_posix_clock_t posix_clock;
static atomic_bool stop;

void setUp(void)
{
    atomic_store(&stop, false);
    canopy_posix_clock_init(&posix_clock, &stop);
}

void tearDown(void)
{
}

static canopy_time_t now(void)
{
    return posix_clock.clock.now(posix_clock.clock.context);
}

static bool wait_until(canopy_time_t deadline)
{
    return posix_clock.clock.wait_until(posix_clock.clock.context, deadline);
}

static void test_time_goes_on(void)
{
    canopy_time_t before = now();
    for (int i = 0; i < 1000; i++) {
        const canopy_time_t after = now();
        TEST_ASSERT_GREATER_OR_EQUAL_UINT64(before, after);
        before = after;
    }
}

static void test_wait_ends_at_the_deadline_and_not_before(void)
{
    const canopy_time_t deadline = now() + 250000; /* more than two slices */

    TEST_ASSERT_TRUE(wait_until(deadline));
    TEST_ASSERT_GREATER_OR_EQUAL_UINT64(deadline, now());
    TEST_ASSERT_LESS_THAN_UINT64(deadline + 5 * SECOND_US, now());
}

static void test_past_deadline_ends_at_once(void)
{
    TEST_ASSERT_TRUE(wait_until(now()));
    TEST_ASSERT_TRUE(wait_until(0));
}

static void test_set_flag_ends_every_wait(void)
{
    atomic_store(&stop, true);
    TEST_ASSERT_FALSE(wait_until(now() + 3600 * SECOND_US));
    TEST_ASSERT_FALSE(wait_until(0));
}

static void test_clock_without_a_flag(void)
{
    canopy_posix_clock_init(&posix_clock, NULL);
    TEST_ASSERT_TRUE(wait_until(now() + 1000));
}

static void terminate_self(int number)
{
    (void)number;
    (void)raise(SIGTERM);
}

static void test_signal_in_the_middle_ends_the_wait(void)
{
    const struct itimerval soon = {.it_value = {.tv_usec = 20000}};
    const struct sigaction on_alarm = {.sa_handler = terminate_self};
    struct sigaction installed;
    const atomic_bool *flag = NULL;
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_posix_stop_on_signals(NULL));
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_posix_stop_on_signals(&flag));
    TEST_ASSERT_FALSE(atomic_load(flag));
    canopy_posix_clock_init(&posix_clock, flag);
    TEST_ASSERT_EQUAL(0, sigaction(SIGALRM, &on_alarm, NULL));
    TEST_ASSERT_EQUAL(0, setitimer(ITIMER_REAL, &soon, NULL));

    const canopy_time_t start = now();
    TEST_ASSERT_FALSE(wait_until(start + 3600 * SECOND_US));
    TEST_ASSERT_LESS_THAN_UINT64(start + 5 * SECOND_US, now());
    TEST_ASSERT_TRUE(atomic_load(flag));

    /* The second one kills: SIGTERM has its default action again, SIGINT, which has not come, has not. */
    TEST_ASSERT_EQUAL(0, sigaction(SIGTERM, NULL, &installed));
    TEST_ASSERT_TRUE(installed.sa_handler == SIG_DFL);
    TEST_ASSERT_EQUAL(0, sigaction(SIGINT, NULL, &installed));
    TEST_ASSERT_TRUE(installed.sa_handler != SIG_DFL);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_time_goes_on);
    RUN_TEST(test_wait_ends_at_the_deadline_and_not_before);
    RUN_TEST(test_past_deadline_ends_at_once);
    RUN_TEST(test_set_flag_ends_every_wait);
    RUN_TEST(test_clock_without_a_flag);
    RUN_TEST(test_signal_in_the_middle_ends_the_wait);
    return UNITY_END();
}
