/* SPDX-License-Identifier: MIT */
/** @file A generated codec with nested multiplexers and floats: what is taken, what is kept, what is refused. */
#include <float.h>
#include <string.h>

#include "gripper_codec.h"
#include "unity.h"

static gripper_parameter_t parameter;
static gripper_pose_t pose;

void setUp(void)
{
    gripper_parameter_init(&parameter);
    gripper_pose_init(&pose);
}

void tearDown(void)
{
}

static void only_the_selected_branch_is_taken(void)
{
    static const uint8_t force[8] = {1, 0, 0, 0x41, 0x20, 0, 0, 0xF6};     /* 10.0f, Motorola; -10 degrees */
    static const uint8_t serial[8] = {9, 0, 0x78, 0x56, 0x34, 0x12, 0, 7}; /* page 0 of selector 9 */

    TEST_ASSERT_EQUAL(CANOPY_CODEC_OK, gripper_parameter_decode(&parameter, force, sizeof force));
    TEST_ASSERT_TRUE(parameter.has_force);
    TEST_ASSERT_EQUAL_HEX32(0x41200000, canopy_float32_bits(parameter.force));
    TEST_ASSERT_EQUAL_INT8(-10, parameter.temperature);
    TEST_ASSERT_FALSE(parameter.has_page);
    TEST_ASSERT_EQUAL(CANOPY_CODEC_OK, gripper_parameter_decode(&parameter, serial, sizeof serial));
    TEST_ASSERT_TRUE(parameter.has_page && parameter.has_serial);
    TEST_ASSERT_FALSE(parameter.has_hours);
    TEST_ASSERT_EQUAL_HEX32(0x12345678, parameter.serial);
    /* Kept, but not in this frame. */
    TEST_ASSERT_FALSE(parameter.has_force);
    TEST_ASSERT_EQUAL_HEX32(0x41200000, canopy_float32_bits(parameter.force));
}

static void what_is_refused_changes_nothing(void)
{
    static const uint8_t refused[][8] = {
        {3},                         /* no branch 3 */
        {2, 2},                      /* no page 2 */
        {1, 0, 0, 0x7F, 0xC0},       /* NaN */
        {1, 0, 0, 0x7F, 0x80},       /* infinity */
        {1, 0, 0, 0x42, 0x48, 0, 1}, /* the next number above 50 */
        {1, 0, 0, 0x80, 0, 0, 1},    /* the next number below 0 */
        {0x02, 1, 0x61, 0xEA, 0, 0}, /* 60001 is more than 6000 h */
        {1, 0, 0, 0, 0, 0, 0, 0x79}, /* 121 degrees */
    };
    const gripper_parameter_t before = parameter;

    for (unsigned row = 0; row < sizeof refused / sizeof refused[0]; row++) {
        TEST_ASSERT_EQUAL(CANOPY_CODEC_OUT_OF_RANGE, gripper_parameter_decode(&parameter, refused[row], 8));
    }
    TEST_ASSERT_EQUAL(CANOPY_CODEC_WRONG_LENGTH, gripper_parameter_decode(&parameter, refused[0], 7));
    TEST_ASSERT_EQUAL_MEMORY(&before, &parameter, sizeof before);
}

static void minus_zero_is_zero(void)
{
    static const uint8_t data[8] = {1, 0, 0, 0x80};

    TEST_ASSERT_EQUAL(CANOPY_CODEC_OK, gripper_parameter_decode(&parameter, data, sizeof data));
}

static void encode_writes_one_branch_and_limits(void)
{
    static const uint8_t expected[8] = {1, 0, 0, 0x42, 0x48, 0, 0, 120};
    uint8_t data[8];

    parameter.selector = 1;
    parameter.force = canopy_float32_value(0x7F000000); /* far above 50 */
    parameter.page = 1;
    parameter.hours = 0xFFFF; /* not sent, so not counted */
    parameter.temperature = 127;
    TEST_ASSERT_EQUAL_INT(2, gripper_parameter_encode(&parameter, data, sizeof data));
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, data, 8);
    parameter.selector = 77; /* becomes 1, as init gives it */
    TEST_ASSERT_EQUAL_INT(3, gripper_parameter_encode(&parameter, data, sizeof data));
    TEST_ASSERT_EQUAL_UINT8(1, data[0]);
    TEST_ASSERT_EQUAL_INT(CANOPY_CODEC_WRONG_LENGTH, gripper_parameter_encode(&parameter, data, 7));
}

static void doubles_keep_their_bits_and_nan_becomes_the_safe_value(void)
{
    static const uint8_t data[8] = {1, 2, 3, 4, 5, 6, 7, 0x40};
    uint8_t sent[8];

    TEST_ASSERT_EQUAL(CANOPY_CODEC_OK, gripper_pose_decode(&pose, data, sizeof data));
    TEST_ASSERT_EQUAL_INT(0, gripper_pose_encode(&pose, sent, sizeof sent));
    TEST_ASSERT_EQUAL_HEX8_ARRAY(data, sent, 8);
    pose.width = canopy_float64_value(UINT64_C(0xFFF8000000000000));
    TEST_ASSERT_EQUAL_INT(1, gripper_pose_encode(&pose, sent, sizeof sent));
    TEST_ASSERT_EACH_EQUAL_HEX8(0, sent, 8);
    pose.width = canopy_float64_value(UINT64_C(0x7FF0000000000000));
    TEST_ASSERT_EQUAL_INT(1, gripper_pose_encode(&pose, sent, sizeof sent));
    pose.width = DBL_MAX;
    TEST_ASSERT_EQUAL_INT(0, gripper_pose_encode(&pose, sent, sizeof sent));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(only_the_selected_branch_is_taken);
    RUN_TEST(what_is_refused_changes_nothing);
    RUN_TEST(minus_zero_is_zero);
    RUN_TEST(encode_writes_one_branch_and_limits);
    RUN_TEST(doubles_keep_their_bits_and_nan_becomes_the_safe_value);
    return UNITY_END();
}
