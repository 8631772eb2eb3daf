/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The transmit side with several messages and mailboxes: who goes first, the trace behind the commands, and when the bus
 * counts as blocked.
 */
#include "canopy/tx.h"
#include "fake_mailboxes.h"
#include "unity.h"

enum { MESSAGES = 6, TRACE_PLACES = 4, TRACE_ID = 0x600, LATE = 1000000 };

static void encode(const void *image, uint8_t *data)
{
    data[0] = *(const uint8_t *)image;
}

#define MESSAGE(number)          \
    {.id = 0x100 + (number),     \
     .length = 1,                \
     .data_id = CANOPY_E2E_NONE, \
     .every = 1,                 \
     .place = 2 * (number),      \
     .encode = encode}
static const canopy_tx_message_t messages[MESSAGES] = {MESSAGE(0), MESSAGE(1), MESSAGE(2),
                                                       MESSAGE(3), MESSAGE(4), MESSAGE(5)};
static canopy_tx_slot_t slots[MESSAGES];
static uint8_t data[2 * MESSAGES];
static canopy_tx_trace_t places[TRACE_PLACES];
static const canopy_tx_memory_t memory = {
    .slots = slots, .data = data, .trace = places, .trace_capacity = TRACE_PLACES};
static canopy_can_t can;
static canopy_tx_t tx;

static void start(uint8_t mailboxes)
{
    boxes_reset();
    can.mailboxes = mailboxes;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_tx_init(&tx, messages, MESSAGES, &memory, &can));
}

void setUp(void)
{
    can = (canopy_can_t){
        .receive = boxes_receive, .send = boxes_send, .outcome = boxes_outcome, .abort = boxes_abort, .mailboxes = 1};
    start(1);
}

void tearDown(void)
{
}

static void post(uint16_t message, uint8_t value, canopy_time_t until)
{
    canopy_tx_post(&tx, message, &value, until);
}

static void trace(uint8_t value, canopy_time_t until)
{
    canopy_tx_trace(&tx, TRACE_ID, 0, &(canopy_tx_trace_data_t){{value}}, until);
}

static canopy_tx_counters_t counted(void)
{
    canopy_tx_counters_t counters;

    canopy_tx_count(&tx, &counters);
    return counters;
}

/** The wire takes what is in the mailboxes, the lowest id first as arbitration does, until nothing is left. */
static void let_all_out(canopy_time_t now)
{
    for (;;) {
        uint8_t first = BOXES;

        for (uint8_t box = 0; box < (uint8_t)BOXES; box++) {
            if (boxes.is_full[box] && (first == (uint8_t)BOXES || boxes.box[box].id < boxes.box[first].id)) {
                first = box;
            }
        }
        if (first == (uint8_t)BOXES) {
            return;
        }
        boxes_let_out(first);
        canopy_tx_service(&tx, now);
    }
}

static void the_number_of_mailboxes_that_are_used_is_bounded(void)
{
    static const struct {
        uint8_t has;
        unsigned used;
    } cases[] = {{0, 1}, {1, 1}, {2, 2}, {3, 3}, {4, 4}, {5, 4}, {255, 4}};

    for (unsigned number = 0; number < sizeof cases / sizeof cases[0]; number++) {
        start(cases[number].has);
        for (uint16_t message = 0; message < (uint16_t)MESSAGES; message++) {
            post(message, 1, LATE);
        }
        canopy_tx_service(&tx, 0);
        TEST_ASSERT_EQUAL_UINT(cases[number].used, boxes.offered);
        let_all_out(0);
        TEST_ASSERT_EQUAL_UINT(MESSAGES, boxes.out_count);
    }
}

static void messages_leave_in_the_order_of_their_urgency(void)
{
    for (uint8_t mailboxes = 1; mailboxes <= (uint8_t)BOXES; mailboxes++) {
        start(mailboxes);
        for (uint16_t message = MESSAGES; message > 0u; message--) {
            trace((uint8_t)message, LATE);
            post((uint16_t)(message - 1u), 1, LATE);
        }
        canopy_tx_service(&tx, 0);
        let_all_out(0);
        TEST_ASSERT_EQUAL_UINT(MESSAGES + TRACE_PLACES, boxes.out_count);
        for (unsigned frame = 0; frame < (unsigned)MESSAGES; frame++) {
            TEST_ASSERT_EQUAL_HEX32(0x100u + frame, boxes.out[frame].id);
        }
        for (unsigned frame = MESSAGES; frame < boxes.out_count; frame++) {
            TEST_ASSERT_EQUAL_HEX32(TRACE_ID, boxes.out[frame].id);
            TEST_ASSERT_EQUAL_UINT8(MESSAGES - (frame - MESSAGES), boxes.out[frame].data[0]); /* in their order */
        }
        TEST_ASSERT_EQUAL_UINT32(MESSAGES - TRACE_PLACES, counted().trace_dropped);
    }
}

