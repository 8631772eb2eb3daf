/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Lock-step: which frames a tick sees, when time moves, and when a wait ends. The inner driver is a script.
 */
#include <string.h>

#include "canopy/clock/lockstep.h"

#include "unity.h"

#define STEP_ID 0x700u
#define PERIOD UINT64_C(50000)

/* The inner driver: gives script[], one frame at each wait; without frames a wait just passes. */
static struct {
    canopy_can_frame_t script[CANOPY_LOCKSTEP_FRAMES + 8u];
    uint32_t length;
    uint32_t next;
    uint32_t waiting; /* frames that receive() may give now */
    int waits;
    int stop_at_wait; /* sets the stop flag at this wait */
    int wait_result;  /* of a wait without frames */
    canopy_can_frame_t sent;
    unsigned sends;
    int busy_sends;           /* so many more find no room */
    int pending;              /* so often more a frame is not out yet; -1: it never will be */
    canopy_can_outcome_t end; /* what becomes of it */
    unsigned aborts;
    unsigned restarts;
    int short_waits;
} inner;

static atomic_bool stop;
static canopy_can_t inner_can;
static canopy_lockstep_t lockstep;

static int inner_receive(void *context, canopy_can_frame_t *frame)
{
    (void)context;
    if (inner.waiting == 0) {
        return 0;
    }
    inner.waiting--;
    *frame = inner.script[inner.next++];
    return 1;
}

static int inner_send(void *context, uint8_t mailbox, const canopy_can_frame_t *frame)
{
    (void)context;
    TEST_ASSERT_EQUAL_UINT8(0, mailbox);
    inner.sends++;
    if (inner.busy_sends > 0) {
        inner.busy_sends--;
        return 0;
    }
    if (frame->id > 0x7FFu) {
        return CANOPY_ERROR_ARGUMENT;
    }
    inner.sent = *frame;
    return 1;
}

static canopy_can_outcome_t inner_outcome(void *context, uint8_t mailbox)
{
    (void)context;
    TEST_ASSERT_EQUAL_UINT8(0, mailbox);
    if (inner.pending != 0) {
        inner.pending -= inner.pending > 0 ? 1 : 0;
        return CANOPY_CAN_PENDING;
    }
    return inner.end;
}

static void inner_abort(void *context, uint8_t mailbox)
{
    (void)context;
    (void)mailbox;
    inner.aborts++;
}

static canopy_can_controller_t inner_state(void *context)
{
    (void)context;
    return CANOPY_CAN_CONTROLLER_PASSIVE;
}

static void inner_restart(void *context)
{
    (void)context;
    inner.restarts++;
}

static int inner_wait(void *context, uint32_t timeout_us)
{
    (void)context;
    if (timeout_us == CANOPY_LOCKSTEP_POLL_US) { /* while it sends */
        inner.short_waits++;
        return inner.waiting > 0 ? 1 : 0;
    }
    TEST_ASSERT_EQUAL_UINT32(CANOPY_LOCKSTEP_SLICE_US, timeout_us);
    inner.waits++;
    if (inner.waits == inner.stop_at_wait) {
        atomic_store(&stop, true);
    }
    if (inner.next == inner.length) {
        return inner.wait_result;
    }
    inner.waiting = 1;
    return 1;
}

static void inner_stats(void *context, canopy_can_stats_t *stats)
{
    (void)context;
    *stats = (canopy_can_stats_t){.received = 1000, .sent = 5, .rx_dropped = 3, .tx_dropped = 2, .rx_high_water = 1};
}

void setUp(void)
{
    inner.length = 0;
    inner.next = 0;
    inner.waiting = 0;
    inner.waits = 0;
    inner.stop_at_wait = 0;
    inner.wait_result = 0;
    inner.sends = 0;
    inner.busy_sends = 0;
    inner.pending = 0;
    inner.end = CANOPY_CAN_SENT;
    inner.aborts = 0;
    inner.restarts = 0;
    inner.short_waits = 0;
    atomic_store(&stop, false);
    inner_can = (canopy_can_t){.receive = inner_receive, .send = inner_send, .wait = inner_wait, .stats = inner_stats};
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_lockstep_init(&lockstep, &inner_can, STEP_ID, &stop));
}

void tearDown(void)
{
}

