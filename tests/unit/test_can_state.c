/* SPDX-License-Identifier: MIT */
/** @file The state of the bus: what is seen, when it is restarted, and when it counts as mended. */
#include "canopy/can_state.h"
#include "fake_can.h"
#include "unity.h"

static canopy_can_manager_t manager;

void setUp(void)
{
    fake_can_reset();
    manager = (canopy_can_manager_t){0};
}

void tearDown(void)
{
}

static canopy_can_state_t step(canopy_can_controller_t controller, bool blocked, canopy_time_t now)
{
    fake.controller = controller;
    return canopy_can_manager_step(&manager, &fake_can, blocked, now);
}

static void the_state_follows_from_what_controller_and_transmit_side_say(void)
{
    static const struct {
        canopy_can_controller_t controller;
        canopy_can_state_t free;
        canopy_can_state_t blocked;
    } table[] = {{CANOPY_CAN_CONTROLLER_ACTIVE, CANOPY_CAN_ERROR_ACTIVE, CANOPY_CAN_BLOCKED},
                 {CANOPY_CAN_CONTROLLER_WARNING, CANOPY_CAN_ERROR_WARNING, CANOPY_CAN_BLOCKED},
                 {CANOPY_CAN_CONTROLLER_PASSIVE, CANOPY_CAN_ERROR_PASSIVE, CANOPY_CAN_BLOCKED},
                 {CANOPY_CAN_CONTROLLER_BUS_OFF, CANOPY_CAN_BUS_OFF, CANOPY_CAN_BUS_OFF},
                 {CANOPY_CAN_CONTROLLER_DOWN, CANOPY_CAN_DOWN, CANOPY_CAN_DOWN},
                 {CANOPY_CAN_CONTROLLER_GONE, CANOPY_CAN_GONE, CANOPY_CAN_GONE}};
    const unsigned rows = sizeof table / sizeof table[0];

    for (unsigned from = 0; from < 2u * rows; from++) { /* every transition */
        for (unsigned to = 0; to < 2u * rows; to++) {
            canopy_can_state_t before = from % 2u != 0u ? table[from / 2u].blocked : table[from / 2u].free;
            /* What stood still while the bus was unusable says nothing of the one that has just come back. */
            bool counts = to % 2u != 0u && !canopy_can_is_unusable(before);
            canopy_can_state_t after = counts ? table[to / 2u].blocked : table[to / 2u].free;

            setUp();
            TEST_ASSERT_EQUAL(before, step(table[from / 2u].controller, from % 2u != 0u, 1000));
            TEST_ASSERT_EQUAL(after, step(table[to / 2u].controller, to % 2u != 0u, 1001));
            TEST_ASSERT_EQUAL(after, manager.state);
            TEST_ASSERT_EQUAL_UINT32(canopy_can_is_unusable(before) || canopy_can_is_unusable(after) ? 1 : 0,
                                     manager.failures);
            TEST_ASSERT_EQUAL_UINT32(0, manager.restarts);
        }
    }
}

static void only_from_bus_off_on_is_a_bus_unusable(void)
{
    TEST_ASSERT_FALSE(canopy_can_is_unusable(CANOPY_CAN_ERROR_ACTIVE));
    TEST_ASSERT_FALSE(canopy_can_is_unusable(CANOPY_CAN_ERROR_WARNING));
    TEST_ASSERT_FALSE(canopy_can_is_unusable(CANOPY_CAN_ERROR_PASSIVE));
    TEST_ASSERT_FALSE(canopy_can_is_unusable(CANOPY_CAN_BLOCKED));
    TEST_ASSERT_TRUE(canopy_can_is_unusable(CANOPY_CAN_BUS_OFF));
    TEST_ASSERT_TRUE(canopy_can_is_unusable(CANOPY_CAN_DOWN));
    TEST_ASSERT_TRUE(canopy_can_is_unusable(CANOPY_CAN_GONE));
}

static void a_driver_that_does_not_know_is_error_active(void)
{
    const canopy_can_t simple = {.context = &fake};

    TEST_ASSERT_EQUAL(CANOPY_CAN_ERROR_ACTIVE, canopy_can_manager_step(&manager, &simple, false, 0));
    TEST_ASSERT_EQUAL(CANOPY_CAN_BLOCKED, canopy_can_manager_step(&manager, &simple, true, 0));
}

static void a_number_that_is_no_state_is_error_active(void)
{
    TEST_ASSERT_EQUAL(CANOPY_CAN_ERROR_ACTIVE,
                      step((canopy_can_controller_t)(CANOPY_CAN_CONTROLLER_GONE + 1), false, 0));
}

static void a_driver_that_comes_back_by_itself_is_not_restarted(void)
{
    canopy_can_t simple = fake_can;

    simple.restart = NULL;
    fake.controller = CANOPY_CAN_CONTROLLER_BUS_OFF;
    for (canopy_time_t now = 0; now < 10000000u; now += 100000u) {
        TEST_ASSERT_EQUAL(CANOPY_CAN_BUS_OFF, canopy_can_manager_step(&manager, &simple, false, now));
    }
    TEST_ASSERT_EQUAL_UINT32(0, manager.restarts);
    TEST_ASSERT_EQUAL_UINT32(1, manager.failures);
}

