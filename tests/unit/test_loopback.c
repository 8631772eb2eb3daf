/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The bus inside one program: who receives what, full queues, filters, joining and leaving. With a controller below it:
 * test_loopback_controller.c.
 */
#include "canopy/can/loopback.h"

#include "unity.h"

#define CAPACITY 4u

static canopy_loopback_t bus;
static canopy_loopback_endpoint_t a, b, c;
static canopy_can_frame_t storage[3][CAPACITY];

void setUp(void)
{
    bus = (canopy_loopback_t){0};
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loopback_join(&bus, &a, storage[0], CAPACITY, CANOPY_CAN_ACCEPT_EVERYTHING));
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loopback_join(&bus, &b, storage[1], CAPACITY, CANOPY_CAN_ACCEPT_EVERYTHING));
}

void tearDown(void)
{
}

static int send(canopy_loopback_endpoint_t *endpoint, uint32_t id)
{
    const canopy_can_frame_t frame = {.id = id, .length = 2, .data = {(uint8_t)id, 7}};
    return endpoint->can.send(endpoint->can.context, 0, &frame);
}

/** @return the id received, or -1 when there is no frame */
static long receive(canopy_loopback_endpoint_t *endpoint)
{
    canopy_can_frame_t frame;
    const int result = endpoint->can.receive(endpoint->can.context, &frame);
    if (result == 0) {
        return -1;
    }
    TEST_ASSERT_EQUAL(1, result);
    TEST_ASSERT_EQUAL_UINT8(2, frame.length);
    TEST_ASSERT_EQUAL_HEX8(frame.id & 0xFFu, frame.data[0]);
    return (long)frame.id;
}

static canopy_can_stats_t stats(canopy_loopback_endpoint_t *endpoint)
{
    canopy_can_stats_t result;
    endpoint->can.stats(endpoint->can.context, &result);
    return result;
}

static void test_all_others_receive_and_the_sender_does_not(void)
{
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loopback_join(&bus, &c, storage[2], CAPACITY, CANOPY_CAN_ACCEPT_EVERYTHING));

    TEST_ASSERT_EQUAL(1, send(&a, 0x10));
    TEST_ASSERT_EQUAL(1, send(&b, 0x20));

    TEST_ASSERT_EQUAL(0x20, receive(&a));
    TEST_ASSERT_EQUAL(-1, receive(&a));
    TEST_ASSERT_EQUAL(0x10, receive(&b));
    TEST_ASSERT_EQUAL(-1, receive(&b));
    TEST_ASSERT_EQUAL(0x10, receive(&c));
    TEST_ASSERT_EQUAL(0x20, receive(&c));
    TEST_ASSERT_EQUAL_UINT32(1, stats(&a).sent);
    TEST_ASSERT_EQUAL_UINT32(1, stats(&a).received);
    TEST_ASSERT_EQUAL_UINT32(2, stats(&c).rx_high_water);
    TEST_ASSERT_NULL(a.can.wait);
}

static void test_a_full_receiver_loses_and_the_others_do_not(void)
{
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loopback_join(&bus, &c, storage[2], CAPACITY, CANOPY_CAN_ACCEPT_EVERYTHING));
    for (uint32_t id = 0; id < 6; id++) {
        TEST_ASSERT_EQUAL(1, send(&a, id));
        TEST_ASSERT_EQUAL(id, receive(&c));
    }

    TEST_ASSERT_EQUAL_UINT32(2, stats(&b).rx_dropped);
    TEST_ASSERT_EQUAL_UINT32(0, stats(&c).rx_dropped);
    TEST_ASSERT_EQUAL_UINT32(6, stats(&a).sent);
    for (uint32_t id = 0; id < 4; id++) {
        TEST_ASSERT_EQUAL(id, receive(&b));
    }
    TEST_ASSERT_EQUAL(-1, receive(&b));
}

static void test_filter_keeps_others_out(void)
{
    static const uint32_t ids[] = {0x11};
    static const canopy_can_acceptance_t acceptance = {.ids = ids, .count = 1};
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loopback_join(&bus, &c, storage[2], CAPACITY, &acceptance));

    TEST_ASSERT_EQUAL(1, send(&a, 0x10));
    TEST_ASSERT_EQUAL(1, send(&a, 0x11));

    TEST_ASSERT_EQUAL(0x11, receive(&c));
    TEST_ASSERT_EQUAL(-1, receive(&c));
    TEST_ASSERT_EQUAL_UINT32(0, stats(&c).rx_dropped);
}

