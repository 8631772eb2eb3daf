/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The bus inside one program: who receives what, full queues, filters, joining and leaving; a controller below it.
 */
#include "canopy/can/loopback.h"

#include "fake_can.h"
#include "unity.h"

#define CAPACITY 4u

static canopy_loopback_t bus;
static canopy_loopback_endpoint_t a, b, c;
static canopy_can_frame_t storage[3][CAPACITY];

/* A controller that always has a frame. */
static unsigned fetched;

static int endless_receive(void *context, canopy_can_frame_t *frame)
{
    (void)context;
    fetched++;
    *frame = (canopy_can_frame_t){.id = 8};
    return 1;
}

static const canopy_can_t endless = {.receive = endless_receive};

void setUp(void)
{
    bus = (canopy_loopback_t){0};
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loopback_join(&bus, &a, storage[0], CAPACITY, NULL));
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loopback_join(&bus, &b, storage[1], CAPACITY, NULL));
}

void tearDown(void)
{
}

static int send(canopy_loopback_endpoint_t *endpoint, uint32_t id)
{
    const canopy_can_frame_t frame = {.id = id, .length = 2, .data = {(uint8_t)id, 7}};
    return endpoint->can.send(endpoint->can.context, &frame);
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
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loopback_join(&bus, &c, storage[2], CAPACITY, NULL));

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
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loopback_join(&bus, &c, storage[2], CAPACITY, NULL));
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

    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, a.can.send(a.can.context, &frame));
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
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loopback_join(&bus, &b, storage[1], CAPACITY, NULL));
    TEST_ASSERT_EQUAL(1, send(&b, 0x20));
    TEST_ASSERT_EQUAL(0x20, receive(&a));
}

static void test_join_refuses_bad_arguments(void)
{
    static const canopy_can_acceptance_t bad = {.ids = NULL, .count = 1};

    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_loopback_join(NULL, &c, storage[2], CAPACITY, NULL));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_loopback_join(&bus, NULL, storage[2], CAPACITY, NULL));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_loopback_join(&bus, &c, NULL, CAPACITY, NULL));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_loopback_join(&bus, &c, storage[2], 3, NULL));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_loopback_join(&bus, &c, storage[2], CAPACITY, &bad));
}

static void test_with_a_controller_all_see_the_wire_and_each_other(void)
{
    fake_can_reset();
    bus.controller = &fake_can;
    fake.rx[0] = (canopy_can_frame_t){.id = 0x30, .length = 2, .data = {0x30}};
    fake.rx[1] = (canopy_can_frame_t){.id = 0x31, .length = 2, .data = {0x31}};
    fake.rx_count = 2;

    TEST_ASSERT_EQUAL(0x30, receive(&a));
    TEST_ASSERT_EQUAL(1, send(&a, 0x10));
    TEST_ASSERT_EQUAL(0x30, receive(&b));
    TEST_ASSERT_EQUAL(0x10, receive(&b));
    TEST_ASSERT_EQUAL(0x31, receive(&b));
    TEST_ASSERT_EQUAL(-1, receive(&b));
    TEST_ASSERT_EQUAL(0x31, receive(&a));
    TEST_ASSERT_EQUAL(-1, receive(&a));
    TEST_ASSERT_EQUAL_UINT(1, fake.tx_count);
    TEST_ASSERT_EQUAL_HEX32(0x10, fake.tx[0].id);
    TEST_ASSERT_EQUAL_UINT32(2, stats(&a).received);
    TEST_ASSERT_EQUAL_UINT32(3, stats(&b).received);
}

static void test_what_the_controller_does_not_take_nobody_sees(void)
{
    fake_can_reset();
    bus.controller = &fake_can;
    fake.tx_result = 0;
    TEST_ASSERT_EQUAL(0, send(&a, 0x10));
    fake.tx_result = CANOPY_ERROR_BUS_DOWN;
    TEST_ASSERT_EQUAL(CANOPY_ERROR_BUS_DOWN, send(&a, 0x11));
    TEST_ASSERT_EQUAL(-1, receive(&b));
    TEST_ASSERT_EQUAL_UINT32(2, stats(&a).tx_dropped);
    TEST_ASSERT_EQUAL_UINT32(0, stats(&a).sent);
}

static void test_an_error_of_the_controller_is_handed_on(void)
{
    canopy_can_frame_t frame;

    fake_can_reset();
    bus.controller = &fake_can;
    fake.rx_error = CANOPY_ERROR_BUS_DOWN;
    TEST_ASSERT_EQUAL(CANOPY_ERROR_BUS_DOWN, a.can.receive(a.can.context, &frame));
    TEST_ASSERT_EQUAL_UINT32(0, stats(&a).received);
    canopy_loopback_leave(&b);
    TEST_ASSERT_EQUAL(-1, receive(&b));
}

static void test_a_flood_of_what_an_endpoint_does_not_accept_cannot_hold_it_up(void)
{
    static const uint32_t ids[] = {7};
    static const canopy_can_acceptance_t acceptance = {.ids = ids, .count = 1};

    fake_can_reset();
    bus.controller = &endless;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loopback_join(&bus, &c, storage[2], CAPACITY, &acceptance));
    fetched = 0;
    TEST_ASSERT_EQUAL(-1, receive(&c));
    TEST_ASSERT_EQUAL_UINT(CANOPY_LOOPBACK_FETCH, fetched);
    TEST_ASSERT_EQUAL_UINT32(CANOPY_LOOPBACK_FETCH - CAPACITY, stats(&a).rx_dropped);
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
    RUN_TEST(test_with_a_controller_all_see_the_wire_and_each_other);
    RUN_TEST(test_what_the_controller_does_not_take_nobody_sees);
    RUN_TEST(test_an_error_of_the_controller_is_handed_on);
    RUN_TEST(test_a_flood_of_what_an_endpoint_does_not_accept_cannot_hold_it_up);
    return UNITY_END();
}
