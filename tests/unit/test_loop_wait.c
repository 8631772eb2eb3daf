/* SPDX-License-Identifier: MIT */
/**
 * @file
 * What the loop does while it waits: it serves mailboxes between the ticks, and at a stop until the safe values are out,
 * within a bound.
 */
#include "fake_mailboxes.h"
#include "small_app.h"
#include "unity.h"

enum { WAITS = 64 };

static small_memory_t memory, other_memory;
static canopy_app_t app, other_app;
static canopy_can_t can;
static canopy_loop_config_t config, other_config;
static canopy_loop_t loop, other;

/* A clock on which reading takes `reading_us`, and waiting as long as it says. A frame takes FRAME_US on the wire. */
static canopy_time_t clock_now;
static canopy_time_t reading_us;
static canopy_time_t waits[WAITS]; /* when each wait ended */
static unsigned wait_count;
static unsigned waits_max; /* then the program is to end */
static unsigned bus_waits; /* calls of the driver's wait() */
static bool is_blocked;
static canopy_time_t on_the_wire_until;

/** What the wire has done since the clock was read last. */
static void run_the_wire(void)
{
    if (is_blocked || !boxes.is_full[0] || boxes.outcome[0] != CANOPY_CAN_PENDING) {
        on_the_wire_until = clock_now + FRAME_US;
    } else if (clock_now >= on_the_wire_until) {
        boxes_let_out(0);
        on_the_wire_until = clock_now + FRAME_US;
    }
}

static canopy_time_t now(void *context)
{
    (void)context;
    clock_now += reading_us;
    run_the_wire();
    return clock_now;
}

static bool wait_until(void *context, canopy_time_t deadline)
{
    (void)context;
    if (wait_count == waits_max) {
        return false;
    }
    if (clock_now < deadline) {
        clock_now = deadline;
    }
    waits[wait_count++] = clock_now;
    run_the_wire();
    return true;
}

static const canopy_clock_t fake_clock = {.now = now, .wait_until = wait_until};

static int bus_wait(void *context, uint32_t timeout_us)
{
    (void)context;
    bus_waits++;
    clock_now += timeout_us;
    return 0;
}

void setUp(void)
{
    boxes_reset();
    clock_now = 0;
    reading_us = 0;
    wait_count = 0;
    waits_max = WAITS;
    bus_waits = 0;
    is_blocked = false;
    on_the_wire_until = 0;
    app = small_app(&memory);
    other_app = small_app(&other_memory);
    can = (canopy_can_t){
        .receive = boxes_receive, .send = boxes_send, .outcome = boxes_outcome, .abort = boxes_abort, .mailboxes = 1};
    config = (canopy_loop_config_t){.app = &app, .can = &can, .clock = &fake_clock};
    other_config = (canopy_loop_config_t){.app = &other_app, .can = &can, .clock = &fake_clock};
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&loop, &config));
}

void tearDown(void)
{
}

/* --- between the ticks ---------------------------------------------------------------------------------------------- */

static void one_mailbox_is_served_until_everything_has_left(void)
{
    waits_max = 4; /* the first deadline, two frames, the next deadline */
    TEST_ASSERT_EQUAL(CANOPY_ERROR_BUS_DOWN, canopy_loop_run(&loop)); /* the clock does not move during the stop */
    TEST_ASSERT_EQUAL_UINT64(0, waits[0]);
    TEST_ASSERT_EQUAL_UINT64(FRAME_US, waits[1]);
    TEST_ASSERT_EQUAL_UINT64(2 * FRAME_US, waits[2]);
    TEST_ASSERT_EQUAL_UINT64(PERIOD_US, waits[3]);
    TEST_ASSERT_EQUAL_UINT(2, boxes.out_count);
    TEST_ASSERT_EQUAL_HEX32(TX_ID, boxes.out[0].id);
    TEST_ASSERT_EQUAL_HEX32(TX_ID + 1, boxes.out[1].id);
}

static void when_nothing_waits_the_loop_waits_once(void)
{
    boxes.taken_is = CANOPY_CAN_SENT;
    waits_max = 5;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_run(&loop));
    TEST_ASSERT_EQUAL_UINT32(5, loop.ticks);
    TEST_ASSERT_EQUAL_UINT64(4 * PERIOD_US, waits[4]);
}