static void test_frame_that_no_bus_can_carry_is_refused(void)
{
    const canopy_can_frame_t frame = {.id = 0x800, .length = 0};

    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, a.can.send(a.can.context, 0, &frame));
    TEST_ASSERT_EQUAL_UINT32(1, stats(&a).tx_dropped);
    TEST_ASSERT_EQUAL_UINT32(0, stats(&a).sent);
    TEST_ASSERT_EQUAL(-1, receive(&b));
}

static void test_who_has_left_neither_receives_nor_sends(void)
{
    canopy_loopback_leave(&b);
    canopy_loopback_leave(&b);

    TEST_ASSERT_EQUAL(1, send(&a, 0x10));
    TEST_ASSERT_EQUAL(-1, receive(&b));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_BUS_DOWN, send(&b, 0x20));
    TEST_ASSERT_EQUAL(-1, receive(&a));
    TEST_ASSERT_EQUAL_UINT32(1, stats(&b).tx_dropped);
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loopback_join(&bus, &b, storage[1], CAPACITY, CANOPY_CAN_ACCEPT_EVERYTHING));
    TEST_ASSERT_EQUAL(1, send(&b, 0x20));
    TEST_ASSERT_EQUAL(0x20, receive(&a));
}

static void test_join_refuses_bad_arguments(void)
{
    static const canopy_can_acceptance_t bad = {.ids = NULL, .count = 1};

    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT,
                      canopy_loopback_join(NULL, &c, storage[2], CAPACITY, CANOPY_CAN_ACCEPT_EVERYTHING));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT,
                      canopy_loopback_join(&bus, NULL, storage[2], CAPACITY, CANOPY_CAN_ACCEPT_EVERYTHING));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT,
                      canopy_loopback_join(&bus, &c, NULL, CAPACITY, CANOPY_CAN_ACCEPT_EVERYTHING));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT,
                      canopy_loopback_join(&bus, &c, storage[2], 3, CANOPY_CAN_ACCEPT_EVERYTHING));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_loopback_join(&bus, &c, storage[2], CAPACITY, &bad));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_loopback_join(&bus, &c, storage[2], CAPACITY, NULL));
}

static void test_what_is_sent_is_out_at_once(void)
{
    TEST_ASSERT_EQUAL(CANOPY_CAN_ABORTED, a.can.outcome(a.can.context, 0)); /* nothing was sent yet */
    TEST_ASSERT_EQUAL(1, send(&a, 0x10));
    TEST_ASSERT_EQUAL(CANOPY_CAN_SENT, a.can.outcome(a.can.context, 0));
    a.can.abort(a.can.context, 0); /* in vain */
    TEST_ASSERT_EQUAL(CANOPY_CAN_SENT, a.can.outcome(a.can.context, 0));
    TEST_ASSERT_EQUAL(CANOPY_CAN_CONTROLLER_ACTIVE, a.can.state(a.can.context));
    a.can.restart(a.can.context);
    TEST_ASSERT_EQUAL(0x10, receive(&b));
}

static void test_a_filtered_endpoint_says_so(void)
{
    static const uint32_t ids[] = {0x11};
    static const canopy_can_acceptance_t acceptance = {.ids = ids, .count = 1};

    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loopback_join(&bus, &c, storage[2], CAPACITY, &acceptance));
    TEST_ASSERT_TRUE(c.can.is_filtered);
    TEST_ASSERT_FALSE(a.can.is_filtered);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_all_others_receive_and_the_sender_does_not);
    RUN_TEST(test_a_full_receiver_loses_and_the_others_do_not);
    RUN_TEST(test_filter_keeps_others_out);
    RUN_TEST(test_frame_that_no_bus_can_carry_is_refused);
    RUN_TEST(test_who_has_left_neither_receives_nor_sends);
    RUN_TEST(test_join_refuses_bad_arguments);
    RUN_TEST(test_what_is_sent_is_out_at_once);
    RUN_TEST(test_a_filtered_endpoint_says_so);
    return UNITY_END();
}
