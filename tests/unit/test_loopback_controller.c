/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Endpoints that share a controller's mailboxes: who is first, what is taken back, and that nobody sees what is not out.
 */
#include "canopy/can/loopback.h"

#include "unity.h"

enum { CAPACITY = 4, RX_MAX = 4, BOXES = 3 };

static canopy_loopback_t bus;
static canopy_loopback_endpoint_t a, b, c;
static canopy_can_frame_t storage[3][CAPACITY];

/* A controller whose mailboxes the test empties. */
static struct {
    canopy_can_frame_t rx[RX_MAX];
    unsigned rx_count;
    unsigned rx_taken;
    int rx_error;
    int send_result;
    bool abort_works; /* at once */
    canopy_can_frame_t box[BOXES];
    canopy_can_outcome_t outcome[BOXES];
    bool full[BOXES];
    unsigned aborts;
    unsigned restarts;
} hardware;

static int hw_receive(void *context, canopy_can_frame_t *frame)
{
    (void)context;
    if (hardware.rx_taken == hardware.rx_count) {
        return hardware.rx_error;
    }
    *frame = hardware.rx[hardware.rx_taken++];
    return 1;
}

static int hw_send(void *context, uint8_t mailbox, const canopy_can_frame_t *frame)
{
    (void)context;
    if (hardware.send_result == 1) {
        TEST_ASSERT_LESS_THAN_UINT8(BOXES, mailbox);
        TEST_ASSERT_FALSE_MESSAGE(hardware.full[mailbox], "the mailbox is taken");
        hardware.full[mailbox] = true;
        hardware.box[mailbox] = *frame;
        hardware.outcome[mailbox] = CANOPY_CAN_PENDING;
    }
    return hardware.send_result;
}

static canopy_can_outcome_t hw_outcome(void *context, uint8_t mailbox)
{
    (void)context;
    hardware.full[mailbox] = hardware.outcome[mailbox] == CANOPY_CAN_PENDING;
    return hardware.outcome[mailbox];
}

static void hw_abort(void *context, uint8_t mailbox)
{
    (void)context;
    hardware.aborts++;
    if (hardware.abort_works) {
        hardware.outcome[mailbox] = CANOPY_CAN_ABORTED;
    }
}

static canopy_can_controller_t hw_state(void *context)
{
    (void)context;
    return CANOPY_CAN_CONTROLLER_BUS_OFF;
}

static void hw_restart(void *context)
{
    (void)context;
    hardware.restarts++;
}

static void hw_stats(void *context, canopy_can_stats_t *stats)
{
    (void)context;
    *stats = (canopy_can_stats_t){.rx_dropped = 7, .error_frames = 3};
}

static canopy_can_t controller;

static void join(canopy_loopback_endpoint_t *endpoint, unsigned place)
{
    TEST_ASSERT_EQUAL(CANOPY_OK,
                      canopy_loopback_join(&bus, endpoint, storage[place], CAPACITY, CANOPY_CAN_ACCEPT_EVERYTHING));
}

static void start(uint8_t mailboxes)
{
    controller = (canopy_can_t){.receive = hw_receive,
                                .send = hw_send,
                                .outcome = hw_outcome,
                                .abort = hw_abort,
                                .state = hw_state,
                                .restart = hw_restart,
                                .stats = hw_stats,
                                .mailboxes = mailboxes};
    bus = (canopy_loopback_t){.controller = &controller};
    hardware.rx_count = 0;
    hardware.rx_taken = 0;
    hardware.rx_error = 0;
    hardware.send_result = 1;
    hardware.abort_works = true;
    hardware.aborts = 0;
    hardware.restarts = 0;
    for (unsigned box = 0; box < (unsigned)BOXES; box++) {
        hardware.full[box] = false;
    }
    join(&a, 0);
    join(&b, 1);
    join(&c, 2);
}

void setUp(void)
{
    start(1);
}

void tearDown(void)
{
}