/* Priority inversion: less urgent frames hold all mailboxes, and the bus is too busy for them. */
static void a_less_urgent_frame_gives_up_its_mailbox(void)
{
    start(2);
    post(3, 1, LATE);
    post(5, 1, LATE);
    canopy_tx_service(&tx, 0);
    post(4, 1, LATE);
    canopy_tx_service(&tx, 0); /* the least urgent has to go */
    TEST_ASSERT_EQUAL_UINT(1, boxes.aborts);
    TEST_ASSERT_EQUAL_HEX32(0x104, boxes.box[1].id);
    post(0, 1, LATE);
    canopy_tx_service(&tx, 0);
    TEST_ASSERT_EQUAL_UINT(2, boxes.aborts);
    TEST_ASSERT_EQUAL_HEX32(0x100, boxes.box[1].id);
    let_all_out(0);
    TEST_ASSERT_EQUAL_UINT(4, boxes.out_count); /* nothing is lost by it */
    TEST_ASSERT_EQUAL_UINT32(4, counted().sent);
    TEST_ASSERT_EQUAL_UINT32(0, counted().replaced);
}

/* The first thing that canopy_tx_post() does: what the service sees when the loop, in another thread, is just writing. */
static void abort_while_the_loop_begins_to_write(void *context, uint8_t mailbox)
{
    boxes_abort(context, mailbox);
    atomic_store(&slots[0].latest, 0u);
}

/* test_tx_threads.c meets this, too, but only by chance. */
static void a_message_that_the_loop_is_just_writing_waits_for_the_next_service(void)
{
    can.abort = abort_while_the_loop_begins_to_write;
    start(1);
    post(1, 1, LATE);
    canopy_tx_service(&tx, 0);
    post(0, 1, LATE);
    canopy_tx_service(&tx, 0); /* message 1 gives up its mailbox for message 0, which cannot be read now */
    TEST_ASSERT_EQUAL_UINT(1, boxes.aborts);
    TEST_ASSERT_EQUAL_HEX32(0x101, boxes.box[0].id);
    TEST_ASSERT_EQUAL_UINT(2, boxes.offered);
    can.abort = boxes_abort;
    post(0, 2, LATE); /* the loop has written */
    canopy_tx_service(&tx, 0);
    let_all_out(0);
    TEST_ASSERT_EQUAL_UINT(2, boxes.out_count);
    TEST_ASSERT_EQUAL_HEX32(0x100, boxes.out[0].id);
    TEST_ASSERT_EQUAL_UINT8(2, boxes.out[0].data[0]);
    TEST_ASSERT_EQUAL_HEX32(0x101, boxes.out[1].id);
}

static void a_trace_frame_gives_up_its_mailbox_and_is_sent_later(void)
{
    trace(1, LATE);
    trace(2, LATE);
    canopy_tx_service(&tx, 0);
    post(5, 1, LATE);
    canopy_tx_service(&tx, 0);
    TEST_ASSERT_EQUAL_UINT(1, boxes.aborts);
    let_all_out(0);
    TEST_ASSERT_EQUAL_UINT(3, boxes.out_count);
    TEST_ASSERT_EQUAL_HEX32(0x105, boxes.out[0].id);
    TEST_ASSERT_EQUAL_UINT8(1, boxes.out[1].data[0]);
    TEST_ASSERT_EQUAL_UINT8(2, boxes.out[2].data[0]);
    TEST_ASSERT_EQUAL_UINT32(2, counted().trace_sent);
}

static void a_frame_that_is_as_urgent_or_more_keeps_its_mailbox(void)
{
    trace(1, LATE);
    canopy_tx_service(&tx, 0);
    trace(2, LATE);
    canopy_tx_service(&tx, 0);
    let_all_out(0);
    post(0, 1, LATE);
    canopy_tx_service(&tx, 0);
    post(1, 1, LATE);
    canopy_tx_service(&tx, 0);
    trace(3, LATE);
    canopy_tx_service(&tx, 0);
    TEST_ASSERT_EQUAL_UINT(0, boxes.aborts);
}