static void script(uint32_t id, uint8_t data)
{
    inner.script[inner.length++] = (canopy_can_frame_t){.id = id, .length = 1, .data = {data}};
}

static bool wait_until(canopy_time_t deadline)
{
    return lockstep.clock.wait_until(lockstep.clock.context, deadline);
}

static canopy_time_t now(void)
{
    return lockstep.clock.now(lockstep.clock.context);
}

static void expect_frame(uint32_t id, uint8_t data)
{
    canopy_can_frame_t frame;
    TEST_ASSERT_EQUAL(1, lockstep.can.receive(lockstep.can.context, &frame));
    TEST_ASSERT_EQUAL_HEX32(id, frame.id);
    TEST_ASSERT_EQUAL_HEX8(data, frame.data[0]);
    TEST_ASSERT_TRUE(frame.time == lockstep.now); /* time stood still while it came */
}

static void expect_no_frame(void)
{
    canopy_can_frame_t frame;
    TEST_ASSERT_EQUAL(0, lockstep.can.receive(lockstep.can.context, &frame));
}

static void test_a_tick_sees_exactly_the_frames_before_its_step(void)
{
    script(0x100, 1);
    script(0x110, 2);
    script(STEP_ID, 0);
    script(0x100, 3);
    script(STEP_ID, 1);
    inner.waiting = 5; /* all are there at once: the second step must not leak into the first */

    TEST_ASSERT_EQUAL_UINT64(0, now());
    TEST_ASSERT_TRUE(wait_until(PERIOD));
    TEST_ASSERT_EQUAL_UINT64(PERIOD, now());
    expect_frame(0x100, 1);
    expect_frame(0x110, 2);
    expect_no_frame();

    TEST_ASSERT_TRUE(wait_until(2 * PERIOD));
    TEST_ASSERT_EQUAL_UINT64(2 * PERIOD, now());
    expect_frame(0x100, 3);
    expect_no_frame();
    TEST_ASSERT_EQUAL(0, inner.waits);
}

static void test_frames_that_come_one_by_one_are_waited_for(void)
{
    script(0x100, 1);
    script(STEP_ID, 7);

    TEST_ASSERT_TRUE(wait_until(PERIOD));
    TEST_ASSERT_EQUAL(2, inner.waits);
    expect_frame(0x100, 1);
    expect_no_frame();
}

static void test_the_same_step_again_is_no_new_step(void)
{
    script(STEP_ID, 4);
    script(0x100, 1);
    script(STEP_ID, 4);
    script(0x100, 2);
    script(STEP_ID, 5);

    TEST_ASSERT_TRUE(wait_until(PERIOD));
    expect_no_frame();
    TEST_ASSERT_TRUE(wait_until(2 * PERIOD));
    expect_frame(0x100, 1); /* of the reminder; the loop drops it as a repeat or takes it, but never loses it */
    expect_frame(0x100, 2);
    expect_no_frame();
}

static void test_what_lies_behind_the_data_makes_no_new_step(void)
{
    script(STEP_ID, 4);
    script(STEP_ID, 4);
    memset(&inner.script[1].data[1], 0x5A, sizeof inner.script[1].data - 1u);
    script(STEP_ID, 5);

    TEST_ASSERT_TRUE(wait_until(PERIOD));
    TEST_ASSERT_TRUE(wait_until(2 * PERIOD));
    TEST_ASSERT_EQUAL(3, inner.waits);
}

static void test_a_shorter_step_is_a_new_one(void)
{
    script(STEP_ID, 4);
    script(STEP_ID, 4);
    inner.script[1].length = 0;

    TEST_ASSERT_TRUE(wait_until(PERIOD));
    TEST_ASSERT_TRUE(wait_until(2 * PERIOD));
}

static void test_frames_of_other_formats_with_the_step_id_are_no_steps(void)
{
    script(STEP_ID, 1);
    script(STEP_ID, 2);
    script(STEP_ID, 3);
    inner.script[0].flags = CANOPY_CAN_EXTENDED;
    inner.script[1].flags = CANOPY_CAN_REMOTE;

    TEST_ASSERT_TRUE(wait_until(PERIOD));
    expect_frame(STEP_ID, 1);
    expect_frame(STEP_ID, 2);
    expect_no_frame();
}

