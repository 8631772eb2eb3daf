/* SPDX-License-Identifier: MIT */
/** @file E2E Profile 11: known answers, and the receiver's rule. */
#include <stdbool.h>
#include <string.h>

#include "canopy/e2e.h"
#include "unity.h"

enum { DATA_ID = 0x1234, LENGTH = 8 };

static canopy_e2e_receiver_t receiver;

void setUp(void)
{
    receiver = (canopy_e2e_receiver_t){0};
}

void tearDown(void)
{
}

static canopy_e2e_result_t check(uint8_t counter)
{
    uint8_t data[LENGTH] = {0, 0xA0, 1, 2, 3, 4, 5, 6};

    canopy_e2e_protect(DATA_ID, counter, data, LENGTH);
    return canopy_e2e_check(&receiver, DATA_ID, data, LENGTH);
}

static void protect_gives_the_known_answer(void)
{
    /* From the PyPI package autosar-e2e 1.0.0: e2e_p11_protect(data, 0x1234) with counter 1. */
    static const uint8_t expected[LENGTH] = {0xC1, 0x01, 0x10, 0x20, 0x30, 0x40, 0x50, 0x60};
    uint8_t data[LENGTH] = {0, 0, 0x10, 0x20, 0x30, 0x40, 0x50, 0x60};

    canopy_e2e_protect(DATA_ID, 1, data, LENGTH);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, data, LENGTH);
}

/** The definition: the polynomial 0x1D, a bit at a time. */
static uint8_t crc_by_the_bit(uint8_t crc, uint8_t byte)
{
    crc ^= byte;
    for (unsigned bit = 0; bit < 8u; bit++) {
        crc = (uint8_t)((crc & 0x80u) != 0u ? ((unsigned)crc << 1) ^ 0x1Du : (unsigned)crc << 1);
    }
    return crc;
}

static void the_crc_is_the_definitions_for_every_crc_and_byte(void)
{
    bool seen[256] = {false};

    for (unsigned high = 0; high < 256u; high++) {
        uint8_t before = crc_by_the_bit(crc_by_the_bit(0, 0), (uint8_t)high);

        TEST_ASSERT_FALSE(seen[before]); /* so `before` takes each of the 256 values */
        seen[before] = true;
        for (unsigned byte = 0; byte < 256u; byte++) {
            const uint8_t data[2] = {0, (uint8_t)byte};

            TEST_ASSERT_EQUAL_HEX8(crc_by_the_bit(before, (uint8_t)byte),
                                   canopy_e2e_crc((uint16_t)(high << 8), data, 2));
        }
    }
}

static void protect_keeps_the_other_half_of_byte_1(void)
{
    uint8_t data[2] = {0, 0xAF};

    canopy_e2e_protect(DATA_ID, 14, data, 2);
    TEST_ASSERT_EQUAL_HEX8(0xAE, data[1]);
}

static void frames_in_order_pass_also_across_the_wrap(void)
{
    for (unsigned frame = 5; frame < 60u; frame++) {
        TEST_ASSERT_EQUAL(CANOPY_E2E_OK, check((uint8_t)(frame % CANOPY_E2E_COUNTERS)));
    }
}

static void a_repeated_frame_is_refused(void)
{
    TEST_ASSERT_EQUAL(CANOPY_E2E_OK, check(3));
    TEST_ASSERT_EQUAL(CANOPY_E2E_REPEATED, check(3));
    TEST_ASSERT_EQUAL(CANOPY_E2E_OK, check(4));
}

static void up_to_two_lost_frames_pass_and_more_cost_one_frame(void)
{
    TEST_ASSERT_EQUAL(CANOPY_E2E_OK, check(0));
    TEST_ASSERT_EQUAL(CANOPY_E2E_OK, check(3));
    TEST_ASSERT_EQUAL(CANOPY_E2E_WRONG_SEQUENCE, check(7));
    TEST_ASSERT_EQUAL(CANOPY_E2E_OK, check(8));
    TEST_ASSERT_EQUAL(CANOPY_E2E_WRONG_SEQUENCE, check(7));
}

static void every_damaged_bit_is_found(void)
{
    for (unsigned bit = 0; bit < 8u * LENGTH; bit++) {
        uint8_t data[LENGTH] = {0, 0, 1, 2, 3, 4, 5, 6};
        canopy_e2e_receiver_t before = receiver;

        canopy_e2e_protect(DATA_ID, 2, data, LENGTH);
        data[bit / 8u] ^= (uint8_t)(1u << (bit % 8u));
        TEST_ASSERT_EQUAL(CANOPY_E2E_WRONG_CRC, canopy_e2e_check(&receiver, DATA_ID, data, LENGTH));
        TEST_ASSERT_EQUAL_MEMORY(&before, &receiver, sizeof before);
    }
}

static void the_right_bytes_under_another_id_do_not_pass(void)
{
    uint8_t data[LENGTH] = {0, 0, 1, 2, 3, 4, 5, 6};

    canopy_e2e_protect(DATA_ID, 2, data, LENGTH);
    TEST_ASSERT_EQUAL(CANOPY_E2E_WRONG_CRC, canopy_e2e_check(&receiver, DATA_ID + 1, data, LENGTH));
}

static void counter_15_is_no_counter(void)
{
    TEST_ASSERT_EQUAL(CANOPY_E2E_WRONG_CRC, check(15));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(protect_gives_the_known_answer);
    RUN_TEST(the_crc_is_the_definitions_for_every_crc_and_byte);
    RUN_TEST(protect_keeps_the_other_half_of_byte_1);
    RUN_TEST(frames_in_order_pass_also_across_the_wrap);
    RUN_TEST(a_repeated_frame_is_refused);
    RUN_TEST(up_to_two_lost_frames_pass_and_more_cost_one_frame);
    RUN_TEST(every_damaged_bit_is_found);
    RUN_TEST(the_right_bytes_under_another_id_do_not_pass);
    RUN_TEST(counter_15_is_no_counter);
    return UNITY_END();
}