static void the_transmit_interrupt_needs_no_serving(void)
{
    can.request = boxes_request;
    waits_max = 3;
    (void)canopy_loop_run(&loop);
    TEST_ASSERT_EQUAL_UINT32(3, loop.ticks);
    TEST_ASSERT_EQUAL_UINT(0, boxes.offered);
    TEST_ASSERT_GREATER_OR_EQUAL_UINT(4, boxes.requests);
}

static void what_a_blocked_bus_holds_up_does_not_hold_up_the_ticks(void)
{
    is_blocked = true;
    waits_max = 1 + 3 * 5; /* four pauses fit into a period */
    (void)canopy_loop_run(&loop);
    TEST_ASSERT_EQUAL_UINT32(4, loop.ticks);
    TEST_ASSERT_EQUAL_UINT64(3 * PERIOD_US, waits[15]);
    TEST_ASSERT_EQUAL_UINT32(0, loop.overruns);
}

static void the_end_may_come_between_two_ticks(void)
{
    is_blocked = true;
    waits_max = 3;
    (void)canopy_loop_run(&loop);
    TEST_ASSERT_EQUAL_UINT32(1, loop.ticks);
    TEST_ASSERT_EQUAL_UINT64(2 * FRAME_US, waits[2]);
}

static void of_several_loops_the_shortest_frame_sets_the_pause(void)
{
    canopy_loop_t *const both[] = {&loop, &other};
    canopy_loop_t *const turned[] = {&other, &loop};

    other_app.frame_us = 100;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&other, &other_config));
    can.send = boxes_send;
    boxes.result = 0; /* both keep asking */
    waits_max = 4;
    (void)canopy_loop_run_all(both, 2);
    TEST_ASSERT_EQUAL_UINT64(0, waits[0]); /* the first */
    TEST_ASSERT_EQUAL_UINT64(0, waits[1]); /* the second, due too */
    TEST_ASSERT_EQUAL_UINT64(100, waits[2]);
    TEST_ASSERT_EQUAL_UINT64(200, waits[3]);
    setUp();
    other_app.frame_us = 100;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&other, &other_config));
    boxes.result = 0;
    waits_max = 4;
    (void)canopy_loop_run_all(turned, 2);
    TEST_ASSERT_EQUAL_UINT64(100, waits[2]);
}

static int deaf_send(void *context, uint8_t mailbox, const canopy_can_frame_t *frame)
{
    (void)context;
    (void)mailbox;
    (void)frame;
    return 0;
}

static void only_the_loops_that_have_frames_waiting_are_served(void)
{
    canopy_loop_t *const both[] = {&loop, &other};
    const canopy_can_t deaf = {.receive = boxes_receive, .send = deaf_send};

    other_config.can = &deaf;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&other, &other_config));
    boxes.taken_is = CANOPY_CAN_SENT;
    waits_max = 6; /* both ticks, and four services of the other */
    (void)canopy_loop_run_all(both, 2);
    TEST_ASSERT_EQUAL_UINT64(4 * FRAME_US, waits[5]);
    TEST_ASSERT_EQUAL_UINT(2 * TX, boxes.offered); /* in the tick, and in the stop */
}

/* --- stop ----------------------------------------------------------------------------------------------------------- */

static void stop_waits_until_the_safe_values_are_out(void)
{
    (void)canopy_loop_cycle(&loop, 0);
    TEST_ASSERT_EQUAL_UINT8(WANTED, boxes.box[0].data[0]);
    reading_us = 100;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_stop(&loop, 0));
    TEST_ASSERT_EQUAL_UINT(2, boxes.out_count); /* what the tick wanted was taken back */
    TEST_ASSERT_EQUAL_UINT8(SAFE, boxes.out[0].data[0]);
    TEST_ASSERT_EQUAL_UINT8(SAFE, boxes.out[1].data[0]);
    TEST_ASSERT_LESS_THAN_UINT64(10 * FRAME_US, clock_now);
}

static void stop_waits_for_the_trace_of_the_last_tick_too(void)
{
    app.trace = &trace;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&loop, &config));
    (void)canopy_loop_cycle(&loop, 0);
    reading_us = 100;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_stop(&loop, 0));
    TEST_ASSERT_EQUAL_UINT(8, boxes.out_count); /* two messages, CanopyTick, Inputs, both Model, Snapshot, Health */
    TEST_ASSERT_EQUAL_HEX32(TRACE_ID, boxes.out[2].id);
}

