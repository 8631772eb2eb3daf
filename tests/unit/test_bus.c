/* SPDX-License-Identifier: MIT */
/** @file Frames into the input image and out of the output image: what is refused changes nothing but a counter. */
#include <string.h>

#include "canopy/bus.h"
#include "fake_can.h"
#include "unity.h"

typedef struct {
    canopy_time_t now;
    canopy_can_state_t can_state;
    bool overload;
    uint8_t speed;
    bool speed_fresh;
    uint16_t speed_age;
    uint8_t plain;
    bool plain_fresh;
    uint16_t plain_age;
} input_t;

typedef struct {
    uint8_t torque;
} output_t;

enum { SPEED_ID = 0x100, PLAIN_ID = 0x100, TORQUE_ID = 0x200, SPEED_MAX = 200, TIMEOUT_US = 5000, DEADLINE_US = 10000 };

static input_t input;
static output_t output;
static canopy_rx_state_t rx_states[2];
static canopy_bus_state_t bus;
static canopy_tx_slot_t slots[2];
static canopy_tx_trace_t trace[1];
static uint8_t tx_data[12];
static canopy_tx_t transmit;

static bool decode_speed(void *image, const uint8_t *data)
{
    if (data[2] > SPEED_MAX) {
        return false;
    }
    ((input_t *)image)->speed = data[2];
    return true;
}

static void speed_age(void *image, bool fresh, uint16_t age_ms)
{
    ((input_t *)image)->speed_fresh = fresh;
    ((input_t *)image)->speed_age = age_ms;
}

static bool decode_plain(void *image, const uint8_t *data)
{
    ((input_t *)image)->plain = data[0];
    return true;
}