static void without_abort_urgent_frames_have_to_wait(void)
{
    can.abort = NULL;
    trace(1, LATE);
    canopy_tx_service(&tx, 0);
    post(0, 1, LATE);
    canopy_tx_service(&tx, 0);
    TEST_ASSERT_EQUAL_UINT(1, boxes.offered);
    TEST_ASSERT_TRUE(canopy_tx_is_busy(&tx));
    let_all_out(0);
    TEST_ASSERT_EQUAL_HEX32(TRACE_ID, boxes.out[0].id);
    TEST_ASSERT_EQUAL_HEX32(0x100, boxes.out[1].id);
}

static void while_a_mailbox_is_taken_back_nothing_goes_past_the_urgent_frame(void)
{
    start(2);
    boxes.aborted_is = CANOPY_CAN_PENDING;
    post(4, 1, LATE);
    post(5, 1, LATE);
    canopy_tx_service(&tx, 0);
    post(0, 1, LATE);
    post(1, 1, LATE);
    canopy_tx_service(&tx, 0);
    TEST_ASSERT_EQUAL_UINT(1, boxes.aborts);
    canopy_tx_service(&tx, 0);
    TEST_ASSERT_EQUAL_UINT(1, boxes.aborts);
    boxes.outcome[1] = CANOPY_CAN_ABORTED;
    canopy_tx_service(&tx, 0);
    TEST_ASSERT_EQUAL_HEX32(0x100, boxes.box[1].id);
    TEST_ASSERT_EQUAL_UINT(2, boxes.aborts); /* and now the other, for the second */
}

/* --- trace ---------------------------------------------------------------------------------------------------------- */

static void a_full_ring_drops_the_newest(void)
{
    boxes.result = 0;
    for (uint8_t frame = 1; frame <= 7u; frame++) {
        trace(frame, LATE);
        canopy_tx_service(&tx, 0);
    }
    TEST_ASSERT_EQUAL_UINT32(3, counted().trace_dropped);
    boxes.result = 1;
    canopy_tx_service(&tx, 0);
    let_all_out(0);
    TEST_ASSERT_EQUAL_UINT(4, boxes.out_count);
    TEST_ASSERT_EQUAL_UINT8(4, boxes.out[3].data[0]);
    trace(8, LATE);
    canopy_tx_service(&tx, 0);
    let_all_out(0);
    TEST_ASSERT_EQUAL_UINT8(8, boxes.out[4].data[0]);
    TEST_ASSERT_EQUAL_UINT32(5, counted().trace_sent);
}

static void only_one_trace_frame_is_in_flight(void)
{
    start(3);
    trace(1, LATE);
    trace(2, LATE);
    canopy_tx_service(&tx, 0);
    TEST_ASSERT_EQUAL_UINT(1, boxes.offered);
    canopy_tx_service(&tx, 0);
    TEST_ASSERT_EQUAL_UINT(1, boxes.offered);
}

static void late_trace_frames_are_dropped_whether_they_wait_or_fly(void)
{
    trace(1, 100);
    trace(2, 100);
    trace(3, 200);
    canopy_tx_service(&tx, 0); /* the first flies */
    canopy_tx_service(&tx, 100);
    TEST_ASSERT_EQUAL_UINT32(2, counted().trace_dropped);
    let_all_out(100);
    TEST_ASSERT_EQUAL_UINT(1, boxes.out_count);
    TEST_ASSERT_EQUAL_UINT8(3, boxes.out[0].data[0]);
    TEST_ASSERT_EQUAL_UINT32(1, counted().trace_sent);
}

static void the_trace_ring_may_wrap(void)
{
    tx.trace_head = UINT32_MAX - 1u;
    tx.trace_tail = UINT32_MAX - 1u;
    for (uint8_t frame = 1; frame <= 6u; frame++) {
        trace(frame, LATE);
    }
    TEST_ASSERT_EQUAL_UINT32(2, counted().trace_dropped);
    canopy_tx_service(&tx, 0);
    let_all_out(0);
    TEST_ASSERT_EQUAL_UINT(4, boxes.out_count);
    for (unsigned frame = 0; frame < 4u; frame++) {
        TEST_ASSERT_EQUAL_UINT8(frame + 1u, boxes.out[frame].data[0]);
    }
}

