/* SPDX-License-Identifier: MIT */
/** @file The wire of the double: order, times, error counters, bus-off and its recovery. */
#include <stddef.h>

#include "frame_bits.h"
#include "unity.h"
#include "wire.h"

enum { BIT_NS = 2000, LOG_MAX = 64 };

static world_t world;
static wire_t wire;
static wire_t nowhere;
static controller_t a;
static controller_t b;
static controller_t c;

static struct {
    uint32_t ids[LOG_MAX];
    nanoseconds_t starts[LOG_MAX];
    nanoseconds_t ends[LOG_MAX];
    unsigned count;
} seen;

static void watch(void *context, const canopy_can_frame_t *frame, const controller_t *from, nanoseconds_t start,
                  nanoseconds_t end)
{
    (void)context;
    (void)from;
    if (seen.count < LOG_MAX) {
        seen.ids[seen.count] = frame->id;
        seen.starts[seen.count] = start;
        seen.ends[seen.count] = end;
        seen.count++;
    }
}

void setUp(void)
{
    controller_config_t config = CONTROLLER_COMMON;

    world_init(&world);
    wire_init(&wire, &world, 500000);
    wire_init(&nowhere, &world, 500000);
    wire_set_watch(&wire, watch, NULL);
    controller_init(&a, &wire, "a", &config);
    controller_init(&b, &wire, "b", &config);
    controller_init(&c, &wire, "c", &config);
    seen.count = 0;
}

void tearDown(void)
{
}

static void send(controller_t *controller, uint8_t mailbox, uint32_t id)
{
    const canopy_can_frame_t frame = {.id = id, .length = 8, .data = {1, 2, 3, 4, 5, 6, 7, (uint8_t)id}};

    controller_release(controller, mailbox);
    TEST_ASSERT_TRUE(controller_send(controller, mailbox, &frame));
}

static void run_bits(unsigned count)
{
    world_run(&world, world.now + (nanoseconds_t)count * BIT_NS);
}

static void test_a_frame_takes_its_bits(void)
{
    const canopy_can_frame_t frame = {.id = 0x123, .length = 3, .data = {0, 0, 0}};
    received_t received;

    world_run(&world, 12345);
    TEST_ASSERT_TRUE(controller_send(&a, 0, &frame));
    run_bits(frame_length(&frame) - (unsigned)INTERMISSION - 2u);
    TEST_ASSERT_FALSE(controller_receive(&b, 0, &received));
    run_bits(1);
    TEST_ASSERT_TRUE(controller_receive(&b, 0, &received));
    TEST_ASSERT_EQUAL(MAILBOX_PENDING, a.mailboxes[0].state);
    run_bits(1);
    TEST_ASSERT_EQUAL(MAILBOX_SENT, a.mailboxes[0].state);
    TEST_ASSERT_FALSE(controller_receive(&a, 0, &received)); /* not one's own */
    TEST_ASSERT_EQUAL_UINT64(12345, seen.starts[0]);
    TEST_ASSERT_EQUAL_UINT64(12345u + (frame_length(&frame) - 3u) * BIT_NS, seen.ends[0]);
}

static void test_the_lowest_id_of_all_goes_first(void)
{
    send(&a, 0, 0x300);
    send(&b, 0, 0x100);
    send(&b, 1, 0x400);
    send(&c, 0, 0x200);
    run_bits(1000);
    TEST_ASSERT_EQUAL_UINT(4, seen.count);
    for (unsigned index = 0; index < 4u; index++) {
        TEST_ASSERT_EQUAL_HEX32(0x100u * (index + 1u), seen.ids[index]);
    }
    /* Back to back: the next begins after the three bits of intermission. */
    TEST_ASSERT_EQUAL_UINT64(seen.ends[0] + 3u * (nanoseconds_t)BIT_NS, seen.starts[1]);
}

static void test_the_same_id_from_two_is_an_error_for_both(void)
{
    const canopy_can_frame_t one = {.id = 0x100, .length = 1, .data = {1}};
    const canopy_can_frame_t other = {.id = 0x100, .length = 1, .data = {2}};

    TEST_ASSERT_TRUE(controller_send(&a, 0, &one));
    TEST_ASSERT_TRUE(controller_send(&b, 0, &other));
    run_bits(60);
    TEST_ASSERT_EQUAL_UINT(8, a.transmit_errors);
    TEST_ASSERT_EQUAL_UINT(8, b.transmit_errors);
    TEST_ASSERT_EQUAL_UINT(1, c.receive_errors);
    TEST_ASSERT_EQUAL_UINT(0, seen.count);
}

static void test_a_disturbed_frame_is_sent_again(void)
{
    wire_disturb(&wire, 2);
    send(&a, 0, 0x100);
    run_bits(600);
    TEST_ASSERT_EQUAL_UINT(1, seen.count);
    TEST_ASSERT_EQUAL_UINT(15, a.transmit_errors); /* 8, 8, and one less for the good one */
    TEST_ASSERT_EQUAL_UINT(1, b.receive_errors);   /* 1, 1, and one less */
}

/* Nobody there: error-passive after 16 attempts, and no further: rule 3, exception 1. It goes on trying. */
static void test_without_acknowledgement_never_bus_off(void)
{
    wire_plug(&nowhere, &a);
    send(&a, 0, 0x100);
    run_bits(100000);
    TEST_ASSERT_EQUAL_UINT(128, a.transmit_errors);
    TEST_ASSERT_EQUAL(CANOPY_CAN_CONTROLLER_PASSIVE, controller_state(&a));
    TEST_ASSERT_GREATER_THAN_UINT(500, nowhere.errors);
    TEST_ASSERT_EQUAL(MAILBOX_PENDING, a.mailboxes[0].state);
    wire_plug(&wire, &a);
    run_bits(300);
    TEST_ASSERT_EQUAL(MAILBOX_SENT, a.mailboxes[0].state);
    TEST_ASSERT_EQUAL_UINT(135, a.transmit_errors); /* the attempt that the plug cut off counts: 8; the good one: -1 */
}