static void plain_age(void *image, bool fresh, uint16_t age_ms)
{
    ((input_t *)image)->plain_fresh = fresh;
    ((input_t *)image)->plain_age = age_ms;
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

static void set_cycle(void *image, const canopy_cycle_t *cycle)
{
    ((input_t *)image)->now = cycle->now;
    ((input_t *)image)->can_state = cycle->can_state;
    ((input_t *)image)->overload = cycle->overload;
}

/* The second message has the same number as the first, as an extended id. */
static const canopy_rx_message_t rx[] = {
    {.id = SPEED_ID, .length = 3, .data_id = 1, .timeout = TIMEOUT_US, .decode = decode_speed, .set_age = speed_age},
    {.id = PLAIN_ID,
     .flags = CANOPY_CAN_EXTENDED,
     .length = 1,
     .data_id = CANOPY_E2E_NONE,
     .decode = decode_plain,
     .set_age = plain_age},
};
static const canopy_tx_message_t tx[] = {
    {.id = TORQUE_ID, .length = 3, .data_id = 2, .every = 1, .deadline = DEADLINE_US, .encode = encode_torque},
    {.id = TORQUE_ID + 1,
     .length = 3,
     .data_id = CANOPY_E2E_NONE,
     .every = 3,
     .place = 6,
     .deadline = 3u * (canopy_time_t)DEADLINE_US,
     .encode = encode_torque},
};
static const canopy_bus_t tables = {
    .rx = rx, .tx = tx, .rx_count = 2, .tx_count = 2, .reset_output = reset_output, .set_cycle = set_cycle};

void setUp(void)
{
    fake_can_reset();
    memset(&input, 0, sizeof input);
    output = (output_t){0};
    memset(rx_states, 0, sizeof rx_states);
    bus = (canopy_bus_state_t){.bus = &tables, .input = &input, .output = &output, .rx = rx_states};
    TEST_ASSERT_EQUAL(
        CANOPY_OK,
        canopy_tx_init(&transmit, tx, 2,
                       &(canopy_tx_memory_t){.slots = slots, .data = tx_data, .trace = trace, .trace_capacity = 1},
                       &fake_can));
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

/** Taken as soon as it has arrived. */
static void receive(canopy_can_frame_t frame, canopy_time_t now)
{
    frame.time = now;
    canopy_bus_receive(&bus, &frame, now);
}

static void receive_late(canopy_can_frame_t frame, canopy_time_t arrived, canopy_time_t now)
{
    frame.time = arrived;
    canopy_bus_receive(&bus, &frame, now);
}

static void begin_tick(canopy_time_t now)
{
    canopy_bus_begin_tick(&bus, &(canopy_cycle_t){.now = now});
}

static void a_good_frame_is_taken_and_becomes_stale(void)
{
    receive(speed_frame(0, 42), 1000);
    begin_tick(1000);
    TEST_ASSERT_EQUAL_UINT8(42, input.speed);
    TEST_ASSERT_TRUE(input.speed_fresh);
    TEST_ASSERT_EQUAL_UINT64(1000, input.now);
    begin_tick(1000 + TIMEOUT_US - 1);
    TEST_ASSERT_TRUE(input.speed_fresh);
    begin_tick(1000 + TIMEOUT_US);
    TEST_ASSERT_FALSE(input.speed_fresh);
    TEST_ASSERT_EQUAL_UINT32(1, bus.counters.timeouts);
    begin_tick(2000 + TIMEOUT_US);
    TEST_ASSERT_EQUAL_UINT32(1, bus.counters.timeouts);
    receive(speed_frame(1, 43), 3000 + TIMEOUT_US);
    begin_tick(3000 + TIMEOUT_US);
    TEST_ASSERT_TRUE(input.speed_fresh);
}

static void nothing_is_fresh_before_the_first_frame(void)
{
    begin_tick(0);
    TEST_ASSERT_FALSE(input.speed_fresh);
    TEST_ASSERT_FALSE(input.plain_fresh);
    TEST_ASSERT_EQUAL_UINT32(0, bus.counters.timeouts);
}

static void without_a_timeout_a_message_stays_fresh(void)
{
    canopy_can_frame_t frame = {.id = PLAIN_ID, .flags = CANOPY_CAN_EXTENDED, .length = 1, .data = {9}};

    receive(frame, 0);
    begin_tick(UINT64_MAX / 4u);
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
    begin_tick(0);
    TEST_ASSERT_EQUAL_UINT8(7, output.torque);
}

static void messages_go_out_at_their_rate_with_counter_and_crc(void)
{
    canopy_e2e_receiver_t receiver = {0};
    canopy_tx_counters_t counters;
    unsigned slow = 0;

    output.torque = 5;
    for (uint32_t tick = 0; tick < 30u; tick++) {
        canopy_bus_commit(&bus, &transmit, tick, tick);
        canopy_tx_kick(&transmit, tick);
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
    canopy_tx_count(&transmit, &counters);
    TEST_ASSERT_EQUAL_UINT32(40, counters.sent);
}

static void each_message_has_its_own_deadline_after_the_tick(void)
{
    canopy_tx_counters_t counters;

    canopy_bus_commit(&bus, &transmit, 0, 1000);
    canopy_tx_kick(&transmit, 1000 + DEADLINE_US);
    TEST_ASSERT_EQUAL_UINT(1, fake.tx_count);
    TEST_ASSERT_EQUAL_HEX32(TORQUE_ID + 1, fake.tx[0].id);
    canopy_tx_count(&transmit, &counters);
    TEST_ASSERT_EQUAL_UINT32(1, counters.expired);
}

static void all_messages_can_be_posted_with_one_deadline(void)
{
    canopy_bus_commit_all(&bus, &transmit, 500);
    canopy_tx_kick(&transmit, 499);
    TEST_ASSERT_EQUAL_UINT(2, fake.tx_count);
    canopy_bus_commit_all(&bus, &transmit, 500);
    canopy_tx_kick(&transmit, 500);
    TEST_ASSERT_EQUAL_UINT(2, fake.tx_count);
}

/* --- ages ---------------------------------------------------------------------------------------------------------- */

static uint16_t speed_age_of(canopy_time_t age)
{
    const canopy_time_t now = UINT64_C(1) << 40;

    memset(rx_states, 0, sizeof rx_states);
    receive_late(speed_frame(0, 42), now - age, now);
    return rx_states[0].age_ms;
}

static void ages_are_whole_milliseconds_rounded_up(void)
{
    TEST_ASSERT_EQUAL_UINT16(0, speed_age_of(0));
    TEST_ASSERT_EQUAL_UINT16(1, speed_age_of(1));
    TEST_ASSERT_EQUAL_UINT16(1, speed_age_of(1000));
    TEST_ASSERT_EQUAL_UINT16(2, speed_age_of(1001));
    TEST_ASSERT_EQUAL_UINT16(65533, speed_age_of(65533000));
    TEST_ASSERT_EQUAL_UINT16(65534, speed_age_of(65533001));
    TEST_ASSERT_EQUAL_UINT16(65534, speed_age_of(65534000));
    TEST_ASSERT_EQUAL_UINT16(CANOPY_AGE_MAX, speed_age_of(65534001));
    TEST_ASSERT_EQUAL_UINT16(CANOPY_AGE_MAX, speed_age_of(65535001)); /* 0 in 16 bits */
    TEST_ASSERT_EQUAL_UINT16(CANOPY_AGE_MAX, speed_age_of(65536000));
    TEST_ASSERT_EQUAL_UINT16(CANOPY_AGE_MAX, speed_age_of(UINT64_C(1) << 32)); /* 0 in 32 bits */
    TEST_ASSERT_EQUAL_UINT16(CANOPY_AGE_MAX, speed_age_of((UINT64_C(1) << 32) + 1000u));
}

/* However long its timeout: when it was sent is not known any more. */
static void a_value_whose_age_cannot_be_told_is_not_fresh(void)
{
    const canopy_time_t now = UINT64_C(1) << 40;
    const canopy_rx_message_t patient[] = {
        {.id = SPEED_ID, .length = 3, .data_id = 1, .timeout = 100000000, .decode = decode_speed, .set_age = speed_age},
        rx[1]};
    canopy_bus_t patient_tables = tables;

    patient_tables.rx = patient;
    bus.bus = &patient_tables;
    receive_late(speed_frame(0, 42), now - 65534000, now);
    begin_tick(now);
    TEST_ASSERT_TRUE(input.speed_fresh);
    receive_late(speed_frame(1, 42), now - 65534001, now);
    begin_tick(now);
    TEST_ASSERT_FALSE(input.speed_fresh);
}

static void a_frame_that_came_after_the_cycle_began_has_the_age_0(void)
{
    receive_late(speed_frame(0, 42), 1500, 1000);
    begin_tick(1000);
    TEST_ASSERT_TRUE(input.speed_fresh);
    TEST_ASSERT_EQUAL_UINT16(0, input.speed_age);
    begin_tick(1000 + TIMEOUT_US - 1); /* and counts from the cycle on: what was told is what counts */
    TEST_ASSERT_TRUE(input.speed_fresh);
    begin_tick(1000 + TIMEOUT_US);
    TEST_ASSERT_FALSE(input.speed_fresh);
}

static void timeouts_count_from_the_wire_not_from_the_drain(void)
{
    receive_late(speed_frame(0, 42), 1000, 4000); /* 3 ms in a queue */
    begin_tick(4000);
    TEST_ASSERT_TRUE(input.speed_fresh);
    TEST_ASSERT_EQUAL_UINT16(3, input.speed_age);
    begin_tick(1000 + TIMEOUT_US - 1);
    TEST_ASSERT_TRUE(input.speed_fresh);
    TEST_ASSERT_EQUAL_UINT16(5, input.speed_age);
    begin_tick(1000 + TIMEOUT_US);
    TEST_ASSERT_FALSE(input.speed_fresh);
    TEST_ASSERT_EQUAL_UINT16(CANOPY_AGE_MAX, input.speed_age);
    TEST_ASSERT_EQUAL_UINT32(1, bus.counters.timeouts);
}

static void what_is_rounded_up_is_never_called_fresher_than_it_is(void)
{
    receive_late(speed_frame(0, 42), 1001, 4000); /* 2.999 ms: told, and counted, as 3 */
    begin_tick(1000 + TIMEOUT_US);
    TEST_ASSERT_FALSE(input.speed_fresh);
}

static void a_frame_that_is_stale_when_it_is_taken_is_never_fresh(void)
{
    receive_late(speed_frame(0, 42), 0, TIMEOUT_US);
    begin_tick(TIMEOUT_US);
    TEST_ASSERT_FALSE(input.speed_fresh);
    TEST_ASSERT_EQUAL_UINT32(1, bus.counters.accepted);
    receive_late(speed_frame(1, 43), TIMEOUT_US, TIMEOUT_US + UINT64_C(70000000)); /* too old for a number */
    begin_tick(TIMEOUT_US + UINT64_C(70000000));
    TEST_ASSERT_FALSE(input.speed_fresh);
}

static void without_a_timeout_even_the_oldest_frame_is_fresh(void)
{
    canopy_can_frame_t frame = {.id = PLAIN_ID, .flags = CANOPY_CAN_EXTENDED, .length = 1, .data = {9}};

    receive_late(frame, 0, UINT64_C(70000000));
    begin_tick(UINT64_C(70000000));
    TEST_ASSERT_TRUE(input.plain_fresh);
    TEST_ASSERT_EQUAL_UINT16(CANOPY_AGE_MAX, input.plain_age);
    receive_late(frame, UINT64_C(70000000), UINT64_C(70000000));
    begin_tick(UINT64_C(70000000) + 65534000u);
    TEST_ASSERT_EQUAL_UINT16(65534, input.plain_age);
    begin_tick(UINT64_C(70000000) + 65534001u);
    TEST_ASSERT_TRUE(input.plain_fresh);
    TEST_ASSERT_EQUAL_UINT16(CANOPY_AGE_MAX, input.plain_age);
}

static void ages_are_right_across_the_wrap_of_time(void)
{
    receive_late(speed_frame(0, 42), UINT64_MAX - 999u, 1000); /* 2 ms ago */
    begin_tick(1000);
    TEST_ASSERT_TRUE(input.speed_fresh);
    TEST_ASSERT_EQUAL_UINT16(2, input.speed_age);
    begin_tick(TIMEOUT_US - 1000 - 1);
    TEST_ASSERT_TRUE(input.speed_fresh);
    begin_tick(TIMEOUT_US - 1000);
    TEST_ASSERT_FALSE(input.speed_fresh);
}

static void what_is_stale_stays_so_when_time_has_gone_half_round(void)
{
    receive(speed_frame(0, 42), 0);
    begin_tick(TIMEOUT_US);
    TEST_ASSERT_FALSE(input.speed_fresh);
    begin_tick((UINT64_C(1) << 63) + TIMEOUT_US + 1u); /* before the deadline, seen across the wrap */
    TEST_ASSERT_FALSE(input.speed_fresh);
}

static void a_refused_frame_does_not_make_what_is_there_younger(void)
{
    canopy_can_frame_t damaged = speed_frame(1, 50);

    damaged.data[2] ^= 1u;
    receive(speed_frame(0, 42), 1000);
    begin_tick(1000);
    receive(damaged, 4000);
    begin_tick(4000);
    TEST_ASSERT_EQUAL_UINT16(3, input.speed_age);
    TEST_ASSERT_TRUE(rx_states[0].taken_then); /* and it is told that one came */
    TEST_ASSERT_EQUAL_UINT16(0, rx_states[0].age_ms);
}

static void leaves_see_the_state_of_the_bus(void)
{
    canopy_bus_begin_tick(&bus, &(canopy_cycle_t){.now = 5, .can_state = CANOPY_CAN_BLOCKED, .overload = true});
    TEST_ASSERT_EQUAL_UINT64(5, input.now);
    TEST_ASSERT_EQUAL(CANOPY_CAN_BLOCKED, input.can_state);
    TEST_ASSERT_TRUE(input.overload);
    begin_tick(6);
    TEST_ASSERT_EQUAL(CANOPY_CAN_ERROR_ACTIVE, input.can_state);
    TEST_ASSERT_FALSE(input.overload);
}

/* --- the check ----------------------------------------------------------------------------------------------------- */

/** By its definition in docs/trace.md. */
static uint8_t rotated(uint8_t check)
{
    return (uint8_t)((unsigned)check << 3 | (unsigned)check >> 5);
}

static void the_check_folds_in_ages_and_the_state_of_the_bus(void)
{
    uint8_t check;

    receive_late(speed_frame(0, 42), 0, UINT64_C(259000)); /* 259 = 0x103 ms */
    check = bus.check;
    canopy_bus_begin_tick(&bus, &(canopy_cycle_t){.now = 259000, .can_state = CANOPY_CAN_BUS_OFF, .overload = true});
    check = rotated(check) ^ 0x01u ^ 0x03u;
    check = rotated(check) ^ 4u ^ 8u;
    TEST_ASSERT_EQUAL_HEX8(check, bus.check);
    begin_tick(260000); /* no frame was taken: only the state */
    TEST_ASSERT_EQUAL_HEX8(rotated(check), bus.check);
    TEST_ASSERT_FALSE(rx_states[0].taken_then);
}

static void frames_find_their_message_in_any_order(void)
{
    static const char order[] = "sspspppus?pp?s";
    uint8_t counter = 0;
    uint8_t value = 0;

    for (const char *next = order; *next != '\0'; next++) {
        canopy_can_frame_t frame = speed_frame(counter, ++value % 100u);

        if (*next == 'p') {
            frame = (canopy_can_frame_t){.id = PLAIN_ID, .flags = CANOPY_CAN_EXTENDED, .length = 1, .data = {value}};
        } else if (*next == 'u') {
            frame.flags = CANOPY_CAN_ERROR;
        } else if (*next == '?') {
            frame.id = SPEED_ID + 1u;
        } else {
            counter++;
        }
        canopy_bus_receive(&bus, &frame, 0);
        if (*next == 's' || *next == 'p') {
            TEST_ASSERT_EQUAL_UINT8(value, *next == 's' ? input.speed : input.plain);
        }
    }
    TEST_ASSERT_EQUAL_UINT32(11, bus.counters.accepted);
    TEST_ASSERT_EQUAL_UINT32(3, bus.counters.unknown_id);
}

static void an_application_that_receives_nothing_knows_no_frame(void)
{
    static const canopy_bus_t nothing = {.reset_output = reset_output, .set_cycle = set_cycle};
    canopy_can_frame_t frame = speed_frame(0, 1);

    bus.bus = &nothing;
    canopy_bus_receive(&bus, &frame, 0);
    canopy_bus_receive(&bus, &frame, 0);
    TEST_ASSERT_EQUAL_UINT32(2, bus.counters.unknown_id);
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
    RUN_TEST(each_message_has_its_own_deadline_after_the_tick);
    RUN_TEST(all_messages_can_be_posted_with_one_deadline);
    RUN_TEST(ages_are_whole_milliseconds_rounded_up);
    RUN_TEST(a_value_whose_age_cannot_be_told_is_not_fresh);
    RUN_TEST(a_frame_that_came_after_the_cycle_began_has_the_age_0);
    RUN_TEST(timeouts_count_from_the_wire_not_from_the_drain);
    RUN_TEST(what_is_rounded_up_is_never_called_fresher_than_it_is);
    RUN_TEST(a_frame_that_is_stale_when_it_is_taken_is_never_fresh);
    RUN_TEST(without_a_timeout_even_the_oldest_frame_is_fresh);
    RUN_TEST(ages_are_right_across_the_wrap_of_time);
    RUN_TEST(what_is_stale_stays_so_when_time_has_gone_half_round);
    RUN_TEST(a_refused_frame_does_not_make_what_is_there_younger);
    RUN_TEST(leaves_see_the_state_of_the_bus);
    RUN_TEST(the_check_folds_in_ages_and_the_state_of_the_bus);
    RUN_TEST(frames_find_their_message_in_any_order);
    RUN_TEST(an_application_that_receives_nothing_knows_no_frame);
    return UNITY_END();
}
