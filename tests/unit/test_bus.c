/* SPDX-License-Identifier: MIT */
/** @file Frames into the input image and out of the output image: what is refused changes nothing but a counter. */
#include <string.h>

#include "canopy/bus.h"
#include "canopy/signal.h"
#include "canopy/tree.h"
#include "fake_can.h"
#include "unity.h"

typedef struct {
    canopy_time_t now;
    uint8_t speed;
    bool speed_fresh;
    uint8_t plain;
    bool plain_fresh;
} input_t;

typedef struct {
    uint8_t torque;
} output_t;

enum { SPEED_ID = 0x100, PLAIN_ID = 0x100, TORQUE_ID = 0x200, SPEED_MAX = 200, TIMEOUT_US = 5000 };

static input_t input;
static output_t output;
static canopy_rx_state_t rx_states[2];
static uint8_t tx_counters[2];
static canopy_bus_state_t bus;

static bool decode_speed(void *image, const uint8_t *data)
{
    if (data[2] > SPEED_MAX) {
        return false;
    }
    ((input_t *)image)->speed = data[2];
    return true;
}

static void speed_fresh(void *image, bool fresh)
{
    ((input_t *)image)->speed_fresh = fresh;
}

static bool decode_plain(void *image, const uint8_t *data)
{
    ((input_t *)image)->plain = data[0];
    return true;
}

static void plain_fresh(void *image, bool fresh)
{
    ((input_t *)image)->plain_fresh = fresh;
}

static void encode_torque(const void *image, uint8_t *data)
{
    data[0] = 0;
    data[1] = 0;
    data[2] = ((const output_t *)image)->torque;
}

static void reset_output(void *image)
{
    ((output_t *)image)->torque = 7;
}

static void set_now(void *image, canopy_time_t now)
{
    ((input_t *)image)->now = now;
}

/* The second message has the same number as the first, as an extended id. */
static const canopy_rx_message_t rx[] = {
    {.id = SPEED_ID,
     .length = 3,
     .data_id = 1,
     .timeout = TIMEOUT_US,
     .decode = decode_speed,
     .set_fresh = speed_fresh},
    {.id = PLAIN_ID,
     .flags = CANOPY_CAN_EXTENDED,
     .length = 1,
     .data_id = CANOPY_E2E_NONE,
     .decode = decode_plain,
     .set_fresh = plain_fresh},
};
static const canopy_tx_message_t tx[] = {
    {.id = TORQUE_ID, .length = 3, .data_id = 2, .every = 1, .encode = encode_torque},
    {.id = TORQUE_ID + 1, .length = 3, .data_id = CANOPY_E2E_NONE, .every = 3, .encode = encode_torque},
};
static const canopy_bus_t tables = {
    .rx = rx, .tx = tx, .rx_count = 2, .tx_count = 2, .reset_output = reset_output, .set_now = set_now};

void setUp(void)
{
    fake_can_reset();
    memset(&input, 0, sizeof input);
    output = (output_t){0};
    memset(rx_states, 0, sizeof rx_states);
    memset(tx_counters, 0, sizeof tx_counters);
    bus = (canopy_bus_state_t){
        .bus = &tables, .input = &input, .output = &output, .rx = rx_states, .tx_counters = tx_counters};
}

void tearDown(void)
{
}

static canopy_can_frame_t speed_frame(uint8_t counter, uint8_t speed)
{
    canopy_can_frame_t frame = {.id = SPEED_ID, .length = 3, .data = {0, 0, speed}};

    canopy_e2e_protect(1, counter, frame.data, 3);
    return frame;
}

static void receive(canopy_can_frame_t frame, canopy_time_t now)
{
    canopy_bus_receive(&bus, &frame, now);
}

