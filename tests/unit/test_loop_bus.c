/* SPDX-License-Identifier: MIT */
/**
 * @file
 * What the loop makes of a bus that floods it, loses frames, fails and comes back: what leaves see, what the fault hook
 * is told, and what leaves first.
 */
#include <string.h>

#include "fake_can.h"
#include "fake_mailboxes.h"
#include "small_app.h"
#include "still_clock.h"
#include "unity.h"

enum { FAULTS = CANOPY_FAULT_TX_REPLACED + 1 };

/* In the documents and in logs of the field. */
_Static_assert(CANOPY_FAULT_LEAF_STATUS == 1 && CANOPY_FAULT_OVERRUN == 2 && CANOPY_FAULT_CAN_RECEIVE == 3 &&
                   CANOPY_FAULT_RX_BACKLOG == 4 && CANOPY_FAULT_RX_LOST == 5 && CANOPY_FAULT_CAN_STATE == 6 &&
                   CANOPY_FAULT_TX_EXPIRED == 7 && CANOPY_FAULT_TX_REPLACED == 8,
               "numbers of faults are stable");

static small_memory_t memory;
static canopy_app_t app;
static canopy_can_t can;
static unsigned faults[FAULTS];
static uint32_t details[FAULTS];
static canopy_loop_config_t config;
static canopy_loop_t loop;

static void on_fault(void *context, canopy_fault_t fault, uint32_t detail)
{
    (void)context;
    faults[fault]++;
    details[fault] = detail;
}

static void start(const canopy_can_t *driver)
{
    can = *driver;
    app = small_app(&memory);
    config = (canopy_loop_config_t){.app = &app, .can = &can, .clock = &still_clock, .on_fault = on_fault};
    clock_now = 0;
    memset(faults, 0, sizeof faults);
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&loop, &config));
}

void setUp(void)
{
    fake_can_reset();
    start(&fake_can);
}

void tearDown(void)
{
}

static void use_mailboxes(void)
{
    static const canopy_can_t boxes_can = {
        .receive = boxes_receive, .send = boxes_send, .outcome = boxes_outcome, .abort = boxes_abort, .mailboxes = 1};

    boxes_reset();
    start(&boxes_can);
}

/** One period later, a cycle with so many more frames that have just arrived. */
static void cycle(unsigned frames)
{
    clock_now += PERIOD_US;
    for (unsigned frame = 0; frame < frames; frame++) {
        fake.rx[fake.rx_count++] = (canopy_can_frame_t){.time = clock_now, .id = RX_ID + frame % RX, .length = 1};
    }
    (void)canopy_loop_cycle(&loop, clock_now);
}

/* --- too much, or lost ---------------------------------------------------------------------------------------------- */

static void a_backlog_that_lasts_is_overload(void)
{
    cycle(3 * RX_MAX);
    TEST_ASSERT_FALSE(seen.overload); /* a burst */
    TEST_ASSERT_EQUAL_UINT(0, faults[CANOPY_FAULT_RX_BACKLOG]);
    cycle(0);
    TEST_ASSERT_TRUE(seen.overload);
    TEST_ASSERT_EQUAL_UINT(1, faults[CANOPY_FAULT_RX_BACKLOG]);
    TEST_ASSERT_EQUAL_UINT32(2, details[CANOPY_FAULT_RX_BACKLOG]);
    cycle(0);
    TEST_ASSERT_TRUE(seen.overload); /* exactly full: more may be there */
    TEST_ASSERT_EQUAL_UINT32(3, loop.rx_backlogs);
    cycle(0);
    TEST_ASSERT_FALSE(seen.overload);
    cycle(RX_MAX);
    TEST_ASSERT_FALSE(seen.overload); /* it counts from the start again */
    TEST_ASSERT_EQUAL_UINT(2, faults[CANOPY_FAULT_RX_BACKLOG]);
}

static void frames_that_the_driver_has_lost_are_overload_in_the_next_cycle(void)
{
    fake.rx_dropped = 3;
    cycle(0);
    TEST_ASSERT_TRUE(seen.overload);
    TEST_ASSERT_EQUAL_UINT(1, faults[CANOPY_FAULT_RX_LOST]);
    TEST_ASSERT_EQUAL_UINT32(3, details[CANOPY_FAULT_RX_LOST]);
    cycle(0);
    TEST_ASSERT_FALSE(seen.overload);
    fake.rx_dropped = 5;
    cycle(0);
    TEST_ASSERT_EQUAL_UINT32(2, details[CANOPY_FAULT_RX_LOST]);
    TEST_ASSERT_EQUAL_UINT32(5, loop.rx_lost);
    loop.rx_lost = UINT32_MAX - 1u; /* the driver's counter may wrap */
    fake.rx_dropped = 2;
    cycle(0);
    TEST_ASSERT_EQUAL_UINT32(4, details[CANOPY_FAULT_RX_LOST]);
}

