/* SPDX-License-Identifier: MIT */
/** @file Frames as bits: against a known CRC, and against rules that any frame keeps. */
#include "frame_bits.h"
#include "unity.h"
#include "world.h"

enum { SAMPLES = 20000 };

void setUp(void)
{
}

void tearDown(void)
{
}

/* The check value of CRC-15/CAN in the catalogue of parametrised CRC algorithms: of the bytes "123456789". */
static void test_the_crc_has_its_check_value(void)
{
    const char *text = "123456789";
    uint8_t bits[72];

    for (unsigned bit = 0; bit < sizeof bits; bit++) {
        bits[bit] = (uint8_t)(((unsigned)text[bit / 8u] >> (7u - bit % 8u)) & 1u);
    }
    TEST_ASSERT_EQUAL_HEX16(0x059E, frame_crc(bits, sizeof bits));
}

/* 47 bits and 8 a byte, 67 for an extended one, without stuff bits: Bosch, chapter 3.1.1, intermission included. */
static void test_fields_have_their_widths(void)
{
    uint8_t bits[FRAME_BITS_MAX];

    for (uint8_t length = 0; length <= 8u; length++) {
        const canopy_can_frame_t standard = {.id = 0x2AA, .length = length};
        const canopy_can_frame_t extended = {.id = 0x2AAAAAA, .flags = CANOPY_CAN_EXTENDED, .length = length};
        const canopy_can_frame_t remote = {.id = 0x2AA, .flags = CANOPY_CAN_REMOTE, .length = length};

        TEST_ASSERT_EQUAL_UINT(47u + 8u * length, frame_fields(&standard, bits) + 15u + FRAME_TAIL);
        TEST_ASSERT_EQUAL_UINT(67u + 8u * length, frame_fields(&extended, bits) + 15u + FRAME_TAIL);
        TEST_ASSERT_EQUAL_UINT(47u, frame_fields(&remote, bits) + 15u + FRAME_TAIL);
    }
}

static canopy_can_frame_t random_frame(uint32_t *random)
{
    canopy_can_frame_t frame = {.length = (uint8_t)random_between(random, 0, 8)};
    bool sparse = random_between(random, 0, 1) == 0u; /* long runs of equal bits */

    frame.flags = random_between(random, 0, 1) == 0u ? CANOPY_CAN_EXTENDED : 0u;
    frame.id = random_next(random) & (frame.flags != 0u ? UINT32_C(0x1FFFFFFF) : 0x7FFu);
    for (unsigned byte = 0; byte < frame.length; byte++) {
        frame.data[byte] = (uint8_t)(sparse ? 0xFFu * (random_next(random) & 1u) : random_next(random) >> 24);
    }
    return frame;
}

/** Takes stuff bits out again. @return bits left; 0: six in a row were equal */
static unsigned unstuff(const uint8_t *bits, unsigned count, uint8_t *plain)
{
    unsigned kept = 0;
    unsigned run = 0;
    bool is_stuff = false;

    for (unsigned index = 0; index < count; index++) {
        run = index > 0u && bits[index] == bits[index - 1u] ? run + 1u : 1u;
        if (run > 5u) {
            return 0;
        }
        if (!is_stuff) {
            plain[kept++] = bits[index];
        }
        is_stuff = run == 5u;
    }
    return kept;
}

/* The receiver's view: no six equal bits, without stuff bits the fields, and with the CRC the remainder is 0. */
static void test_any_frame_can_be_received(void)
{
    uint32_t random = 4711;

    for (unsigned sample = 0; sample < SAMPLES; sample++) {
        const canopy_can_frame_t frame = random_frame(&random);
        const unsigned fixed = (frame.flags & CANOPY_CAN_EXTENDED) != 0u ? 67u : 47u;
        const unsigned stuffed = (fixed == 67u ? 54u : 34u) + 8u * frame.length;
        uint8_t bits[FRAME_BITS_MAX];
        uint8_t plain[FRAME_BITS_MAX];
        uint8_t fields[FRAME_BITS_MAX];
        unsigned count = frame_bits(&frame, bits);
        unsigned kept = unstuff(bits, count, plain);
        unsigned field_count = frame_fields(&frame, fields);

        TEST_ASSERT_EQUAL_UINT(field_count + 15u, kept);
        TEST_ASSERT_EQUAL_UINT8_ARRAY(fields, plain, field_count);
        TEST_ASSERT_EQUAL_HEX16(0, frame_crc(plain, kept));
        /* The bound by which the compiler and the analyses count: Davis et al., 2007. */
        TEST_ASSERT_LESS_OR_EQUAL_UINT(fixed + 8u * frame.length + (stuffed - 1u) / 4u, frame_length(&frame));
    }
}

/* All zero: the first five, and then every fourth: the bound is met but for the CRC's own bits. */
static void test_stuff_bits_of_zeros(void)
{
    const canopy_can_frame_t frame = {.id = 0, .length = 0};
    uint8_t bits[FRAME_BITS_MAX];

    /* Start of frame, id, RTR, IDE, r0, DLC: 19 zeros; the CRC of zeros is 0, too: 34 zeros, 6 stuff bits with the
     * rule "after five equal bits", stuff bits not being equal to what they follow. */
    TEST_ASSERT_EQUAL_UINT(34u + 6u, frame_bits(&frame, bits));
}

static void test_ranks_follow_the_arbitration_field(void)
{
    const canopy_can_frame_t order[] = {
        {.id = 0x0FF},
        {.id = 0x100},
        {.id = 0x100, .flags = CANOPY_CAN_REMOTE},
        {.id = 0x100u << 18, .flags = CANOPY_CAN_EXTENDED},
        {.id = 0x100u << 18, .flags = CANOPY_CAN_EXTENDED | CANOPY_CAN_REMOTE},
        {.id = (0x100u << 18) + 1u, .flags = CANOPY_CAN_EXTENDED},
        {.id = 0x101},
    };

    for (unsigned index = 1; index < sizeof order / sizeof order[0]; index++) {
        TEST_ASSERT_TRUE(frame_rank(&order[index - 1u]) < frame_rank(&order[index]));
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_crc_has_its_check_value);
    RUN_TEST(test_fields_have_their_widths);
    RUN_TEST(test_any_frame_can_be_received);
    RUN_TEST(test_stuff_bits_of_zeros);
    RUN_TEST(test_ranks_follow_the_arbitration_field);
    return UNITY_END();
}