static void a_good_frame_is_taken_and_becomes_stale(void)
{
    receive(speed_frame(0, 42), 1000);
    canopy_bus_begin_tick(&bus, 1000);
    TEST_ASSERT_EQUAL_UINT8(42, input.speed);
    TEST_ASSERT_TRUE(input.speed_fresh);
    TEST_ASSERT_EQUAL_UINT64(1000, input.now);
    canopy_bus_begin_tick(&bus, 1000 + TIMEOUT_US - 1);
    TEST_ASSERT_TRUE(input.speed_fresh);
    canopy_bus_begin_tick(&bus, 1000 + TIMEOUT_US);
    TEST_ASSERT_FALSE(input.speed_fresh);
    TEST_ASSERT_EQUAL_UINT32(1, bus.counters.timeouts);
    canopy_bus_begin_tick(&bus, 2000 + TIMEOUT_US);
    TEST_ASSERT_EQUAL_UINT32(1, bus.counters.timeouts);
    receive(speed_frame(1, 43), 3000 + TIMEOUT_US);
    canopy_bus_begin_tick(&bus, 3000 + TIMEOUT_US);
    TEST_ASSERT_TRUE(input.speed_fresh);
}

static void nothing_is_fresh_before_the_first_frame(void)
{
    canopy_bus_begin_tick(&bus, 0);
    TEST_ASSERT_FALSE(input.speed_fresh);
    TEST_ASSERT_FALSE(input.plain_fresh);
    TEST_ASSERT_EQUAL_UINT32(0, bus.counters.timeouts);
}

static void without_a_timeout_a_message_stays_fresh(void)
{
    canopy_can_frame_t frame = {.id = PLAIN_ID, .flags = CANOPY_CAN_EXTENDED, .length = 1, .data = {9}};

    receive(frame, 0);
    canopy_bus_begin_tick(&bus, UINT64_MAX / 4u);
    TEST_ASSERT_TRUE(input.plain_fresh);
    TEST_ASSERT_EQUAL_UINT8(9, input.plain);
    TEST_ASSERT_EQUAL_UINT8(0, input.speed);
}

/** Hands over a frame that must change nothing but this counter. */
static void refused(canopy_can_frame_t frame, const uint32_t *counter)
{
    input_t before;
    uint32_t count = *counter;

    receive(speed_frame(1, 42), 0);
    memcpy(&before, &input, sizeof input); /* an assignment need not copy what lies between the members */
    bus.counters.accepted = 0;
    receive(frame, 0);
    TEST_ASSERT_EQUAL_UINT32(count + 1u, *counter);
    TEST_ASSERT_EQUAL_UINT32(0, bus.counters.accepted);
    TEST_ASSERT_EQUAL_MEMORY(&before, &input, sizeof input);
    setUp();
}

static void what_is_wrong_changes_nothing_but_a_counter(void)
{
    canopy_can_frame_t frame = speed_frame(2, 50);

    frame.id = 0x101;
    refused(frame, &bus.counters.unknown_id);
    frame = speed_frame(2, 50);
    frame.length = 2;
    refused(frame, &bus.counters.wrong_form);
    frame.length = 0;
    refused(frame, &bus.counters.wrong_form);
    frame.length = 8;
    refused(frame, &bus.counters.wrong_form);
    frame = speed_frame(2, 50);
    frame.flags = CANOPY_CAN_REMOTE;
    refused(frame, &bus.counters.wrong_form);
    frame.flags = CANOPY_CAN_FD;
    refused(frame, &bus.counters.wrong_form);
    frame = speed_frame(2, 50);
    frame.data[2] ^= 1u;
    refused(frame, &bus.counters.wrong_crc);
    refused(speed_frame(1, 50), &bus.counters.wrong_sequence);
    refused(speed_frame(9, 50), &bus.counters.wrong_sequence);
    refused(speed_frame(2, SPEED_MAX + 1), &bus.counters.out_of_range);
}

static void an_error_frame_is_no_message_whatever_its_id(void)
{
    canopy_can_frame_t frame = speed_frame(2, 50);

    frame.flags = CANOPY_CAN_ERROR;
    refused(frame, &bus.counters.unknown_id);
    frame.id = PLAIN_ID;
    frame.flags = CANOPY_CAN_ERROR | CANOPY_CAN_EXTENDED;
    refused(frame, &bus.counters.unknown_id);
}