static void a_driver_may_count_nothing(void)
{
    can.stats = NULL;
    fake.rx_dropped = 3;
    cycle(0);
    TEST_ASSERT_FALSE(seen.overload);
}

/* --- the state of the bus ------------------------------------------------------------------------------------------- */

static void leaves_and_fault_hook_are_told_the_state(void)
{
    cycle(0);
    TEST_ASSERT_EQUAL(CANOPY_CAN_ERROR_ACTIVE, seen.can_state);
    TEST_ASSERT_EQUAL_UINT(0, faults[CANOPY_FAULT_CAN_STATE]);
    fake.controller = CANOPY_CAN_CONTROLLER_PASSIVE;
    cycle(0);
    cycle(0);
    TEST_ASSERT_EQUAL(CANOPY_CAN_ERROR_PASSIVE, seen.can_state);
    TEST_ASSERT_EQUAL_UINT(1, faults[CANOPY_FAULT_CAN_STATE]);
    TEST_ASSERT_EQUAL_UINT32(CANOPY_CAN_ERROR_PASSIVE, details[CANOPY_FAULT_CAN_STATE]);
    fake.controller = CANOPY_CAN_CONTROLLER_ACTIVE;
    cycle(0);
    TEST_ASSERT_EQUAL_UINT(2, faults[CANOPY_FAULT_CAN_STATE]);
    TEST_ASSERT_EQUAL_UINT32(CANOPY_CAN_ERROR_ACTIVE, details[CANOPY_FAULT_CAN_STATE]);
}

static void a_failed_controller_is_restarted(void)
{
    fake.controller = CANOPY_CAN_CONTROLLER_BUS_OFF;
    for (unsigned tick = 0; tick < 51u; tick++) {
        cycle(0);
    }
    TEST_ASSERT_EQUAL_UINT(1, fake.restarts);
}

static void leaves_see_a_blocked_bus(void)
{
    use_mailboxes();
    cycle(0);
    cycle(0);
    TEST_ASSERT_EQUAL(CANOPY_CAN_BLOCKED, seen.can_state); /* in the cycle that begins at the deadline */
    TEST_ASSERT_EQUAL_UINT(1, faults[CANOPY_FAULT_TX_EXPIRED]);
    TEST_ASSERT_EQUAL_UINT32(1, details[CANOPY_FAULT_TX_EXPIRED]);
    TEST_ASSERT_EQUAL_UINT32(1, loop.tx_expired);
    boxes_let_out(0);
    cycle(0);
    TEST_ASSERT_EQUAL(CANOPY_CAN_ERROR_ACTIVE, seen.can_state);
    TEST_ASSERT_EQUAL_UINT(1, faults[CANOPY_FAULT_TX_EXPIRED]);
}

static void expect_it_taken_back(void)
{
    TEST_ASSERT_EQUAL_UINT(1, boxes.aborts);
    TEST_ASSERT_EQUAL_HEX32(TX_ID + 1, boxes.box[0].id); /* the next one, whose deadline is later */
}

static void what_is_past_its_deadline_does_not_leave_while_the_next_tick_is_worked_out(void)
{
    use_mailboxes();
    cycle(0);
    while_ticking = expect_it_taken_back;
    cycle(0);
}

static void a_newer_value_before_the_deadline_is_another_fault(void)
{
    use_mailboxes();
    cycle(0);
    clock_now -= PERIOD_US / 2; /* the next cycle comes when the first one's commands have half of their time left */
    cycle(0);
    canopy_tx_service(&memory.tx, clock_now);
    cycle(0);
    TEST_ASSERT_EQUAL_UINT(1, faults[CANOPY_FAULT_TX_REPLACED]);
    TEST_ASSERT_EQUAL_UINT32(1, details[CANOPY_FAULT_TX_REPLACED]);
    TEST_ASSERT_EQUAL_UINT32(1, loop.tx_replaced);
    TEST_ASSERT_EQUAL_UINT(1, faults[CANOPY_FAULT_TX_EXPIRED]); /* the newer one, later */
    TEST_ASSERT_EQUAL_UINT32(1, loop.tx_expired);
}

static void faults_may_go_unheard(void)
{
    use_mailboxes();
    config.on_fault = NULL;
    fake.rx_dropped = 1;
    can.stats = fake_can_stats;
    can.context = &fake;
    for (unsigned tick = 0; tick < 3u; tick++) {
        cycle(0);
    }
    TEST_ASSERT_EQUAL_UINT32(2, loop.tx_expired);
    TEST_ASSERT_EQUAL_UINT32(1, loop.rx_lost);
}