/* --- blocked -------------------------------------------------------------------------------------------------------- */

static void a_bus_that_lets_nothing_through_is_blocked_until_something_gets_out(void)
{
    post(0, 1, 100);
    canopy_tx_service(&tx, 0);
    canopy_tx_service(&tx, 99);
    TEST_ASSERT_FALSE(canopy_tx_is_blocked(&tx));
    canopy_tx_service(&tx, 100);
    TEST_ASSERT_TRUE(canopy_tx_is_blocked(&tx));
    post(0, 2, 200);
    canopy_tx_service(&tx, 110);
    TEST_ASSERT_TRUE(canopy_tx_is_blocked(&tx));
    boxes_let_out(0);
    canopy_tx_service(&tx, 120);
    TEST_ASSERT_FALSE(canopy_tx_is_blocked(&tx));
    canopy_tx_service(&tx, 5000); /* nothing waits: that is no block */
    TEST_ASSERT_FALSE(canopy_tx_is_blocked(&tx));
}

/* Newer values must not hide it: each replaces the one before just before its deadline. */
static void a_bus_is_blocked_however_often_the_frame_is_replaced(void)
{
    for (canopy_time_t tick = 0; tick < 3u; tick++) {
        post(0, (uint8_t)tick, 100u * tick + 101u);
        canopy_tx_service(&tx, 100u * tick);
    }
    TEST_ASSERT_EQUAL_UINT32(2, counted().replaced);
    TEST_ASSERT_EQUAL_UINT32(0, counted().expired);
    TEST_ASSERT_TRUE(canopy_tx_is_blocked(&tx));
}

/* As a socket whose queue is full: nothing is ever in a mailbox. */
static void a_driver_that_takes_nothing_is_a_blocked_bus_too(void)
{
    boxes.result = 0;
    for (canopy_time_t tick = 0; tick < 3u; tick++) {
        TEST_ASSERT_FALSE(canopy_tx_is_blocked(&tx));
        post(0, (uint8_t)tick, 100u * tick + 150u);
        canopy_tx_service(&tx, 100u * tick);
    }
    canopy_tx_service(&tx, 210);
    TEST_ASSERT_TRUE(canopy_tx_is_blocked(&tx));
    boxes.result = 1;
    canopy_tx_service(&tx, 220);
    TEST_ASSERT_TRUE(canopy_tx_is_blocked(&tx)); /* taken is not out */
    let_all_out(220);
    TEST_ASSERT_FALSE(canopy_tx_is_blocked(&tx));
}

static void a_frame_that_only_loses_to_more_urgent_ones_does_not_make_it_a_blocked_bus(void)
{
    start(2);
    post(5, 1, 100);
    canopy_tx_service(&tx, 0);
    for (unsigned now = 10; now < 100u; now += 10u) {
        post(0, 1, now + 100u);
        canopy_tx_service(&tx, now);
        boxes_let_out(1);
        canopy_tx_service(&tx, now);
    }
    canopy_tx_service(&tx, 100);
    TEST_ASSERT_EQUAL_UINT32(1, counted().expired);
    TEST_ASSERT_FALSE(canopy_tx_is_blocked(&tx));
}

static void of_several_frames_the_first_deadline_counts(void)
{
    start(3);
    trace(1, 400);
    post(1, 1, 300);
    canopy_tx_service(&tx, 0);
    post(0, 1, 200);
    canopy_tx_service(&tx, 0);
    post(2, 1, 500);
    canopy_tx_service(&tx, 0);
    canopy_tx_service(&tx, 199);
    TEST_ASSERT_FALSE(canopy_tx_is_blocked(&tx));
    canopy_tx_service(&tx, 200);
    TEST_ASSERT_TRUE(canopy_tx_is_blocked(&tx));
}