static void what_was_taken_is_counted_and_checked_for_a_replay(void)
{
    canopy_can_frame_t frame = {.id = PLAIN_ID, .flags = CANOPY_CAN_EXTENDED, .length = 1, .data = {9}};

    receive(frame, 0);
    TEST_ASSERT_EQUAL_UINT8(1, bus.taken);
    TEST_ASSERT_EQUAL_HEX8(9, bus.check); /* the low byte of the id is 0 */
    frame.data[0] = 0x80;
    receive(frame, 0);
    TEST_ASSERT_EQUAL_UINT8(2, bus.taken);
    TEST_ASSERT_EQUAL_HEX8(0x48 ^ 0x80, bus.check);
    frame.length = 64; /* of a wrong form: counted, but its bytes may be anything */
    receive(frame, 0);
    frame.flags = CANOPY_CAN_EXTENDED | CANOPY_CAN_REMOTE;
    frame.length = 1;
    receive(frame, 0);
    TEST_ASSERT_EQUAL_UINT8(4, bus.taken);
    TEST_ASSERT_EQUAL_HEX8(0x48 ^ 0x80, bus.check);
    frame.flags = CANOPY_CAN_ERROR;
    receive(frame, 0);
    frame.flags = 0;
    frame.id = 0x7FF;
    receive(frame, 0);
    TEST_ASSERT_EQUAL_UINT8(4, bus.taken);
    for (unsigned more = 0; more < 255u; more++) {
        receive(speed_frame(0, 42), 0); /* right, and repeated */
    }
    TEST_ASSERT_EQUAL_UINT8(3, bus.taken);
}

static void the_check_tells_frames_and_their_order_apart(void)
{
    static const uint8_t data[3] = {0x01, 0x02, 0x10};

    TEST_ASSERT_EQUAL_HEX8(0x00, canopy_bus_check(0, 0x100, data, 0));
    TEST_ASSERT_EQUAL_HEX8(0x13, canopy_bus_check(0, 0x100, data, 3));
    TEST_ASSERT_EQUAL_HEX8(0x13 ^ 0x23, canopy_bus_check(0, 0x123, data, 3));
    TEST_ASSERT_EQUAL_HEX8(0x0D, canopy_bus_check(0xA1, 0, data, 0)); /* rotated */
    TEST_ASSERT_NOT_EQUAL(canopy_bus_check(canopy_bus_check(0, 1, data, 3), 2, data, 2),
                          canopy_bus_check(canopy_bus_check(0, 2, data, 2), 1, data, 3));
}

static void outputs_take_their_safe_values_before_each_tick(void)
{
    output.torque = 99;
    canopy_bus_begin_tick(&bus, 0);
    TEST_ASSERT_EQUAL_UINT8(7, output.torque);
}

static void messages_go_out_at_their_rate_with_counter_and_crc(void)
{
    canopy_e2e_receiver_t receiver = {0};
    unsigned slow = 0;

    output.torque = 5;
    for (uint32_t tick = 0; tick < 30u; tick++) {
        canopy_bus_commit(&bus, &fake_can, tick);
    }
    for (unsigned frame = 0; frame < fake.tx_count; frame++) {
        if (fake.tx[frame].id == TORQUE_ID) {
            TEST_ASSERT_EQUAL(CANOPY_E2E_OK, canopy_e2e_check(&receiver, 2, fake.tx[frame].data, 3));
        } else {
            slow++;
        }
        TEST_ASSERT_EQUAL_UINT8(5, fake.tx[frame].data[2]);
    }
    TEST_ASSERT_EQUAL_UINT(10, slow);
    TEST_ASSERT_EQUAL_UINT32(40, bus.counters.sent);
}

