/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The transmit side with one mailbox: the newest value leaves and nothing old, the receiver sees no gap, and every frame
 * that was posted ends exactly once.
 */
#include <string.h>

#include "canopy/count.h"
#include "canopy/e2e.h"
#include "canopy/tx.h"
#include "fake_mailboxes.h"
#include "unity.h"

enum { URGENT = 0, PLAIN = 1, MESSAGES = 2, TRACE_PLACES = 4, DATA_ID = 7, LATE = 1000000 };

typedef struct {
    uint8_t urgent;
    uint8_t plain;
} output_t;

static output_t output;

static void encode_urgent(const void *image, uint8_t *data)
{
    data[0] = 0;
    data[1] = 0;
    data[2] = ((const output_t *)image)->urgent;
}

static void encode_plain(const void *image, uint8_t *data)
{
    data[0] = ((const output_t *)image)->plain;
}

static const canopy_tx_message_t messages[MESSAGES] = {
    {.id = 0x100, .length = 3, .data_id = DATA_ID, .every = 1, .place = 0, .encode = encode_urgent},
    {.id = 0x200,
     .flags = CANOPY_CAN_EXTENDED,
     .length = 1,
     .data_id = CANOPY_E2E_NONE,
     .every = 1,
     .place = 6,
     .encode = encode_plain},
};
static canopy_tx_slot_t slots[MESSAGES];
static uint8_t data[8];
static canopy_tx_trace_t places[TRACE_PLACES];
static const canopy_tx_memory_t memory = {
    .slots = slots, .data = data, .trace = places, .trace_capacity = TRACE_PLACES};
static canopy_can_t can;
static canopy_tx_t tx;
static unsigned posted;

static void start(void)
{
    posted = 0;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_tx_init(&tx, messages, MESSAGES, &memory, &can));
}

void setUp(void)
{
    boxes_reset();
    can = (canopy_can_t){
        .receive = boxes_receive, .send = boxes_send, .outcome = boxes_outcome, .abort = boxes_abort, .mailboxes = 1};
    start();
}

void tearDown(void)
{
}

static void post(uint16_t message, uint8_t value, canopy_time_t until)
{
    output = (output_t){.urgent = value, .plain = value};
    canopy_tx_post(&tx, message, &output, until);
    posted++;
}

static void trace(uint8_t value, canopy_time_t until)
{
    canopy_tx_trace(&tx, 0x600, CANOPY_CAN_EXTENDED, &(canopy_tx_trace_data_t){{value}}, until);
}

static canopy_tx_counters_t counted(void)
{
    canopy_tx_counters_t counters;

    canopy_tx_count(&tx, &counters);
    return counters;
}

/** When nothing waits any more. */
static void every_frame_has_ended_once(void)
{
    canopy_tx_counters_t counters = counted();

    TEST_ASSERT_EQUAL_UINT32(posted, counters.sent + counters.replaced + counters.expired);
}

static uint8_t last_value(void)
{
    const canopy_can_frame_t *frame = &boxes.out[boxes.out_count - 1u];

    TEST_ASSERT_GREATER_THAN_UINT(0, boxes.out_count);
    return frame->data[frame->id == 0x100u ? 2u : 0u];
}

static void init_refuses_what_is_missing(void)
{
    canopy_tx_memory_t wrong = memory;

    wrong.slots = NULL;
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_tx_init(&tx, messages, MESSAGES, &wrong, &can));
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_tx_init(&tx, messages, 0, &wrong, &can));
    wrong = memory;
    wrong.data = NULL;
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_tx_init(&tx, messages, MESSAGES, &wrong, &can));
    wrong = memory;
    wrong.trace = NULL;
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_tx_init(&tx, messages, MESSAGES, &wrong, &can));
    wrong = memory;
    wrong.trace_capacity = 0;
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_tx_init(&tx, messages, MESSAGES, &wrong, &can));
    wrong.trace_capacity = 3;
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_tx_init(&tx, messages, MESSAGES, &wrong, &can));
    wrong.trace_capacity = 1;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_tx_init(&tx, messages, MESSAGES, &wrong, &can));
}