static void test_states_at_96_128_and_256(void)
{
    a.cannot_drive = true;
    send(&a, 0, 0x100);
    while (a.transmit_errors < 96u) {
        TEST_ASSERT_EQUAL(CANOPY_CAN_CONTROLLER_ACTIVE, controller_state(&a));
        run_bits(1);
    }
    TEST_ASSERT_EQUAL(CANOPY_CAN_CONTROLLER_WARNING, controller_state(&a));
    while (a.transmit_errors < 128u) {
        run_bits(1);
    }
    TEST_ASSERT_EQUAL(CANOPY_CAN_CONTROLLER_PASSIVE, controller_state(&a));
    while (!a.bus_off) {
        run_bits(1);
    }
    TEST_ASSERT_EQUAL_UINT(256, a.transmit_errors);
    TEST_ASSERT_EQUAL(CANOPY_CAN_CONTROLLER_BUS_OFF, controller_state(&a));
    TEST_ASSERT_EQUAL_UINT(0, b.receive_errors); /* its own fault: the others do not notice */
}

static void go_bus_off(void)
{
    a.cannot_drive = true;
    send(&a, 0, 0x100);
    run_bits(2000);
    TEST_ASSERT_TRUE(a.bus_off);
    a.cannot_drive = false;
}

static void test_recovery_takes_128_times_11_recessive_bits(void)
{
    go_bus_off();
    run_bits(100000);
    TEST_ASSERT_TRUE(a.bus_off); /* not by itself */
    controller_restart(&a);
    run_bits(128u * 11u - 1u);
    TEST_ASSERT_TRUE(a.bus_off);
    run_bits(1);
    TEST_ASSERT_FALSE(a.bus_off);
    TEST_ASSERT_EQUAL_UINT(0, a.transmit_errors);
    run_bits(200);
    TEST_ASSERT_EQUAL_HEX32(0x100, seen.ids[0]); /* this part keeps what waited */
}

/* On a bus without a pause each frame ends with 11 recessive bits, so it takes 128 frames. */
static void test_recovery_on_a_full_bus_takes_128_frames(void)
{
    unsigned frames;

    go_bus_off();
    send(&b, 0, 0x200);
    controller_restart(&a);
    for (frames = 0; a.bus_off && frames < 1000u; frames++) {
        send(&b, (uint8_t)((frames + 1u) % 2u), 0x200);
        while (b.mailboxes[frames % 2u].state == MAILBOX_PENDING) {
            run_bits(1);
        }
    }
    TEST_ASSERT_UINT_WITHIN(1, 129, frames);
}

/* While it is sending: rule 6 takes the transmitter off the bus within a ms; the listeners become passive. */
static void test_a_short_circuit_takes_the_sender_off_the_bus(void)
{
    send(&a, 0, 0x100);
    run_bits(30);
    wire_hold(&wire, true);
    run_bits(300);
    TEST_ASSERT_TRUE(a.bus_off);
    TEST_ASSERT_EQUAL(CANOPY_CAN_CONTROLLER_PASSIVE, controller_state(&b));
    controller_restart(&a);
    run_bits(100000);
    TEST_ASSERT_TRUE(a.bus_off); /* there are no recessive bits */
    wire_hold(&wire, false);
    run_bits(8u + 3u + 128u * 11u + 200u);
    TEST_ASSERT_FALSE(a.bus_off);
    TEST_ASSERT_EQUAL_UINT(1, seen.count);
    TEST_ASSERT_EQUAL_UINT(119, b.receive_errors); /* rule 8 */
}

static void test_a_short_circuit_blocks_those_that_were_silent(void)
{
    wire_hold(&wire, true);
    send(&a, 0, 0x100);
    run_bits(100000);
    TEST_ASSERT_EQUAL(CANOPY_CAN_CONTROLLER_PASSIVE, controller_state(&a));
    TEST_ASSERT_EQUAL(MAILBOX_PENDING, a.mailboxes[0].state);
    TEST_ASSERT_EQUAL_UINT(0, a.transmit_errors);
    wire_hold(&wire, false);
    run_bits(300);
    TEST_ASSERT_EQUAL(MAILBOX_SENT, a.mailboxes[0].state);
}

static void test_a_cut_frame_is_an_error(void)
{
    send(&a, 0, 0x100);
    run_bits(30);
    wire_plug(&nowhere, &a);
    run_bits(100);
    TEST_ASSERT_EQUAL_UINT(1, b.receive_errors);
    TEST_ASSERT_EQUAL_UINT(0, seen.count);
    send(&b, 0, 0x200);
    run_bits(200);
    TEST_ASSERT_EQUAL_UINT(1, seen.count);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_frame_takes_its_bits);
    RUN_TEST(test_the_lowest_id_of_all_goes_first);
    RUN_TEST(test_the_same_id_from_two_is_an_error_for_both);
    RUN_TEST(test_a_disturbed_frame_is_sent_again);
    RUN_TEST(test_without_acknowledgement_never_bus_off);
    RUN_TEST(test_states_at_96_128_and_256);
    RUN_TEST(test_recovery_takes_128_times_11_recessive_bits);
    RUN_TEST(test_recovery_on_a_full_bus_takes_128_frames);
    RUN_TEST(test_a_short_circuit_takes_the_sender_off_the_bus);
    RUN_TEST(test_a_short_circuit_blocks_those_that_were_silent);
    RUN_TEST(test_a_cut_frame_is_an_error);
    return UNITY_END();
}