static void a_trace_that_is_stopped_leaves_no_more(void)
{
    for (uint8_t frame = 0; frame < 3u; frame++) {
        trace(frame, LATE);
    }
    canopy_tx_service(&tx, 0); /* one is in the mailbox */
    canopy_tx_stop_trace(&tx);
    canopy_tx_service(&tx, 10);
    TEST_ASSERT_EQUAL_UINT(1, boxes.aborts);
    TEST_ASSERT_FALSE(canopy_tx_is_busy(&tx));
    TEST_ASSERT_EQUAL_UINT32(3, counted().trace_dropped);
    canopy_tx_resume_trace(&tx);
    trace(7, LATE);
    canopy_tx_service(&tx, 20);
    let_all_out(20);
    TEST_ASSERT_EQUAL_UINT(1, boxes.out_count);
    TEST_ASSERT_EQUAL_UINT8(7, boxes.out[0].data[0]);
}

static void what_cannot_be_taken_back_is_the_last_of_a_trace_that_is_stopped(void)
{
    can.abort = NULL;
    trace(1, LATE);
    trace(2, LATE);
    canopy_tx_service(&tx, 0);
    canopy_tx_stop_trace(&tx);
    post(0, 3, LATE);
    canopy_tx_service(&tx, 10);
    TEST_ASSERT_EQUAL_UINT32(0, counted().trace_dropped);
    let_all_out(20);
    TEST_ASSERT_EQUAL_UINT(2, boxes.out_count); /* and the command */
    TEST_ASSERT_EQUAL_UINT32(1, counted().trace_sent);
    TEST_ASSERT_EQUAL_UINT32(1, counted().trace_dropped);
}

/* The transmit interrupt goes on when the loop hangs: it knows each frame's deadline by itself. */
static void when_the_loop_hangs_only_what_was_in_mailboxes_may_leave(bool can_abort, unsigned leave)
{
    can.abort = can_abort ? boxes_abort : NULL;
    start(3);
    for (uint16_t message = 0; message < (uint16_t)MESSAGES; message++) {
        post(message, 1, 100);
    }
    canopy_tx_service(&tx, 0);
    let_all_out(5000); /* the bus was blocked up to now: the first frame is out, and its interrupt comes */
    TEST_ASSERT_EQUAL_UINT(leave, boxes.out_count);
    TEST_ASSERT_EQUAL_UINT32(leave, counted().sent);
    TEST_ASSERT_EQUAL_UINT32(MESSAGES - leave, counted().expired);
}

static void when_the_loop_hangs_the_interrupt_takes_back_what_is_late(void)
{
    when_the_loop_hangs_only_what_was_in_mailboxes_may_leave(true, 1);
}

static void when_the_loop_hangs_and_nothing_can_be_taken_back_the_mailboxes_leave(void)
{
    when_the_loop_hangs_only_what_was_in_mailboxes_may_leave(false, 3);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_number_of_mailboxes_that_are_used_is_bounded);
    RUN_TEST(messages_leave_in_the_order_of_their_urgency);
    RUN_TEST(a_less_urgent_frame_gives_up_its_mailbox);
    RUN_TEST(a_message_that_the_loop_is_just_writing_waits_for_the_next_service);
    RUN_TEST(a_trace_frame_gives_up_its_mailbox_and_is_sent_later);
    RUN_TEST(a_frame_that_is_as_urgent_or_more_keeps_its_mailbox);
    RUN_TEST(without_abort_urgent_frames_have_to_wait);
    RUN_TEST(while_a_mailbox_is_taken_back_nothing_goes_past_the_urgent_frame);
    RUN_TEST(a_full_ring_drops_the_newest);
    RUN_TEST(only_one_trace_frame_is_in_flight);
    RUN_TEST(late_trace_frames_are_dropped_whether_they_wait_or_fly);
    RUN_TEST(the_trace_ring_may_wrap);
    RUN_TEST(a_bus_that_lets_nothing_through_is_blocked_until_something_gets_out);
    RUN_TEST(a_bus_is_blocked_however_often_the_frame_is_replaced);
    RUN_TEST(a_driver_that_takes_nothing_is_a_blocked_bus_too);
    RUN_TEST(a_frame_that_only_loses_to_more_urgent_ones_does_not_make_it_a_blocked_bus);
    RUN_TEST(of_several_frames_the_first_deadline_counts);
    RUN_TEST(a_trace_that_is_stopped_leaves_no_more);
    RUN_TEST(what_cannot_be_taken_back_is_the_last_of_a_trace_that_is_stopped);
    RUN_TEST(when_the_loop_hangs_the_interrupt_takes_back_what_is_late);
    RUN_TEST(when_the_loop_hangs_and_nothing_can_be_taken_back_the_mailboxes_leave);
    return UNITY_END();
}