static void a_frame_goes_out_as_the_table_says(void)
{
    const canopy_can_frame_t *frame = &boxes.box[0];

    TEST_ASSERT_TRUE(canopy_tx_is_out(&tx)); /* nothing was ever posted */
    post(PLAIN, 42, 100);
    TEST_ASSERT_FALSE(canopy_tx_is_out(&tx));
    TEST_ASSERT_FALSE(canopy_tx_is_busy(&tx));
    canopy_tx_service(&tx, 30);
    TEST_ASSERT_EQUAL_HEX32(0x200, frame->id);
    TEST_ASSERT_EQUAL_HEX8(CANOPY_CAN_EXTENDED, frame->flags);
    TEST_ASSERT_EQUAL_UINT8(1, frame->length);
    TEST_ASSERT_EQUAL_UINT8(42, frame->data[0]);
    TEST_ASSERT_EQUAL_UINT64(30, frame->time);
    TEST_ASSERT_TRUE(canopy_tx_is_busy(&tx));
    TEST_ASSERT_FALSE(canopy_tx_is_out(&tx)); /* taken is not out */
    boxes_let_out(0);
    canopy_tx_service(&tx, 40);
    TEST_ASSERT_FALSE(canopy_tx_is_busy(&tx));
    TEST_ASSERT_TRUE(canopy_tx_is_out(&tx));
    every_frame_has_ended_once();
}

static void a_newer_value_takes_the_place_of_one_that_waits(void)
{
    post(URGENT, 1, LATE); /* goes to the mailbox */
    canopy_tx_service(&tx, 0);
    for (uint8_t value = 2; value <= 9u; value++) {
        post(PLAIN, value, LATE);
        canopy_tx_service(&tx, 0);
    }
    boxes_let_out(0);
    canopy_tx_service(&tx, 0);
    boxes_let_out(0);
    canopy_tx_service(&tx, 0);
    TEST_ASSERT_EQUAL_UINT(2, boxes.out_count);
    TEST_ASSERT_EQUAL_UINT8(9, last_value());
    TEST_ASSERT_EQUAL_UINT32(7, counted().replaced);
    every_frame_has_ended_once();
}

static void a_newer_value_takes_back_one_that_is_in_a_mailbox(void)
{
    post(URGENT, 1, LATE);
    canopy_tx_service(&tx, 0);
    post(URGENT, 2, LATE);
    canopy_tx_service(&tx, 0);
    TEST_ASSERT_EQUAL_UINT(1, boxes.aborts);
    boxes_let_out(0);
    canopy_tx_service(&tx, 0);
    TEST_ASSERT_EQUAL_UINT(1, boxes.out_count);
    TEST_ASSERT_EQUAL_UINT8(2, last_value());
    TEST_ASSERT_EQUAL_UINT32(1, counted().replaced);
    TEST_ASSERT_EQUAL_UINT32(1, counted().sent);
    every_frame_has_ended_once();
}

static void a_frame_that_cannot_be_taken_back_any_more_goes_out_before_the_newer_one(void)
{
    boxes.aborted_is = CANOPY_CAN_SENT; /* it was on the wire */
    post(URGENT, 1, LATE);
    canopy_tx_service(&tx, 0);
    post(URGENT, 2, LATE);
    canopy_tx_service(&tx, 0);
    boxes_let_out(0);
    canopy_tx_service(&tx, 0);
    TEST_ASSERT_EQUAL_UINT(2, boxes.out_count);
    TEST_ASSERT_EQUAL_UINT8(2, last_value());
    TEST_ASSERT_EQUAL_UINT32(2, counted().sent);
    every_frame_has_ended_once();
}

static void taking_back_may_take_a_while(void)
{
    boxes.aborted_is = CANOPY_CAN_PENDING;
    post(URGENT, 1, LATE);
    canopy_tx_service(&tx, 0);
    post(URGENT, 2, LATE);
    canopy_tx_service(&tx, 0);
    canopy_tx_service(&tx, 0); /* not asked again */
    TEST_ASSERT_EQUAL_UINT(1, boxes.aborts);
    boxes.outcome[0] = CANOPY_CAN_ABORTED;
    canopy_tx_service(&tx, 0);
    boxes_let_out(0);
    canopy_tx_service(&tx, 0);
    TEST_ASSERT_EQUAL_UINT8(2, last_value());
    every_frame_has_ended_once();
}

/* A receiver that has seen one frame accepts the first that leaves after so many that were replaced: that is what the
 * counter is put in for so late. */