/* --- back ----------------------------------------------------------------------------------------------------------- */

/** How many of the frames that were sent in the last cycle carry this value. */
static unsigned sent_with(uint8_t value)
{
    unsigned count = 0;

    for (unsigned frame = 0; frame < fake.tx_count; frame++) {
        count += fake.tx[frame].data[0] == value ? 1u : 0u;
    }
    return count;
}

static void after_an_unusable_bus_every_messages_safe_value_is_the_first_that_leaves(void)
{
    cycle(0); /* tick 0 */
    TEST_ASSERT_EQUAL_UINT(2, sent_with(WANTED));
    fake.controller = CANOPY_CAN_CONTROLLER_BUS_OFF;
    fake.tx_result = CANOPY_ERROR_BUS_DOWN;
    fake.tx_count = 0;
    cycle(0);
    cycle(0);
    TEST_ASSERT_EQUAL_UINT(0, fake.tx_count);
    fake.controller = CANOPY_CAN_CONTROLLER_ACTIVE;
    fake.tx_result = 1;
    cycle(0);
    TEST_ASSERT_EQUAL_UINT(2, fake.tx_count);
    TEST_ASSERT_EQUAL_UINT(2, sent_with(SAFE));
    TEST_ASSERT_EQUAL_HEX32(TX_ID, fake.tx[0].id);
    TEST_ASSERT_EQUAL_HEX32(TX_ID + 1, fake.tx[1].id);
    fake.tx_count = 0;
    cycle(0);
    TEST_ASSERT_EQUAL_UINT(2, sent_with(WANTED)); /* tick 4 */
    TEST_ASSERT_FALSE(loop.returning);
}

/** One frame leaves, and what waits takes its place. */
static void let_one_out(void)
{
    boxes_let_out(0);
    canopy_tx_service(&memory.tx, clock_now);
}

static void safe_values_go_on_until_they_are_known_to_be_out(void)
{
    use_mailboxes();
    fake.controller = CANOPY_CAN_CONTROLLER_DOWN;
    can.state = fake_can_state;
    can.context = &fake;
    cycle(0);
    fake.controller = CANOPY_CAN_CONTROLLER_ACTIVE;
    for (unsigned tick = 0; tick < 5u; tick++) {
        cycle(0);
        TEST_ASSERT_TRUE(loop.returning);
        TEST_ASSERT_TRUE(boxes.is_full[0]);
        TEST_ASSERT_EQUAL_UINT8(SAFE, boxes.box[0].data[0]);
    }
    let_one_out();
    TEST_ASSERT_EQUAL_HEX32(TX_ID + 1, boxes.box[0].id);
    cycle(0); /* one of two */
    TEST_ASSERT_TRUE(loop.returning);
    TEST_ASSERT_EQUAL_HEX32(TX_ID + 1, boxes.box[0].id);
    let_one_out();
    TEST_ASSERT_FALSE(boxes.is_full[0]); /* the first one waits for the others */
    cycle(0);
    TEST_ASSERT_FALSE(loop.returning);
    TEST_ASSERT_EQUAL_UINT8(WANTED, boxes.box[0].data[0]);
    TEST_ASSERT_EQUAL_UINT8(SAFE, boxes.out[boxes.out_count - 1u].data[0]);
}

static void a_bus_that_takes_one_frame_in_a_tick_gives_control_back(void)
{
    use_mailboxes();
    fake.controller = CANOPY_CAN_CONTROLLER_BUS_OFF;
    can.state = fake_can_state;
    can.context = &fake;
    cycle(0);
    fake.controller = CANOPY_CAN_CONTROLLER_ACTIVE;
    cycle(0);
    boxes_let_out(0);
    cycle(0); /* the first message has returned: the other one is not kept waiting for its next value */
    TEST_ASSERT_TRUE(loop.returning);
    TEST_ASSERT_EQUAL_HEX32(TX_ID + 1, boxes.box[0].id);
    TEST_ASSERT_EQUAL_UINT8(SAFE, boxes.box[0].data[0]);
    boxes_let_out(0);
    cycle(0);
    TEST_ASSERT_FALSE(loop.returning);
    TEST_ASSERT_EQUAL_HEX32(TX_ID, boxes.box[0].id);
    TEST_ASSERT_EQUAL_UINT8(WANTED, boxes.box[0].data[0]);
}