static void a_frame_that_the_driver_does_not_take_is_dropped_and_counted(void)
{
    fake.tx_result = 0;
    canopy_bus_commit(&bus, &fake_can, 1);
    fake.tx_result = CANOPY_ERROR_BUS_DOWN;
    canopy_bus_commit(&bus, &fake_can, 2);
    TEST_ASSERT_EQUAL_UINT32(2, bus.counters.tx_dropped);
    TEST_ASSERT_EQUAL_UINT32(0, bus.counters.sent);
}

static void signed_values_are_extended(void)
{
    TEST_ASSERT_EQUAL_INT32(-1, canopy_sign_extend32(0xFFFFFFu, 24));
    TEST_ASSERT_EQUAL_INT32(-8388608, canopy_sign_extend32(0x800000u, 24));
    TEST_ASSERT_EQUAL_INT32(8388607, canopy_sign_extend32(0x7FFFFFu, 24));
    TEST_ASSERT_EQUAL_INT32(-1, canopy_sign_extend32(1, 1));
    TEST_ASSERT_TRUE(canopy_sign_extend64(UINT64_C(0x8000000000), 40) == -INT64_C(0x8000000000));
}

static void a_ticked_write_wins_over_a_halt_handlers_whichever_came_first(void)
{
    uint32_t written[2] = {0};

    TEST_ASSERT_TRUE(canopy_output_claim(written, 33, true));
    TEST_ASSERT_TRUE(canopy_output_claim(written, 33, false));
    TEST_ASSERT_FALSE(canopy_output_claim(written, 33, true));
    TEST_ASSERT_TRUE(canopy_output_claim(written, 33, false));
    TEST_ASSERT_TRUE(canopy_output_claim(written, 1, true));
}

/* One output and its setter, as the compiler makes them: 100 while driving, 5 by the halt handler, 0 is safe. */
static struct {
    uint32_t written[1];
    bool halting;
    int speed;
} motor;

static canopy_status_t arrived_says;

static void set_speed(int speed)
{
    if (canopy_output_claim(motor.written, 0, motor.halting)) {
        motor.speed = speed;
    }
}

static canopy_status_t drive(void *application, uint16_t parameter)
{
    (void)application;
    (void)parameter;
    set_speed(100);
    return CANOPY_RUNNING;
}

static void drive_halted(void *application, uint16_t parameter)
{
    (void)application;
    (void)parameter;
    motor.halting = true;
    set_speed(5);
    motor.halting = false;
}

static canopy_status_t arrived(void *application, uint16_t parameter)
{
    (void)application;
    (void)parameter;
    return arrived_says;
}

static canopy_tree_instance_t driving;

/** RunOnce, and below it a parallel node of two children, so that it runs to its end and is not started again. */
static void start_driving(canopy_node_type_t parallel, canopy_node_type_t first, canopy_node_type_t second)
{
    static const int32_t parameters[] = {1, 1};
    static const canopy_leaf_t leaves[] = {{.tick = arrived},
                                           {.tick = drive, .running = drive, .halted = drive_halted}};
    static canopy_node_t nodes[4];
    static canopy_tree_t tree = {.nodes = nodes,
                                 .leaves = leaves,
                                 .parameters = parameters,
                                 .node_count = 4,
                                 .leaf_count = 2,
                                 .parameter_count = 2,
                                 .word_count = 5};
    static uint8_t status[4];
    static uint16_t words[5];

    nodes[0] = (canopy_node_t){.type = CANOPY_NODE_RUN_ONCE, .end = 4};
    nodes[1] = (canopy_node_t){.type = (uint8_t)parallel, .end = 4, .state = 1};
    nodes[2] =
        (canopy_node_t){.type = (uint8_t)first, .parent = 1, .end = 3, .leaf = first == CANOPY_NODE_STATEFUL_ACTION};
    nodes[3] =
        (canopy_node_t){.type = (uint8_t)second, .parent = 1, .end = 4, .leaf = second == CANOPY_NODE_STATEFUL_ACTION};
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_tree_validate(&tree, NULL));
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_tree_init(&driving, &tree, status, words, NULL));
}