static void the_receiver_sees_no_gap(unsigned replaced, bool can_abort)
{
    canopy_e2e_receiver_t receiver = {0};
    uint8_t value = 0;

    setUp();
    can.abort = can_abort ? boxes_abort : NULL;
    for (unsigned round = 0; round < 4u; round++) {
        for (unsigned frame = 0; frame <= replaced; frame++) {
            post(URGENT, ++value, LATE);
            if (can_abort) {
                canopy_tx_service(&tx, 0);
            }
        }
        canopy_tx_service(&tx, 0);
        boxes_let_out(0);
        canopy_tx_service(&tx, 0);
        TEST_ASSERT_EQUAL(CANOPY_E2E_OK, canopy_e2e_check(&receiver, DATA_ID, boxes.out[round].data, 3));
        TEST_ASSERT_EQUAL_UINT8(value, boxes.out[round].data[2]);
        TEST_ASSERT_EQUAL_UINT8(round, receiver.counter);
    }
    TEST_ASSERT_EQUAL_UINT32(4u * replaced, counted().replaced);
    every_frame_has_ended_once();
}

static void however_many_were_replaced_the_receiver_sees_no_gap(void)
{
    static const unsigned numbers[] = {0, 1, 3, 14, 15, 100};

    for (unsigned place = 0; place < sizeof numbers / sizeof numbers[0]; place++) {
        the_receiver_sees_no_gap(numbers[place], true);
        the_receiver_sees_no_gap(numbers[place], false);
    }
}

static void expired_frames_use_up_no_number_either(void)
{
    canopy_e2e_receiver_t receiver = {0};

    for (canopy_time_t round = 0; round < 40u; round++) {
        post(URGENT, (uint8_t)round, round * 10u + 5u);
        canopy_tx_service(&tx, round * 10u);
        if (round % 9u == 0u) {
            boxes_let_out(0);
        }
        canopy_tx_service(&tx, round * 10u + 5u);
    }
    TEST_ASSERT_EQUAL_UINT(5, boxes.out_count);
    for (unsigned frame = 0; frame < boxes.out_count; frame++) {
        TEST_ASSERT_EQUAL(CANOPY_E2E_OK, canopy_e2e_check(&receiver, DATA_ID, boxes.out[frame].data, 3));
        TEST_ASSERT_EQUAL_UINT8(frame, receiver.counter);
    }
    TEST_ASSERT_EQUAL_UINT32(35, counted().expired);
    every_frame_has_ended_once();
}

static void what_is_past_its_deadline_is_taken_back(void)
{
    post(URGENT, 1, 100);
    canopy_tx_service(&tx, 0);
    canopy_tx_service(&tx, 99);
    TEST_ASSERT_EQUAL_UINT(0, boxes.aborts);
    canopy_tx_service(&tx, 100);
    TEST_ASSERT_EQUAL_UINT(1, boxes.aborts);
    TEST_ASSERT_EQUAL_UINT32(1, counted().expired);
    TEST_ASSERT_FALSE(canopy_tx_is_busy(&tx));
    TEST_ASSERT_FALSE(canopy_tx_is_out(&tx));
    every_frame_has_ended_once();
}

static void what_waits_past_its_deadline_is_dropped(void)
{
    boxes.result = 0;
    post(URGENT, 1, 100);
    canopy_tx_service(&tx, 99);
    TEST_ASSERT_TRUE(canopy_tx_is_busy(&tx)); /* to be offered again */
    boxes.result = 1;
    canopy_tx_service(&tx, 100);
    TEST_ASSERT_EQUAL_UINT(1, boxes.offered);
    TEST_ASSERT_EQUAL_UINT32(1, counted().expired);
    every_frame_has_ended_once();
}

static void without_abort_a_late_frame_stays_and_the_newer_one_waits(void)
{
    can.abort = NULL;
    post(URGENT, 1, 100);
    canopy_tx_service(&tx, 0);
    post(URGENT, 2, 200);
    canopy_tx_service(&tx, 150);
    TEST_ASSERT_EQUAL_UINT(1, boxes.offered);
    boxes_let_out(0);
    canopy_tx_service(&tx, 160);
    TEST_ASSERT_EQUAL_UINT(2, boxes.offered);
    boxes_let_out(0);
    canopy_tx_service(&tx, 170);
    TEST_ASSERT_EQUAL_UINT32(2, counted().sent); /* it was late, but it was sent: nothing else is said of it */
    every_frame_has_ended_once();
}