static void test_time_never_goes_back_and_a_late_tick_still_needs_a_step(void)
{
    script(STEP_ID, 1);
    script(STEP_ID, 2);

    TEST_ASSERT_TRUE(wait_until(5 * PERIOD));
    TEST_ASSERT_TRUE(wait_until(2 * PERIOD));
    TEST_ASSERT_EQUAL_UINT64(5 * PERIOD, now());
    inner.stop_at_wait = inner.waits + 1;
    TEST_ASSERT_FALSE(wait_until(2 * PERIOD));
}

static void test_stop_flag_ends_the_wait(void)
{
    inner.stop_at_wait = 3;

    TEST_ASSERT_FALSE(wait_until(PERIOD));
    TEST_ASSERT_EQUAL(3, inner.waits);
    TEST_ASSERT_EQUAL_UINT64(0, now());
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_lockstep_error(&lockstep));
}

static void test_inner_driver_that_keeps_failing_ends_the_wait(void)
{
    inner.wait_result = CANOPY_ERROR_BUS_DOWN;

    TEST_ASSERT_FALSE(wait_until(PERIOD));
    TEST_ASSERT_EQUAL(CANOPY_LOCKSTEP_FAILURES_MAX, inner.waits);
    TEST_ASSERT_EQUAL(CANOPY_ERROR_BUS_DOWN, canopy_lockstep_error(&lockstep));
}

static void test_full_buffer_keeps_the_newest_and_counts_the_rest(void)
{
    for (unsigned i = 0; i < CANOPY_LOCKSTEP_FRAMES + 3u; i++) {
        script(0x100, (uint8_t)i);
    }
    script(STEP_ID, 1);
    canopy_can_stats_t stats;

    TEST_ASSERT_TRUE(wait_until(PERIOD));
    for (unsigned i = 3; i < CANOPY_LOCKSTEP_FRAMES + 3u; i++) {
        expect_frame(0x100, (uint8_t)i);
    }
    expect_no_frame();
    lockstep.can.stats(lockstep.can.context, &stats);
    TEST_ASSERT_EQUAL_UINT32(CANOPY_LOCKSTEP_FRAMES, stats.received);
    TEST_ASSERT_EQUAL_UINT32(3 + 3, stats.rx_dropped);
    TEST_ASSERT_EQUAL_UINT32(5, stats.sent);
    TEST_ASSERT_EQUAL_UINT32(2, stats.tx_dropped);
    TEST_ASSERT_EQUAL_UINT32(CANOPY_LOCKSTEP_FRAMES, stats.rx_high_water);
}

static void test_frames_are_sent_by_the_inner_driver(void)
{
    const canopy_can_frame_t frame = {.id = 0x200, .length = 0};

    TEST_ASSERT_EQUAL(1, lockstep.can.send(lockstep.can.context, 0, &frame));
    TEST_ASSERT_EQUAL_HEX32(0x200, inner.sent.id);
    TEST_ASSERT_NULL(lockstep.can.wait);
}

static int send(uint32_t id)
{
    const canopy_can_frame_t frame = {.id = id};
    return lockstep.can.send(lockstep.can.context, 0, &frame);
}

static void test_a_send_waits_until_the_frame_is_out(void)
{
    inner_can.outcome = inner_outcome;
    inner.busy_sends = 3;
    inner.pending = 5;
    TEST_ASSERT_EQUAL(1, send(0x200));
    TEST_ASSERT_EQUAL_UINT(4, inner.sends);
    TEST_ASSERT_EQUAL(0, inner.pending);
    TEST_ASSERT_EQUAL(8, inner.short_waits);
    TEST_ASSERT_NULL(lockstep.can.outcome); /* nothing is left to do between two ticks */
    inner.end = CANOPY_CAN_ABORTED;
    TEST_ASSERT_EQUAL(CANOPY_ERROR_BUS_DOWN, send(0x201));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, send(0x800));
}