static void what_was_decided_before_does_not_count_when_it_leaves(void)
{
    use_mailboxes();
    can.abort = NULL; /* as a kernel's queue: what it has taken leaves some time */
    can.state = fake_can_state;
    can.context = &fake;
    cycle(0);
    fake.controller = CANOPY_CAN_CONTROLLER_BUS_OFF;
    cycle(0);
    fake.controller = CANOPY_CAN_CONTROLLER_ACTIVE;
    TEST_ASSERT_EQUAL_UINT8(WANTED, boxes.box[0].data[0]);
    let_one_out();
    TEST_ASSERT_TRUE(canopy_tx_owes(&memory.tx, 0));
    cycle(0);
    for (unsigned frame = 1; frame <= 3u; frame++) { /* the first message's safe value twice: one was waiting already */
        TEST_ASSERT_TRUE(loop.returning);
        TEST_ASSERT_EQUAL_UINT8(SAFE, boxes.box[0].data[0]);
        TEST_ASSERT_EQUAL_HEX32(frame < 3u ? TX_ID : TX_ID + 1, boxes.box[0].id);
        let_one_out();
        cycle(0);
    }
    TEST_ASSERT_FALSE(loop.returning);
    let_one_out(); /* the second message's other one */
    TEST_ASSERT_EQUAL_UINT8(WANTED, boxes.box[0].data[0]);
}

static void recorded_returning(void *context, canopy_can_conditions_t *conditions)
{
    (void)context;
    *conditions = (canopy_can_conditions_t){.returning = clock_now < 4u * (canopy_time_t)PERIOD_US};
}

static void a_replay_sends_every_safe_value_in_each_tick_in_which_it_returned(void)
{
    can.conditions = recorded_returning;
    for (unsigned tick = 1; tick < 4u; tick++) {
        fake.tx_count = 0;
        cycle(0);
        TEST_ASSERT_EQUAL_UINT(2, sent_with(SAFE)); /* those that were held back then are counted in the record */
    }
    TEST_ASSERT_EQUAL_UINT32(0, loop.tx_replaced);
    fake.tx_count = 0;
    cycle(0);
    TEST_ASSERT_EQUAL_UINT(1, sent_with(WANTED));
}

/** Trace frames lost after so many ticks on a bus that lets nothing through. */
static uint32_t trace_lost_after(unsigned ticks)
{
    canopy_tx_counters_t counters;

    boxes_reset();
    app.trace = &trace;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&loop, &config));
    for (unsigned tick = 0; tick < ticks; tick++) {
        cycle(0);
    }
    canopy_tx_count(&memory.tx, &counters);
    return counters.trace_dropped;
}

static void the_trace_waits_for_the_bus_as_long_as_it_has_room(void)
{
    static canopy_tx_trace_t places[128];

    use_mailboxes();
    app.tx_memory.trace = places;
    app.tx_memory.trace_capacity = 128;
    TEST_ASSERT_EQUAL_UINT32(0, trace_lost_after(CANOPY_TRACE_PERIODS));
    TEST_ASSERT_EQUAL_UINT32(6, trace_lost_after(CANOPY_TRACE_PERIODS + 1u)); /* the whole first tick */
    app.trace_ticks = 6;
    TEST_ASSERT_EQUAL_UINT32(0, trace_lost_after(CANOPY_TRACE_PERIODS + 6u));
    TEST_ASSERT_EQUAL_UINT32(6, trace_lost_after(CANOPY_TRACE_PERIODS + 7u));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_backlog_that_lasts_is_overload);
    RUN_TEST(frames_that_the_driver_has_lost_are_overload_in_the_next_cycle);
    RUN_TEST(a_driver_may_count_nothing);
    RUN_TEST(leaves_and_fault_hook_are_told_the_state);
    RUN_TEST(a_failed_controller_is_restarted);
    RUN_TEST(leaves_see_a_blocked_bus);
    RUN_TEST(what_is_past_its_deadline_does_not_leave_while_the_next_tick_is_worked_out);
    RUN_TEST(a_newer_value_before_the_deadline_is_another_fault);
    RUN_TEST(faults_may_go_unheard);
    RUN_TEST(after_an_unusable_bus_every_messages_safe_value_is_the_first_that_leaves);
    RUN_TEST(a_bus_that_takes_one_frame_in_a_tick_gives_control_back);
    RUN_TEST(what_was_decided_before_does_not_count_when_it_leaves);
    RUN_TEST(a_replay_sends_every_safe_value_in_each_tick_in_which_it_returned);
    RUN_TEST(safe_values_go_on_until_they_are_known_to_be_out);
    RUN_TEST(the_trace_waits_for_the_bus_as_long_as_it_has_room);
    return UNITY_END();
}
