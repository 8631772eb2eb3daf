/* SPDX-License-Identifier: MIT */
/** @file The generated code of the application "features": ports, state, staleness, saturation, who wins an output. */
#include <string.h>

#include "fake_loop.h"
#include "features_app.h"
#include "unity.h"

enum { CLIMATE_ID = 0x18FECA15 };

void setUp(void)
{
    fake_loop_start(&features_app);
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_tree_validate(features_app.tree, NULL));
}

void tearDown(void)
{
}

/** One cycle, with a Climate frame that shows this temperature. */
static canopy_status_t cycle_at(int degrees)
{
    int16_t raw = (int16_t)((degrees - 10) * 2);
    canopy_can_frame_t *frame = &fake.rx[0];

    *frame = (canopy_can_frame_t){.id = CLIMATE_ID, .flags = CANOPY_CAN_EXTENDED, .length = 8};
    frame->data[0] = (uint8_t)((uint16_t)raw >> 8);
    frame->data[1] = (uint8_t)((uint16_t)raw & 0xFFu);
    frame->data[2] = 0x06;
    memset(&frame->data[3], 0x11, 5);
    return fake_loop_cycle(1);
}

static void signals_reach_the_input_image(void)
{
    (void)cycle_at(-3);
    TEST_ASSERT_EQUAL_INT16(-26, features_input->climate.temperature);
    TEST_ASSERT_EQUAL_INT32(-26, FEATURES_CLIMATE_TEMPERATURE(-3.0));
    TEST_ASSERT_EQUAL_UINT8(FEATURES_CLIMATE_DOOR_OPEN, features_input->climate.door);
    TEST_ASSERT_TRUE(features_input->climate.window);
    TEST_ASSERT_TRUE(features_input->climate.uptime == UINT64_C(0x1111111111));
    TEST_ASSERT_TRUE(features_input->climate.fresh);
}

static void ports_and_state_belong_to_each_use_of_a_leaf(void)
{
    /* Warm: "cool" is active, with its own ports. */
    TEST_ASSERT_EQUAL(CANOPY_RUNNING, cycle_at(60));
    TEST_ASSERT_EQUAL_UINT16(700, features_output->fan.speed);
    TEST_ASSERT_TRUE(features_output->fan.turbo);
    TEST_ASSERT_EQUAL_UINT8(FEATURES_FAN_MODE_LOW_NOISE, features_output->fan.mode);
    /* Cool: "cool" is halted, "cool a little" starts; what it writes wins over what the halt handler wrote. */
    TEST_ASSERT_EQUAL(CANOPY_RUNNING, cycle_at(20));
    TEST_ASSERT_EQUAL_UINT16(200, features_output->fan.speed);
    TEST_ASSERT_FALSE(features_output->fan.turbo);
    TEST_ASSERT_EQUAL(CANOPY_RUNNING, cycle_at(20));
    TEST_ASSERT_EQUAL(CANOPY_SUCCESS, cycle_at(20));
}

static void a_halt_handlers_write_stands_when_nothing_else_writes(void)
{
    TEST_ASSERT_EQUAL(CANOPY_RUNNING, cycle_at(60));
    TEST_ASSERT_EQUAL(CANOPY_FAILURE, cycle_at(-40));
    TEST_ASSERT_EQUAL_UINT16(50, features_output->fan.speed);
    TEST_ASSERT_EQUAL_UINT8(FEATURES_FAN_MODE_SAFE_MODE, features_output->fan.mode);
}

static void stale_leaves_answer_as_declared_and_running_ones_are_halted(void)
{
    TEST_ASSERT_EQUAL(CANOPY_RUNNING, cycle_at(60));
    fake.rx_count = 0;
    fake.rx_taken = 0;
    time += 100000; /* five times the cycle time of 20 ms */
    TEST_ASSERT_EQUAL(CANOPY_FAILURE, canopy_loop_cycle(&loop, time));
    TEST_ASSERT_FALSE(features_input->climate.fresh);
    TEST_ASSERT_EQUAL_UINT16(50, features_output->fan.speed);
    TEST_ASSERT_TRUE(features_output->fan.turbo);
    TEST_ASSERT_EQUAL_UINT32(1, features_app.bus_state->counters.timeouts);
    /* IsWarm says SUCCESS when stale, so NoteTick has run. */
    TEST_ASSERT_EQUAL_UINT16(11, features_output->fan.ticks);
}

static void outputs_saturate_and_are_counted(void)
{
    uint32_t before = features_output->saturated;

    (void)cycle_at(20);
    features_set_fan_trim(features_output, 1000);
    TEST_ASSERT_EQUAL_INT8(100, features_output->fan.trim);
    features_set_fan_trim(features_output, -1000);
    TEST_ASSERT_EQUAL_INT8(-100, features_output->fan.trim);
    features_set_fan_trim(features_output, -100);
    features_set_fan_speed(features_output, 801);
    TEST_ASSERT_EQUAL_UINT16(800, features_output->fan.speed);
    features_set_fan_mode(features_output, (features_fan_mode_t)2);
    TEST_ASSERT_EQUAL_UINT8(FEATURES_FAN_MODE_SAFE_MODE, features_output->fan.mode);
    TEST_ASSERT_EQUAL_UINT32(before + 4u, features_output->saturated);
}

static void outputs_reach_the_wire(void)
{
    /* Motorola: Speed's 12 bits are byte 0 and the high half of byte 1. */
    static const uint8_t expected[] = {700 >> 4, (700 & 0xF) << 4, 0x01 | (1 << 1), 0, 1, 0};

    (void)cycle_at(60);
    TEST_ASSERT_EQUAL_UINT(1, fake.tx_count);
    TEST_ASSERT_EQUAL_HEX32(300, fake.tx[0].id);
    TEST_ASSERT_EQUAL_UINT8(6, fake.tx[0].length);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, fake.tx[0].data, 6);
    /* Every 20 ms, and the period is 10 ms. */
    (void)cycle_at(60);
    TEST_ASSERT_EQUAL_UINT(0, fake.tx_count);
    (void)cycle_at(60);
    TEST_ASSERT_EQUAL_UINT(1, fake.tx_count);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(signals_reach_the_input_image);
    RUN_TEST(ports_and_state_belong_to_each_use_of_a_leaf);
    RUN_TEST(a_halt_handlers_write_stands_when_nothing_else_writes);
    RUN_TEST(stale_leaves_answer_as_declared_and_running_ones_are_halted);
    RUN_TEST(outputs_saturate_and_are_counted);
    RUN_TEST(outputs_reach_the_wire);
    return UNITY_END();
}