static int send_frame(canopy_loopback_endpoint_t *endpoint, uint32_t id, uint8_t flags)
{
    const canopy_can_frame_t frame = {.id = id, .flags = flags, .length = 1};

    return endpoint->can.send(endpoint->can.context, 0, &frame);
}

static int send(canopy_loopback_endpoint_t *endpoint, uint32_t id)
{
    return send_frame(endpoint, id, 0);
}

static canopy_can_outcome_t outcome(canopy_loopback_endpoint_t *endpoint)
{
    return endpoint->can.outcome(endpoint->can.context, 0);
}

static void give_up(canopy_loopback_endpoint_t *endpoint)
{
    endpoint->can.abort(endpoint->can.context, 0);
}

static long receive(canopy_loopback_endpoint_t *endpoint)
{
    canopy_can_frame_t frame;
    int result = endpoint->can.receive(endpoint->can.context, &frame);

    return result == 1 ? (long)frame.id : -1;
}

/** The frame in the controller's mailbox, which must hold one. */
static uint32_t on_wire(unsigned box)
{
    TEST_ASSERT_TRUE(hardware.full[box]);
    return hardware.box[box].id;
}

static void let_out(unsigned box)
{
    TEST_ASSERT_TRUE(hardware.full[box]);
    hardware.outcome[box] = CANOPY_CAN_SENT;
}

static canopy_can_stats_t stats(canopy_loopback_endpoint_t *endpoint)
{
    canopy_can_stats_t result;

    endpoint->can.stats(endpoint->can.context, &result);
    return result;
}

static void test_all_see_the_wire_and_each_other(void)
{
    hardware.rx[0] = (canopy_can_frame_t){.id = 0x30};
    hardware.rx[1] = (canopy_can_frame_t){.id = 0x31};
    hardware.rx_count = 2;

    TEST_ASSERT_EQUAL(0x30, receive(&a));
    TEST_ASSERT_EQUAL(1, send(&a, 0x10));
    let_out(0);
    TEST_ASSERT_EQUAL(CANOPY_CAN_SENT, outcome(&a));
    TEST_ASSERT_EQUAL(0x30, receive(&b));
    TEST_ASSERT_EQUAL(0x10, receive(&b));
    TEST_ASSERT_EQUAL(0x31, receive(&b));
    TEST_ASSERT_EQUAL(-1, receive(&b));
    TEST_ASSERT_EQUAL(0x31, receive(&a));
    TEST_ASSERT_EQUAL(-1, receive(&a));
    TEST_ASSERT_EQUAL_UINT32(2, stats(&a).received);
    TEST_ASSERT_EQUAL_UINT32(3, stats(&b).received);
}

static void test_nobody_sees_what_is_not_out(void)
{
    TEST_ASSERT_EQUAL(1, send(&a, 0x10));
    TEST_ASSERT_EQUAL(CANOPY_CAN_PENDING, outcome(&a));
    TEST_ASSERT_EQUAL(-1, receive(&b));
    TEST_ASSERT_EQUAL(0, send(&a, 0x11)); /* its mailbox is taken */
    TEST_ASSERT_EQUAL_UINT32(0, stats(&a).sent);
    let_out(0);
    TEST_ASSERT_EQUAL(CANOPY_CAN_SENT, outcome(&a));
    TEST_ASSERT_EQUAL(CANOPY_CAN_SENT, outcome(&a));
    TEST_ASSERT_EQUAL(0x10, receive(&b));
    TEST_ASSERT_EQUAL(-1, receive(&b));
    TEST_ASSERT_EQUAL_UINT32(1, stats(&a).sent);
}