static void stop_ends_when_the_bus_lets_nothing_out(void)
{
    (void)canopy_loop_cycle(&loop, 0);
    is_blocked = true;
    reading_us = 100;
    TEST_ASSERT_EQUAL(CANOPY_ERROR_BUS_DOWN, canopy_loop_stop(&loop, 0));
    TEST_ASSERT_GREATER_OR_EQUAL_UINT64(CANOPY_LOOP_STOP_US, clock_now);
    TEST_ASSERT_LESS_OR_EQUAL_UINT64(CANOPY_LOOP_STOP_US + 100u, clock_now);
    TEST_ASSERT_FALSE(boxes.is_full[0]); /* and nothing leaves any more */
    canopy_tx_service(&memory.tx, clock_now);
    TEST_ASSERT_FALSE(boxes.is_full[0]);
    TEST_ASSERT_EQUAL_UINT(0, boxes.out_count);
}

static void the_configuration_says_how_long_a_stop_may_take(void)
{
    is_blocked = true;
    reading_us = 100;
    config.stop_us = 5000;
    TEST_ASSERT_EQUAL(CANOPY_ERROR_BUS_DOWN, canopy_loop_stop(&loop, 0));
    TEST_ASSERT_LESS_OR_EQUAL_UINT64(5100, clock_now);
}

static void stop_ends_on_a_clock_that_stands(void)
{
    is_blocked = true;
    TEST_ASSERT_EQUAL(CANOPY_ERROR_BUS_DOWN, canopy_loop_stop(&loop, 0));
}

static void stop_lets_a_driver_wait_that_can(void)
{
    can.wait = bus_wait;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_stop(&loop, 0));
    TEST_ASSERT_EQUAL_UINT(2, bus_waits); /* 1 ms each, and a frame each */
}

static void serve_as_an_interrupt_does(void *context)
{
    (void)context;
    boxes.requests++;
    canopy_tx_service(&memory.tx, clock_now);
}

static void stop_works_with_a_transmit_interrupt(void)
{
    can.request = serve_as_an_interrupt_does;
    reading_us = 100;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_stop(&loop, 0));
    TEST_ASSERT_EQUAL_UINT(2, boxes.out_count);
    TEST_ASSERT_GREATER_THAN_UINT(2, boxes.requests);
}

static void a_run_says_whether_all_safe_values_are_out(void)
{
    canopy_loop_t *const both[] = {&loop, &other};
    const canopy_can_t deaf = {.receive = boxes_receive, .send = deaf_send};

    for (unsigned which = 0; which < 3u; which++) {
        setUp();
        config.can = which == 0u ? &deaf : &can;
        other_config.can = which == 1u ? &deaf : &can;
        TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&loop, &config));
        TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&other, &other_config));
        boxes.taken_is = CANOPY_CAN_SENT;
        reading_us = 10;
        waits_max = 0;
        TEST_ASSERT_EQUAL(which < 2u ? CANOPY_ERROR_BUS_DOWN : CANOPY_OK, canopy_loop_run_all(both, 2));
        TEST_ASSERT_EQUAL_UINT(which < 2u ? TX : 2 * TX, boxes.out_count); /* the other one's are out nevertheless */
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(one_mailbox_is_served_until_everything_has_left);
    RUN_TEST(when_nothing_waits_the_loop_waits_once);
    RUN_TEST(the_transmit_interrupt_needs_no_serving);
    RUN_TEST(what_a_blocked_bus_holds_up_does_not_hold_up_the_ticks);
    RUN_TEST(the_end_may_come_between_two_ticks);
    RUN_TEST(of_several_loops_the_shortest_frame_sets_the_pause);
    RUN_TEST(only_the_loops_that_have_frames_waiting_are_served);
    RUN_TEST(stop_waits_until_the_safe_values_are_out);
    RUN_TEST(stop_waits_for_the_trace_of_the_last_tick_too);
    RUN_TEST(stop_ends_when_the_bus_lets_nothing_out);
    RUN_TEST(the_configuration_says_how_long_a_stop_may_take);
    RUN_TEST(stop_ends_on_a_clock_that_stands);
    RUN_TEST(stop_lets_a_driver_wait_that_can);
    RUN_TEST(stop_works_with_a_transmit_interrupt);
    RUN_TEST(a_run_says_whether_all_safe_values_are_out);
    return UNITY_END();
}
