/* SPDX-License-Identifier: MIT */
/** @file Controllers of the double: mailboxes, abort, FIFOs, filters, stamps, interrupts; and the traffic of others. */
#include <stddef.h>

#include "frame_bits.h"
#include "traffic.h"
#include "unity.h"
#include "wire.h"

enum { BIT_NS = 2000, BIT_RATE = 500000 };

static world_t world;
static wire_t wire;
static controller_t sender;
static controller_t receiver;
static uint32_t ids[16];
static unsigned count;

static void watch(void *context, const canopy_can_frame_t *frame, const controller_t *from, nanoseconds_t start,
                  nanoseconds_t end)
{
    (void)context;
    (void)from;
    (void)start;
    (void)end;
    ids[count % 16u] = frame->id;
    count++;
}

static void start(const controller_config_t *to_send, const controller_config_t *to_receive)
{
    world_init(&world);
    wire_init(&wire, &world, BIT_RATE);
    wire_set_watch(&wire, watch, NULL);
    controller_init(&sender, &wire, "sender", to_send);
    controller_init(&receiver, &wire, "receiver", to_receive);
    count = 0;
}

void setUp(void)
{
    const controller_config_t common = CONTROLLER_COMMON;

    start(&common, &common);
}

void tearDown(void)
{
}

static void fill(uint8_t mailbox, uint32_t id)
{
    const canopy_can_frame_t frame = {.id = id, .length = 8, .data = {(uint8_t)id}};

    controller_release(&sender, mailbox);
    TEST_ASSERT_TRUE(controller_send(&sender, mailbox, &frame));
}

static void run_us(uint32_t us)
{
    world_run(&world, world.now + us * NS_PER_US);
}

static void test_mailboxes_by_id_or_in_order(void)
{
    controller_config_t in_order = CONTROLLER_COMMON;

    fill(0, 0x300);
    fill(1, 0x200);
    fill(2, 0x100);
    TEST_ASSERT_FALSE(controller_send(&sender, 0, &(canopy_can_frame_t){.id = 1})); /* it is not free */
    run_us(2000);
    TEST_ASSERT_EQUAL_HEX32(0x100, ids[0]);
    TEST_ASSERT_EQUAL_HEX32(0x300, ids[2]);
    in_order.in_order = true;
    start(&in_order, &in_order);
    fill(2, 0x300);
    fill(0, 0x200);
    fill(1, 0x100);
    run_us(2000);
    TEST_ASSERT_EQUAL_HEX32(0x300, ids[0]);
    TEST_ASSERT_EQUAL_HEX32(0x200, ids[1]);
}

static void test_one_mailbox_holds_one_frame(void)
{
    controller_config_t one = CONTROLLER_COMMON;

    one.mailboxes = 1;
    start(&one, &one);
    fill(0, 0x100);
    TEST_ASSERT_FALSE(controller_send(&sender, 0, &(canopy_can_frame_t){.id = 1}));
    TEST_ASSERT_FALSE(controller_send(&sender, 1, &(canopy_can_frame_t){.id = 1})); /* there is none */
}

static void test_abort_of_one_that_waits_and_of_one_on_the_wire(void)
{
    fill(0, 0x100);
    fill(1, 0x200);
    run_us(50); /* the first is on the wire */
    controller_abort(&sender, 0);
    controller_abort(&sender, 1);
    TEST_ASSERT_EQUAL(MAILBOX_PENDING, sender.mailboxes[0].state);
    TEST_ASSERT_EQUAL(MAILBOX_ABORTED, sender.mailboxes[1].state);
    run_us(1000);
    TEST_ASSERT_EQUAL(MAILBOX_SENT, sender.mailboxes[0].state); /* too late for an abort */
    TEST_ASSERT_EQUAL_UINT(1, count);
}

/* The abort of a frame on the wire takes effect when that attempt fails: it is not sent again. */
static void test_abort_of_a_frame_that_fails(void)
{
    wire_disturb(&wire, 1);
    fill(0, 0x100);
    run_us(1);
    controller_abort(&sender, 0);
    run_us(2000);
    TEST_ASSERT_EQUAL(MAILBOX_ABORTED, sender.mailboxes[0].state);
    TEST_ASSERT_EQUAL_UINT(0, count);
}

static void send_ids(uint32_t first, unsigned frames)
{
    for (unsigned index = 0; index < frames; index++) {
        fill(0, first + index);
        run_us(400);
    }
}

static void test_a_full_fifo_drops_or_overwrites(void)
{
    controller_config_t overwrites = CONTROLLER_COMMON;
    received_t received;

    send_ids(0x100, 5);
    TEST_ASSERT_EQUAL_UINT(2, receiver.fifos[0].lost);
    for (uint32_t id = 0x100; id < 0x103u; id++) {
        TEST_ASSERT_TRUE(controller_receive(&receiver, 0, &received));
        TEST_ASSERT_EQUAL_HEX32(id, received.frame.id);
    }
    overwrites.overwrites = true;
    start(&overwrites, &overwrites);
    send_ids(0x100, 5);
    TEST_ASSERT_EQUAL_UINT(2, receiver.fifos[0].lost);
    TEST_ASSERT_TRUE(controller_receive(&receiver, 0, &received));
    TEST_ASSERT_EQUAL_HEX32(0x100, received.frame.id);
    TEST_ASSERT_TRUE(controller_receive(&receiver, 0, &received));
    TEST_ASSERT_TRUE(controller_receive(&receiver, 0, &received));
    TEST_ASSERT_EQUAL_HEX32(0x104, received.frame.id);
    TEST_ASSERT_FALSE(controller_receive(&receiver, 0, &received));
}