static void test_the_most_urgent_of_all_is_next(void)
{
    controller.abort = NULL;
    TEST_ASSERT_EQUAL(1, send(&a, 0x300));
    TEST_ASSERT_EQUAL(1, send_frame(&b, 0x200u << 18, CANOPY_CAN_EXTENDED));
    TEST_ASSERT_EQUAL(1, send(&c, 0x200)); /* a standard frame wins over an extended one of the same base */
    TEST_ASSERT_EQUAL_HEX32(0x300, on_wire(0));
    let_out(0);
    TEST_ASSERT_EQUAL(CANOPY_CAN_PENDING, outcome(&b)); /* whoever asks moves all on */
    TEST_ASSERT_EQUAL_HEX32(0x200, on_wire(0));
    let_out(0);
    TEST_ASSERT_EQUAL(CANOPY_CAN_PENDING, outcome(&b));
    TEST_ASSERT_EQUAL_HEX32(0x200u << 18, on_wire(0));
    TEST_ASSERT_EQUAL(CANOPY_CAN_SENT, outcome(&a));
    TEST_ASSERT_EQUAL(CANOPY_CAN_SENT, outcome(&c));
}

static void test_a_less_urgent_frame_gives_up_its_mailbox_and_waits_again(void)
{
    TEST_ASSERT_EQUAL(1, send(&a, 0x300));
    TEST_ASSERT_EQUAL(1, send(&b, 0x100));
    TEST_ASSERT_EQUAL_UINT(1, hardware.aborts);
    TEST_ASSERT_EQUAL_HEX32(0x100, on_wire(0));
    TEST_ASSERT_EQUAL(CANOPY_CAN_PENDING, outcome(&a)); /* a does not know */
    TEST_ASSERT_EQUAL(1, send(&c, 0x200));              /* less urgent than b's: it waits */
    TEST_ASSERT_EQUAL_UINT(1, hardware.aborts);
    let_out(0);
    TEST_ASSERT_EQUAL(CANOPY_CAN_SENT, outcome(&b));
    TEST_ASSERT_EQUAL_HEX32(0x200, on_wire(0));
    let_out(0);
    TEST_ASSERT_EQUAL(CANOPY_CAN_PENDING, outcome(&a));
    TEST_ASSERT_EQUAL_HEX32(0x300, on_wire(0));
    let_out(0);
    TEST_ASSERT_EQUAL(CANOPY_CAN_SENT, outcome(&a));
}

static void test_a_frame_that_gets_out_while_it_is_asked_back_is_out(void)
{
    hardware.abort_works = false;
    TEST_ASSERT_EQUAL(1, send(&a, 0x300));
    TEST_ASSERT_EQUAL(1, send(&b, 0x100));
    TEST_ASSERT_EQUAL(CANOPY_CAN_PENDING, outcome(&b));
    TEST_ASSERT_EQUAL_UINT(1, hardware.aborts); /* asked once */
    let_out(0);
    TEST_ASSERT_EQUAL(CANOPY_CAN_SENT, outcome(&a));
    TEST_ASSERT_EQUAL(0x300, receive(&b));
    TEST_ASSERT_EQUAL_HEX32(0x100, on_wire(0));
}

static void test_an_endpoint_takes_its_frame_back(void)
{
    TEST_ASSERT_EQUAL(1, send(&a, 0x100));
    TEST_ASSERT_EQUAL(1, send(&b, 0x200));
    give_up(&b); /* it waits at the endpoint: at once */
    TEST_ASSERT_EQUAL(CANOPY_CAN_ABORTED, outcome(&b));
    TEST_ASSERT_EQUAL_UINT(0, hardware.aborts);
    TEST_ASSERT_EQUAL_UINT32(1, stats(&b).tx_dropped);
    give_up(&a); /* the controller has it */
    TEST_ASSERT_EQUAL_UINT(1, hardware.aborts);
    TEST_ASSERT_EQUAL(CANOPY_CAN_ABORTED, outcome(&a));
    TEST_ASSERT_EQUAL(-1, receive(&c));
    TEST_ASSERT_EQUAL(1, send(&a, 0x101));
    TEST_ASSERT_EQUAL_HEX32(0x101, on_wire(0));
}