static int speed_after_tick(canopy_status_t arrived_status)
{
    motor.written[0] = 0;
    motor.speed = 0;
    arrived_says = arrived_status;
    (void)canopy_tree_tick(&driving, 0);
    return motor.speed;
}

/* Rule 5: ticked and halted in one tick, the child keeps what it wrote; in the next tick it is safe. */
static void a_child_of_a_parallel_ticked_and_halted_in_one_tick_keeps_what_it_wrote(void)
{
    start_driving(CANOPY_NODE_REACTIVE_PARALLEL, CANOPY_NODE_STATEFUL_ACTION, CANOPY_NODE_CONDITION);
    TEST_ASSERT_EQUAL_INT(100, speed_after_tick(CANOPY_FAILURE));
    TEST_ASSERT_EQUAL_INT(100, speed_after_tick(CANOPY_SUCCESS));
    TEST_ASSERT_EQUAL(CANOPY_IDLE, canopy_tree_status(&driving, 2));
    TEST_ASSERT_EQUAL_INT(0, speed_after_tick(CANOPY_SUCCESS));
}

/* A Parallel asks its thresholds after each child: one that comes before the action ends it before it is ticked. */
static void a_child_that_is_halted_and_not_ticked_leaves_what_its_handler_wrote(void)
{
    start_driving(CANOPY_NODE_PARALLEL, CANOPY_NODE_CONDITION, CANOPY_NODE_STATEFUL_ACTION);
    TEST_ASSERT_EQUAL_INT(100, speed_after_tick(CANOPY_SKIPPED));
    TEST_ASSERT_EQUAL_INT(5, speed_after_tick(CANOPY_SUCCESS));
    TEST_ASSERT_EQUAL_INT(0, speed_after_tick(CANOPY_SUCCESS));
}

static void constants_round_to_the_nearest_raw_value(void)
{
    const volatile double not_folded = -0.48; /* the same at run time */
    const int32_t raw = CANOPY_RAW(int32_t, not_folded, 0.001, 0.0);

    TEST_ASSERT_EQUAL_INT32(-480, raw);
    TEST_ASSERT_EQUAL_INT32(480, CANOPY_RAW(int32_t, 0.48, 0.001, 0.0));
    TEST_ASSERT_EQUAL_INT32(-480, CANOPY_RAW(int32_t, -0.48, 0.001, 0.0));
    TEST_ASSERT_EQUAL_INT32(29, CANOPY_RAW(int32_t, 0.29, 0.01, 0.0));
    TEST_ASSERT_EQUAL_INT32(140, CANOPY_RAW(int32_t, 100, 1.0, -40.0));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_good_frame_is_taken_and_becomes_stale);
    RUN_TEST(nothing_is_fresh_before_the_first_frame);
    RUN_TEST(without_a_timeout_a_message_stays_fresh);
    RUN_TEST(what_is_wrong_changes_nothing_but_a_counter);
    RUN_TEST(an_error_frame_is_no_message_whatever_its_id);
    RUN_TEST(what_was_taken_is_counted_and_checked_for_a_replay);
    RUN_TEST(the_check_tells_frames_and_their_order_apart);
    RUN_TEST(outputs_take_their_safe_values_before_each_tick);
    RUN_TEST(messages_go_out_at_their_rate_with_counter_and_crc);
    RUN_TEST(a_frame_that_the_driver_does_not_take_is_dropped_and_counted);
    RUN_TEST(signed_values_are_extended);
    RUN_TEST(a_ticked_write_wins_over_a_halt_handlers_whichever_came_first);
    RUN_TEST(a_child_of_a_parallel_ticked_and_halted_in_one_tick_keeps_what_it_wrote);
    RUN_TEST(a_child_that_is_halted_and_not_ticked_leaves_what_its_handler_wrote);
    RUN_TEST(constants_round_to_the_nearest_raw_value);
    return UNITY_END();
}