static void test_filters_choose_the_fifo(void)
{
    received_t received;

    controller_filter(&receiver, (controller_filter_t){.id = 0x100, .mask = 0x7F0, .fifo = 1});
    controller_filter(&receiver, (controller_filter_t){.id = 0x200, .mask = 0x7FF, .fifo = 0});
    fill(0, 0x10F);
    fill(1, 0x200);
    fill(2, 0x201);
    run_us(2000);
    TEST_ASSERT_TRUE(controller_receive(&receiver, 1, &received));
    TEST_ASSERT_EQUAL_HEX32(0x10F, received.frame.id);
    TEST_ASSERT_TRUE(controller_receive(&receiver, 0, &received));
    TEST_ASSERT_EQUAL_HEX32(0x200, received.frame.id);
    TEST_ASSERT_FALSE(controller_receive(&receiver, 0, &received));
    TEST_ASSERT_FALSE(controller_receive(&receiver, 1, &received));
}

/* 16 bits of 2 us: a turn is 131 ms. */
static void test_stamps_wrap_around(void)
{
    received_t received;
    uint32_t last;

    send_ids(0x100, 1);
    TEST_ASSERT_TRUE(controller_receive(&receiver, 0, &received));
    last = received.stamp;
    run_us(131072u - 400u);
    send_ids(0x100, 1);
    TEST_ASSERT_TRUE(controller_receive(&receiver, 0, &received));
    TEST_ASSERT_EQUAL_UINT32(last, received.stamp);
}

static unsigned interrupts;
static nanoseconds_t interrupt_at;

static void isr(void *context)
{
    (void)context;
    interrupts++;
    interrupt_at = world.now;
}

static void test_interrupts_have_a_latency(void)
{
    controller_config_t slow = CONTROLLER_COMMON;
    nanoseconds_t end;

    slow.latency_ns = 50000;
    slow.latency_jitter_ns = 20000;
    start(&slow, &slow);
    receiver.isr = isr;
    interrupts = 0;
    fill(0, 0x100);
    run_us(1000);
    end = (frame_length(&sender.mailboxes[0].frame) - 4u) * (nanoseconds_t)BIT_NS; /* valid one bit before the end */
    TEST_ASSERT_EQUAL_UINT(1, interrupts);
    TEST_ASSERT_GREATER_OR_EQUAL_UINT64(end + 50000u, interrupt_at);
    TEST_ASSERT_LESS_OR_EQUAL_UINT64(end + 70000u, interrupt_at);
}

/* The share over a minute, and the bound on bursts in every window that begins with a frame. */
static void test_traffic_has_its_share_and_keeps_its_bound(void)
{
    static traffic_t traffic;
    const uint32_t shares[] = {100, 600, 900};

    for (unsigned index = 0; index < 3u; index++) {
        setUp();
        traffic_init(&traffic, &wire,
                     &(traffic_config_t){.seed = 7, .per_mille = shares[index], .burst = 10, .highest_id = 0xFF});
        world_run(&world, 20u * NS_PER_S);
        TEST_ASSERT_UINT_WITHIN(5, shares[index], (uint32_t)(wire.busy_ns * 1000u / world.now));
        TEST_ASSERT_EQUAL_UINT32(0, traffic.lost);
    }
}

static nanoseconds_t run_of_frames;
static nanoseconds_t longest_run;
static nanoseconds_t last_end;

static void watch_runs(void *context, const canopy_can_frame_t *frame, const controller_t *from, nanoseconds_t begin,
                       nanoseconds_t end)
{
    (void)context;
    (void)from;
    run_of_frames = begin == last_end + 3u * (nanoseconds_t)BIT_NS ? run_of_frames : 0u;
    run_of_frames += frame_length(frame) * (nanoseconds_t)BIT_NS;
    longest_run = run_of_frames > longest_run ? run_of_frames : longest_run;
    last_end = end;
}

/* Alone on the bus, a run without a pause is at most the burst, plus the share of that time: run = burst / (1 - share). */
static void test_traffic_bursts(void)
{
    static traffic_t traffic;
    const nanoseconds_t burst = 10u * (nanoseconds_t)TRAFFIC_FRAME_BITS * BIT_NS;

    wire_set_watch(&wire, watch_runs, NULL);
    longest_run = 0;
    traffic_init(&traffic, &wire, &(traffic_config_t){.seed = 3, .per_mille = 600, .burst = 10, .highest_id = 0xFF});
    world_run(&world, 60u * NS_PER_S);
    TEST_ASSERT_LESS_OR_EQUAL_UINT64(burst * 10u / 4u, longest_run);
    TEST_ASSERT_GREATER_OR_EQUAL_UINT64(burst, longest_run); /* and it does use it */
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_mailboxes_by_id_or_in_order);
    RUN_TEST(test_one_mailbox_holds_one_frame);
    RUN_TEST(test_abort_of_one_that_waits_and_of_one_on_the_wire);
    RUN_TEST(test_abort_of_a_frame_that_fails);
    RUN_TEST(test_a_full_fifo_drops_or_overwrites);
    RUN_TEST(test_filters_choose_the_fifo);
    RUN_TEST(test_stamps_wrap_around);
    RUN_TEST(test_interrupts_have_a_latency);
    RUN_TEST(test_traffic_has_its_share_and_keeps_its_bound);
    RUN_TEST(test_traffic_bursts);
    return UNITY_END();
}