static void test_a_frame_that_was_asked_back_twice_does_not_wait_again(void)
{
    hardware.abort_works = false;
    TEST_ASSERT_EQUAL(1, send(&a, 0x300));
    TEST_ASSERT_EQUAL(1, send(&b, 0x100)); /* wants the mailbox, */
    give_up(&a);                           /* and its owner does not want the frame any more */
    TEST_ASSERT_EQUAL(CANOPY_CAN_PENDING, outcome(&a));
    hardware.outcome[0] = CANOPY_CAN_ABORTED;
    TEST_ASSERT_EQUAL(CANOPY_CAN_ABORTED, outcome(&a));
    TEST_ASSERT_EQUAL_HEX32(0x100, on_wire(0));
}

static void test_a_controller_that_cannot_abort_sends_it(void)
{
    controller.abort = NULL;
    TEST_ASSERT_EQUAL(1, send(&a, 0x300));
    give_up(&a);
    TEST_ASSERT_EQUAL(CANOPY_CAN_PENDING, outcome(&a));
    let_out(0);
    TEST_ASSERT_EQUAL(CANOPY_CAN_SENT, outcome(&a));
}

static void test_a_frame_that_the_controller_loses_is_told(void)
{
    TEST_ASSERT_EQUAL(1, send(&a, 0x300));
    hardware.outcome[0] = CANOPY_CAN_ABORTED; /* by itself, after bus-off for example */
    TEST_ASSERT_EQUAL(CANOPY_CAN_ABORTED, outcome(&a));
    TEST_ASSERT_EQUAL_UINT32(1, stats(&a).tx_dropped);
}

static void test_several_mailboxes_are_all_used(void)
{
    start(3);
    TEST_ASSERT_EQUAL(1, send(&a, 0x300));
    TEST_ASSERT_EQUAL(1, send(&b, 0x200));
    TEST_ASSERT_EQUAL(1, send(&c, 0x100));
    TEST_ASSERT_EQUAL_UINT(0, hardware.aborts);
    TEST_ASSERT_EQUAL_HEX32(0x300, on_wire(0));
    TEST_ASSERT_EQUAL_HEX32(0x200, on_wire(1));
    TEST_ASSERT_EQUAL_HEX32(0x100, on_wire(2));
    let_out(2);
    TEST_ASSERT_EQUAL(CANOPY_CAN_SENT, outcome(&c));
    TEST_ASSERT_EQUAL(CANOPY_CAN_PENDING, outcome(&a));
}

static void test_what_the_controller_does_not_take(void)
{
    hardware.send_result = 0;
    TEST_ASSERT_EQUAL(1, send(&a, 0x10)); /* it waits at the endpoint */
    TEST_ASSERT_EQUAL(CANOPY_CAN_PENDING, outcome(&a));
    hardware.send_result = CANOPY_ERROR_BUS_DOWN;
    TEST_ASSERT_EQUAL(CANOPY_CAN_ABORTED, outcome(&a));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_BUS_DOWN, send(&a, 0x11));
    TEST_ASSERT_EQUAL(CANOPY_CAN_ABORTED, outcome(&a));
    TEST_ASSERT_EQUAL(-1, receive(&b));
    TEST_ASSERT_EQUAL_UINT32(2, stats(&a).tx_dropped);
    TEST_ASSERT_EQUAL_UINT32(0, stats(&a).sent);
}

static void test_a_controller_that_knows_no_outcome_has_sent_what_it_took(void)
{
    controller.outcome = NULL;
    TEST_ASSERT_EQUAL(1, send(&a, 0x10));
    TEST_ASSERT_EQUAL(CANOPY_CAN_SENT, outcome(&a));
    TEST_ASSERT_EQUAL(0x10, receive(&b));
}

static void test_who_leaves_leaves_the_mailbox_when_its_frame_is_gone(void)
{
    TEST_ASSERT_EQUAL(1, send(&a, 0x10));
    canopy_loopback_leave(&a);
    TEST_ASSERT_EQUAL(CANOPY_CAN_ABORTED, outcome(&a));
    TEST_ASSERT_EQUAL(1, send(&b, 0x05));
    TEST_ASSERT_EQUAL(CANOPY_CAN_PENDING, outcome(&b));
    TEST_ASSERT_EQUAL_HEX32(0x10, on_wire(0)); /* it cannot be asked for any more */
    let_out(0);
    TEST_ASSERT_EQUAL(CANOPY_CAN_PENDING, outcome(&b));
    TEST_ASSERT_EQUAL_HEX32(0x05, on_wire(0));
    TEST_ASSERT_EQUAL(-1, receive(&c));
}