static void test_a_send_that_takes_too_long_is_an_error_and_not_tried_between_ticks(void)
{
    inner_can.outcome = inner_outcome;
    inner_can.abort = inner_abort;
    inner.pending = -1;
    TEST_ASSERT_EQUAL(CANOPY_ERROR_BUS_DOWN, send(0x200));
    TEST_ASSERT_EQUAL(CANOPY_LOCKSTEP_SEND_WAITS, inner.short_waits);
    TEST_ASSERT_EQUAL_UINT(1, inner.aborts);
    TEST_ASSERT_EQUAL(CANOPY_ERROR_BUS_DOWN, send(0x201)); /* not handed over: the first one is still there */
    TEST_ASSERT_EQUAL_UINT(1, inner.sends);
    inner.pending = 2;
    TEST_ASSERT_EQUAL(1, send(0x202));
    TEST_ASSERT_EQUAL_HEX32(0x202, inner.sent.id);
    TEST_ASSERT_EQUAL_UINT(2, inner.sends);
    inner.busy_sends = 1000000;
    TEST_ASSERT_EQUAL(CANOPY_ERROR_BUS_DOWN, send(0x203));
}

static void test_frames_that_come_meanwhile_do_not_make_a_send_endless(void)
{
    inner_can.outcome = inner_outcome;
    inner.pending = -1;
    inner.waiting = 1; /* so each wait ends at once */
    TEST_ASSERT_EQUAL(CANOPY_ERROR_BUS_DOWN, send(0x200));
    TEST_ASSERT_EQUAL(CANOPY_LOCKSTEP_SEND_POLLS, inner.short_waits);
}

static void test_state_and_restart_are_the_inner_drivers(void)
{
    TEST_ASSERT_EQUAL(CANOPY_CAN_CONTROLLER_ACTIVE, lockstep.can.state(lockstep.can.context));
    lockstep.can.restart(lockstep.can.context);
    inner_can.state = inner_state;
    inner_can.restart = inner_restart;
    inner_can.is_filtered = true;
    TEST_ASSERT_EQUAL(CANOPY_CAN_CONTROLLER_PASSIVE, lockstep.can.state(lockstep.can.context));
    lockstep.can.restart(lockstep.can.context);
    TEST_ASSERT_EQUAL_UINT(1, inner.restarts);
    TEST_ASSERT_FALSE(lockstep.can.is_filtered);
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_lockstep_init(&lockstep, &inner_can, STEP_ID, &stop));
    TEST_ASSERT_TRUE(lockstep.can.is_filtered);
}

static void test_an_inner_driver_need_not_count(void)
{
    canopy_can_stats_t stats;

    inner_can.stats = NULL;
    lockstep.can.stats(lockstep.can.context, &stats);
    TEST_ASSERT_EQUAL_UINT32(0, stats.sent);
}

static void test_init_refuses_bad_arguments(void)
{
    canopy_can_t cannot_wait = inner_can;
    cannot_wait.wait = NULL;

    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_lockstep_init(NULL, &inner_can, STEP_ID, NULL));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_lockstep_init(&lockstep, NULL, STEP_ID, NULL));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_lockstep_init(&lockstep, &inner_can, 0x800, NULL));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_UNSUPPORTED, canopy_lockstep_init(&lockstep, &cannot_wait, STEP_ID, NULL));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_tick_sees_exactly_the_frames_before_its_step);
    RUN_TEST(test_frames_that_come_one_by_one_are_waited_for);
    RUN_TEST(test_the_same_step_again_is_no_new_step);
    RUN_TEST(test_what_lies_behind_the_data_makes_no_new_step);
    RUN_TEST(test_a_shorter_step_is_a_new_one);
    RUN_TEST(test_frames_of_other_formats_with_the_step_id_are_no_steps);
    RUN_TEST(test_time_never_goes_back_and_a_late_tick_still_needs_a_step);
    RUN_TEST(test_stop_flag_ends_the_wait);
    RUN_TEST(test_inner_driver_that_keeps_failing_ends_the_wait);
    RUN_TEST(test_full_buffer_keeps_the_newest_and_counts_the_rest);
    RUN_TEST(test_frames_are_sent_by_the_inner_driver);
    RUN_TEST(test_a_send_waits_until_the_frame_is_out);
    RUN_TEST(test_a_send_that_takes_too_long_is_an_error_and_not_tried_between_ticks);
    RUN_TEST(test_frames_that_come_meanwhile_do_not_make_a_send_endless);
    RUN_TEST(test_state_and_restart_are_the_inner_drivers);
    RUN_TEST(test_an_inner_driver_need_not_count);
    RUN_TEST(test_init_refuses_bad_arguments);
    return UNITY_END();
}