static void the_pause_between_attempts_doubles_up_to_a_limit(void)
{
    canopy_time_t pause = CANOPY_CAN_RESTART_FIRST_US;
    canopy_time_t now = UINT64_MAX - 300000u; /* time wraps in between */

    (void)step(CANOPY_CAN_CONTROLLER_BUS_OFF, false, now);
    for (unsigned attempt = 1; attempt <= 12u; attempt++) {
        (void)step(CANOPY_CAN_CONTROLLER_BUS_OFF, false, now + pause - 1u);
        TEST_ASSERT_EQUAL_UINT(attempt - 1u, fake.restarts);
        now += pause;
        (void)step(CANOPY_CAN_CONTROLLER_BUS_OFF, false, now);
        TEST_ASSERT_EQUAL_UINT(attempt, fake.restarts);
        pause = pause * 2u < CANOPY_CAN_RESTART_LONGEST_US ? pause * 2u : CANOPY_CAN_RESTART_LONGEST_US;
    }
    TEST_ASSERT_EQUAL_UINT64(CANOPY_CAN_RESTART_LONGEST_US, pause);
    TEST_ASSERT_EQUAL_UINT32(12, manager.restarts);
    TEST_ASSERT_EQUAL_UINT32(1, manager.failures);
}

/** Fails at `failed`; returns how long after that the first attempt is made. */
static canopy_time_t first_attempt_after(canopy_time_t failed)
{
    unsigned restarts = fake.restarts;

    for (canopy_time_t now = failed;; now += 1000u) {
        (void)step(CANOPY_CAN_CONTROLLER_BUS_OFF, false, now);
        if (fake.restarts != restarts) {
            return now - failed;
        }
    }
}

static void once_settled_the_pause_is_the_shortest_again(void)
{
    TEST_ASSERT_EQUAL_UINT64(CANOPY_CAN_RESTART_FIRST_US, first_attempt_after(0));
    (void)step(CANOPY_CAN_CONTROLLER_ACTIVE, false, 100000);
    (void)step(CANOPY_CAN_CONTROLLER_ACTIVE, false, 100000 + CANOPY_CAN_SETTLED_US - 1u);
    TEST_ASSERT_EQUAL_UINT64(2u * CANOPY_CAN_RESTART_FIRST_US, first_attempt_after(100000 + CANOPY_CAN_SETTLED_US));
    (void)step(CANOPY_CAN_CONTROLLER_ACTIVE, false, 2000000);
    (void)step(CANOPY_CAN_CONTROLLER_ACTIVE, false, 2000000 + CANOPY_CAN_SETTLED_US);
    TEST_ASSERT_EQUAL_UINT64(CANOPY_CAN_RESTART_FIRST_US, first_attempt_after(4000000));
    TEST_ASSERT_EQUAL_UINT32(3, manager.failures);
}

/* Back for 1 ms each time: as a node with a short circuit, that must not disturb the others for ever. */
static void a_flapping_controller_is_restarted_less_and_less_often(void)
{
    canopy_time_t now = 0;

    for (unsigned time = 0; time < 10u; time++) {
        canopy_time_t pause = first_attempt_after(now);
        canopy_time_t doubled = CANOPY_CAN_RESTART_FIRST_US << time;

        TEST_ASSERT_EQUAL_UINT64(doubled < CANOPY_CAN_RESTART_LONGEST_US ? doubled : CANOPY_CAN_RESTART_LONGEST_US,
                                 pause);
        now += pause + 1000u;
        (void)step(CANOPY_CAN_CONTROLLER_PASSIVE, false, now);
        now += 1000u;
    }
    TEST_ASSERT_EQUAL_UINT32(10, manager.failures);
    TEST_ASSERT_EQUAL_UINT32(10, manager.restarts);
}

static void changing_from_one_unusable_state_to_another_is_one_failure(void)
{
    (void)step(CANOPY_CAN_CONTROLLER_BUS_OFF, false, 0);
    (void)step(CANOPY_CAN_CONTROLLER_DOWN, false, 40000);
    (void)step(CANOPY_CAN_CONTROLLER_GONE, false, CANOPY_CAN_RESTART_FIRST_US);
    TEST_ASSERT_EQUAL_UINT32(1, manager.failures);
    TEST_ASSERT_EQUAL_UINT32(1, manager.restarts); /* counted from the first */
}

static void counters_stay_at_their_largest_value(void)
{
    manager.failures = UINT32_MAX;
    manager.restarts = UINT32_MAX;
    (void)first_attempt_after(0);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, manager.failures);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, manager.restarts);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_state_follows_from_what_controller_and_transmit_side_say);
    RUN_TEST(only_from_bus_off_on_is_a_bus_unusable);
    RUN_TEST(a_driver_that_does_not_know_is_error_active);
    RUN_TEST(a_number_that_is_no_state_is_error_active);
    RUN_TEST(a_driver_that_comes_back_by_itself_is_not_restarted);
    RUN_TEST(the_pause_between_attempts_doubles_up_to_a_limit);
    RUN_TEST(once_settled_the_pause_is_the_shortest_again);
    RUN_TEST(a_flapping_controller_is_restarted_less_and_less_often);
    RUN_TEST(changing_from_one_unusable_state_to_another_is_one_failure);
    RUN_TEST(counters_stay_at_their_largest_value);
    return UNITY_END();
}