static void test_state_restart_and_losses_are_the_controllers(void)
{
    TEST_ASSERT_EQUAL(CANOPY_CAN_CONTROLLER_BUS_OFF, a.can.state(a.can.context));
    a.can.restart(a.can.context);
    TEST_ASSERT_EQUAL_UINT(1, hardware.restarts);
    TEST_ASSERT_EQUAL_UINT32(7, stats(&a).rx_dropped);
    TEST_ASSERT_EQUAL_UINT32(3, stats(&a).error_frames);
    controller.state = NULL;
    controller.restart = NULL;
    controller.stats = NULL;
    TEST_ASSERT_EQUAL(CANOPY_CAN_CONTROLLER_ACTIVE, a.can.state(a.can.context));
    a.can.restart(a.can.context);
    TEST_ASSERT_EQUAL_UINT32(0, stats(&a).rx_dropped);
}

static void test_an_error_of_the_controller_is_handed_on(void)
{
    canopy_can_frame_t frame;

    hardware.rx_error = CANOPY_ERROR_BUS_DOWN;
    TEST_ASSERT_EQUAL(CANOPY_ERROR_BUS_DOWN, a.can.receive(a.can.context, &frame));
    TEST_ASSERT_EQUAL_UINT32(0, stats(&a).received);
    canopy_loopback_leave(&b);
    TEST_ASSERT_EQUAL(-1, receive(&b));
}

static unsigned fetched;

static int endless_receive(void *context, canopy_can_frame_t *frame)
{
    (void)context;
    fetched++;
    *frame = (canopy_can_frame_t){.id = 8};
    return 1;
}

static void test_a_flood_of_what_an_endpoint_does_not_accept_cannot_hold_it_up(void)
{
    static const uint32_t ids[] = {7};
    static const canopy_can_acceptance_t acceptance = {.ids = ids, .count = 1};

    controller.receive = endless_receive;
    controller.stats = NULL;
    canopy_loopback_leave(&c);
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loopback_join(&bus, &c, storage[2], CAPACITY, &acceptance));
    fetched = 0;
    TEST_ASSERT_EQUAL(-1, receive(&c));
    TEST_ASSERT_EQUAL_UINT(CANOPY_LOOPBACK_FETCH, fetched);
    TEST_ASSERT_EQUAL_UINT32(CANOPY_LOOPBACK_FETCH - (unsigned)CAPACITY, stats(&a).rx_dropped);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_all_see_the_wire_and_each_other);
    RUN_TEST(test_nobody_sees_what_is_not_out);
    RUN_TEST(test_the_most_urgent_of_all_is_next);
    RUN_TEST(test_a_less_urgent_frame_gives_up_its_mailbox_and_waits_again);
    RUN_TEST(test_a_frame_that_gets_out_while_it_is_asked_back_is_out);
    RUN_TEST(test_an_endpoint_takes_its_frame_back);
    RUN_TEST(test_a_frame_that_was_asked_back_twice_does_not_wait_again);
    RUN_TEST(test_a_controller_that_cannot_abort_sends_it);
    RUN_TEST(test_a_frame_that_the_controller_loses_is_told);
    RUN_TEST(test_several_mailboxes_are_all_used);
    RUN_TEST(test_what_the_controller_does_not_take);
    RUN_TEST(test_a_controller_that_knows_no_outcome_has_sent_what_it_took);
    RUN_TEST(test_who_leaves_leaves_the_mailbox_when_its_frame_is_gone);
    RUN_TEST(test_state_restart_and_losses_are_the_controllers);
    RUN_TEST(test_an_error_of_the_controller_is_handed_on);
    RUN_TEST(test_a_flood_of_what_an_endpoint_does_not_accept_cannot_hold_it_up);
    return UNITY_END();
}