static void deadlines_are_right_across_the_wrap_of_time(void)
{
    post(URGENT, 1, 50);
    canopy_tx_service(&tx, UINT64_MAX - 50u);
    TEST_ASSERT_EQUAL_UINT(1, boxes.offered);
    canopy_tx_service(&tx, 49);
    TEST_ASSERT_EQUAL_UINT(0, boxes.aborts);
    canopy_tx_service(&tx, 50);
    TEST_ASSERT_EQUAL_UINT(1, boxes.aborts);
}

/* The hardware may drop a frame unasked, at a bus-off for example: it waits again, until its deadline. */
static void a_frame_that_came_back_is_offered_again(void)
{
    post(URGENT, 1, 100);
    canopy_tx_service(&tx, 0);
    boxes.outcome[0] = CANOPY_CAN_ABORTED;
    canopy_tx_service(&tx, 10);
    TEST_ASSERT_EQUAL_UINT(2, boxes.offered);
    boxes.outcome[0] = CANOPY_CAN_ABORTED;
    canopy_tx_service(&tx, 100);
    TEST_ASSERT_EQUAL_UINT(2, boxes.offered);
    TEST_ASSERT_EQUAL_UINT32(1, counted().expired);
    every_frame_has_ended_once();
}

static void a_frame_that_comes_back_at_once_waits_for_the_next_service(void)
{
    boxes.taken_is = CANOPY_CAN_ABORTED;
    post(URGENT, 1, 100);
    trace(1, 100);
    canopy_tx_service(&tx, 0); /* and comes to its end */
    TEST_ASSERT_EQUAL_UINT(1, boxes.offered);
    TEST_ASSERT_TRUE(canopy_tx_is_busy(&tx));
    boxes.taken_is = CANOPY_CAN_SENT;
    canopy_tx_service(&tx, 10);
    TEST_ASSERT_EQUAL_UINT(2, boxes.out_count);
    every_frame_has_ended_once();
    boxes.taken_is = CANOPY_CAN_ABORTED;
    trace(2, 100);
    canopy_tx_service(&tx, 20);
    TEST_ASSERT_EQUAL_UINT(4, boxes.offered);
    TEST_ASSERT_TRUE(canopy_tx_is_busy(&tx));
    TEST_ASSERT_EQUAL_UINT32(0, counted().trace_dropped);
}

static void a_newer_value_that_is_posted_while_one_comes_back_replaces_it(void)
{
    post(URGENT, 1, 100);
    canopy_tx_service(&tx, 0);
    post(URGENT, 2, 100);
    boxes.outcome[0] = CANOPY_CAN_ABORTED;
    canopy_tx_service(&tx, 10);
    boxes_let_out(0);
    canopy_tx_service(&tx, 20);
    TEST_ASSERT_EQUAL_UINT8(2, last_value());
    TEST_ASSERT_EQUAL_UINT32(1, counted().replaced);
    every_frame_has_ended_once();
}

static void the_counter_of_a_frame_that_came_back_is_used_again(void)
{
    canopy_e2e_receiver_t receiver = {0};

    for (unsigned frame = 0; frame < 20u; frame++) {
        post(URGENT, (uint8_t)frame, LATE);
        canopy_tx_service(&tx, 0);
        boxes.outcome[0] = CANOPY_CAN_ABORTED;
        canopy_tx_service(&tx, 0);
        boxes_let_out(0);
        canopy_tx_service(&tx, 0);
        TEST_ASSERT_EQUAL(CANOPY_E2E_OK, canopy_e2e_check(&receiver, DATA_ID, boxes.out[frame].data, 3));
        TEST_ASSERT_EQUAL_UINT8(frame % CANOPY_E2E_COUNTERS, receiver.counter);
    }
}

static void an_error_of_the_driver_keeps_the_frame_until_its_deadline(void)
{
    boxes.result = CANOPY_ERROR_BUS_DOWN;
    post(URGENT, 1, 100);
    post(PLAIN, 1, 100);
    trace(1, 100);
    canopy_tx_service(&tx, 0);
    TEST_ASSERT_EQUAL_UINT(1, boxes.offered);  /* the others would fare no better */
    TEST_ASSERT_FALSE(canopy_tx_is_busy(&tx)); /* nor would it help to ask again soon */
    boxes.result = 1;
    boxes.taken_is = CANOPY_CAN_SENT;
    canopy_tx_service(&tx, 50);
    TEST_ASSERT_EQUAL_UINT(3, boxes.out_count);
    every_frame_has_ended_once();
}

static void versions_may_wrap(void)
{
    const uint32_t last = UINT32_MAX >> 2;

    slots[URGENT].posted = last - 2u; /* as after 2^30 - 3 frames, all of them out */
    slots[URGENT].taken = last - 2u;
    boxes.taken_is = CANOPY_CAN_SENT;
    for (uint8_t value = 0; value < 6u; value++) {
        post(URGENT, value, LATE);
        TEST_ASSERT_FALSE(canopy_tx_is_out(&tx));
        canopy_tx_service(&tx, 0);
        TEST_ASSERT_TRUE(canopy_tx_is_out(&tx));
        TEST_ASSERT_EQUAL_UINT8(value, last_value());
    }
    TEST_ASSERT_EQUAL_UINT32(3, slots[URGENT].posted);
    every_frame_has_ended_once();
    slots[URGENT].posted = last - 1u;
    slots[URGENT].taken = last - 1u;
    for (uint8_t value = 0; value < 4u; value++) {
        post(URGENT, value, LATE); /* three of them replaced, across the wrap */
    }
    canopy_tx_service(&tx, 0);
    TEST_ASSERT_EQUAL_UINT32(3, counted().replaced);
    every_frame_has_ended_once();
}

static void a_frame_may_come_back_at_the_wrap_of_versions(void)
{
    slots[URGENT].posted = UINT32_MAX >> 2;
    slots[URGENT].taken = UINT32_MAX >> 2;
    post(URGENT, 1, LATE); /* version 0 */
    canopy_tx_service(&tx, 0);
    boxes.outcome[0] = CANOPY_CAN_ABORTED;
    canopy_tx_service(&tx, 0);
    boxes_let_out(0);
    canopy_tx_service(&tx, 0);
    TEST_ASSERT_TRUE(canopy_tx_is_out(&tx));
    every_frame_has_ended_once();
}

static void what_is_owed_is_a_value_that_was_posted_since(void)
{
    TEST_ASSERT_FALSE(canopy_tx_owes(&tx, URGENT));
    post(URGENT, 1, LATE);
    canopy_tx_service(&tx, 0);
    canopy_tx_owe(&tx);
    TEST_ASSERT_TRUE(canopy_tx_owes(&tx, URGENT));
    TEST_ASSERT_TRUE(canopy_tx_owes(&tx, PLAIN));
    boxes.aborted_is = CANOPY_CAN_SENT; /* the old one was on the wire */
    post(URGENT, 2, LATE);
    canopy_tx_service(&tx, 0);
    TEST_ASSERT_EQUAL_UINT(1, boxes.out_count);
    TEST_ASSERT_TRUE(canopy_tx_owes(&tx, URGENT));
    boxes_let_out(0);
    post(URGENT, 3, LATE); /* it need not be the newest */
    canopy_tx_service(&tx, 0);
    TEST_ASSERT_FALSE(canopy_tx_owes(&tx, URGENT));
    TEST_ASSERT_TRUE(canopy_tx_owes(&tx, PLAIN));
    for (unsigned frame = 0; frame < 5u; frame++) {
        post(URGENT, 4, LATE);
    }
    TEST_ASSERT_FALSE(canopy_tx_owes(&tx, URGENT)); /* once paid, whatever is posted later */
}

static void what_is_owed_may_get_out_across_the_wrap_of_versions(void)
{
    slots[URGENT].posted = UINT32_MAX >> 2;
    slots[URGENT].taken = UINT32_MAX >> 2;
    slots[URGENT].out = UINT32_MAX >> 2;
    canopy_tx_owe(&tx);
    TEST_ASSERT_TRUE(canopy_tx_owes(&tx, URGENT));
    post(URGENT, 1, LATE); /* version 0 */
    TEST_ASSERT_TRUE(canopy_tx_owes(&tx, URGENT));
    canopy_tx_service(&tx, 0);
    boxes_let_out(0);
    canopy_tx_service(&tx, 0);
    TEST_ASSERT_FALSE(canopy_tx_owes(&tx, URGENT));
}

static void what_is_held_back_counts_as_replaced(void)
{
    canopy_tx_hold(&tx);
    TEST_ASSERT_EQUAL_UINT32(1, counted().replaced);
    TEST_ASSERT_EQUAL_UINT32(0, counted().expired);
    tx.held = UINT32_MAX;
    tx.replaced = 1;
    canopy_tx_hold(&tx);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, counted().replaced);
}

static void counters_stay_at_their_largest_value(void)
{
    boxes.taken_is = CANOPY_CAN_SENT;
    tx.sent = UINT32_MAX;
    tx.trace_full = UINT32_MAX;
    tx.trace_late = 1;
    post(URGENT, 1, LATE);
    canopy_tx_service(&tx, 0);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, counted().sent);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, counted().trace_dropped);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, canopy_sum(1, UINT32_MAX));
}

static void kick_serves_or_lets_the_transmit_context_serve(void)
{
    post(URGENT, 1, LATE);
    canopy_tx_kick(&tx, 0);
    TEST_ASSERT_EQUAL_UINT(1, boxes.offered);
    setUp();
    can.request = boxes_request;
    post(URGENT, 1, LATE);
    canopy_tx_kick(&tx, 0);
    TEST_ASSERT_EQUAL_UINT(0, boxes.offered);
    TEST_ASSERT_EQUAL_UINT(1, boxes.requests);
}

static int memory_send(void *context, uint8_t mailbox, const canopy_can_frame_t *frame)
{
    (void)context;
    TEST_ASSERT_EQUAL_UINT8(0, mailbox);
    boxes_note_out(frame);
    return 1;
}

static void a_bus_in_memory_needs_no_mailbox(void)
{
    can.send = memory_send;
    can.outcome = NULL;
    can.mailboxes = 3; /* not used */
    start();
    post(URGENT, 1, LATE);
    post(PLAIN, 2, LATE);
    trace(3, LATE);
    canopy_tx_service(&tx, 0);
    TEST_ASSERT_EQUAL_UINT(3, boxes.out_count);
    TEST_ASSERT_TRUE(canopy_tx_is_out(&tx));
    TEST_ASSERT_FALSE(canopy_tx_is_busy(&tx));
    TEST_ASSERT_EQUAL_UINT32(1, counted().trace_sent);
    every_frame_has_ended_once();
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(init_refuses_what_is_missing);
    RUN_TEST(a_frame_goes_out_as_the_table_says);
    RUN_TEST(a_newer_value_takes_the_place_of_one_that_waits);
    RUN_TEST(a_newer_value_takes_back_one_that_is_in_a_mailbox);
    RUN_TEST(a_frame_that_cannot_be_taken_back_any_more_goes_out_before_the_newer_one);
    RUN_TEST(taking_back_may_take_a_while);
    RUN_TEST(however_many_were_replaced_the_receiver_sees_no_gap);
    RUN_TEST(expired_frames_use_up_no_number_either);
    RUN_TEST(what_is_past_its_deadline_is_taken_back);
    RUN_TEST(what_waits_past_its_deadline_is_dropped);
    RUN_TEST(without_abort_a_late_frame_stays_and_the_newer_one_waits);
    RUN_TEST(deadlines_are_right_across_the_wrap_of_time);
    RUN_TEST(a_frame_that_came_back_is_offered_again);
    RUN_TEST(a_frame_that_comes_back_at_once_waits_for_the_next_service);
    RUN_TEST(a_newer_value_that_is_posted_while_one_comes_back_replaces_it);
    RUN_TEST(the_counter_of_a_frame_that_came_back_is_used_again);
    RUN_TEST(an_error_of_the_driver_keeps_the_frame_until_its_deadline);
    RUN_TEST(versions_may_wrap);
    RUN_TEST(a_frame_may_come_back_at_the_wrap_of_versions);
    RUN_TEST(what_is_owed_is_a_value_that_was_posted_since);
    RUN_TEST(what_is_owed_may_get_out_across_the_wrap_of_versions);
    RUN_TEST(what_is_held_back_counts_as_replaced);
    RUN_TEST(counters_stay_at_their_largest_value);
    RUN_TEST(kick_serves_or_lets_the_transmit_context_serve);
    RUN_TEST(a_bus_in_memory_needs_no_mailbox);
    return UNITY_END();
}
