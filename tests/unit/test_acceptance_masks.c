/* SPDX-License-Identifier: MIT */
/** @file Acceptance lists as masks: all listed ids pass, as few others as can be, and it is told whether any. */
#include "canopy/can/acceptance_masks.h"

#include "canopy/status.h"
#include "unity.h"

#define EXT CANOPY_CAN_ACCEPT_EXTENDED
#define MOST 16u

static canopy_can_mask_t masks[MOST];
static bool exact;
static uint32_t ids[CANOPY_CAN_ACCEPT_MAX];

void setUp(void)
{
}

void tearDown(void)
{
}

static int find(uint16_t count, uint16_t most)
{
    const canopy_can_acceptance_t acceptance = {.ids = ids, .count = count};

    return canopy_can_acceptance_masks(&acceptance, masks, most, &exact);
}

static unsigned standard_ids_let_through(uint16_t count)
{
    unsigned through = 0;

    for (uint32_t id = 0; id < 0x800u; id++) {
        through += canopy_can_masks_accept(masks, count, id) ? 1u : 0u;
    }
    return through;
}

static void test_ids_that_have_room_pass_exactly(void)
{
    ids[0] = 0x100;
    ids[1] = 0x7FF;
    ids[2] = 0x100 | EXT;
    ids[3] = 0x100; /* twice */
    TEST_ASSERT_EQUAL(3, find(4, 3));
    TEST_ASSERT_TRUE(exact);
    TEST_ASSERT_EQUAL_HEX32(0x100, masks[0].id);
    TEST_ASSERT_EQUAL_HEX32(0x7FF | EXT, masks[0].mask);
    TEST_ASSERT_EQUAL_HEX32(0x100 | EXT, masks[2].id);
    TEST_ASSERT_EQUAL_HEX32(0x1FFFFFFF | EXT, masks[2].mask);
    TEST_ASSERT_EQUAL_UINT(2, standard_ids_let_through(3));
}

static void test_neighbours_are_merged_without_letting_others_through(void)
{
    for (uint32_t index = 0; index < 8u; index++) {
        ids[index] = 0x208u + index;
    }
    ids[8] = 0x123;
    TEST_ASSERT_EQUAL(2, find(9, 2));
    TEST_ASSERT_TRUE(exact);
    TEST_ASSERT_EQUAL_UINT(9, standard_ids_let_through(2));
}

static void test_what_must_be_merged_lets_few_others_through_and_says_so(void)
{
    ids[0] = 0x100;
    ids[1] = 0x101;
    ids[2] = 0x400;
    ids[3] = 0x403;
    TEST_ASSERT_EQUAL(2, find(4, 2));
    TEST_ASSERT_FALSE(exact);
    TEST_ASSERT_EQUAL_UINT(6, standard_ids_let_through(2)); /* 0x100, 0x101, 0x400 to 0x403 */
}

static void test_formats_are_kept_apart_but_where_there_is_one_filter(void)
{
    ids[0] = 0x100;
    ids[1] = 0x555;
    ids[2] = 0x100 | EXT;
    ids[3] = 0x1ABCDEF0 | EXT;
    TEST_ASSERT_EQUAL(2, find(4, 2));
    for (unsigned index = 0; index < 2u; index++) {
        TEST_ASSERT_BITS_HIGH(EXT, masks[index].mask);
    }
    TEST_ASSERT_FALSE(canopy_can_masks_accept(masks, 2, 0x555 | EXT));
    TEST_ASSERT_EQUAL(1, find(4, 1));
    TEST_ASSERT_FALSE(exact);
    TEST_ASSERT_BITS_LOW(EXT, masks[0].mask);
    for (unsigned index = 0; index < 4u; index++) {
        TEST_ASSERT_TRUE(canopy_can_masks_accept(masks, 1, ids[index]));
    }
}

static void test_everything_and_nothing(void)
{
    TEST_ASSERT_EQUAL(2, canopy_can_acceptance_masks(CANOPY_CAN_ACCEPT_EVERYTHING, masks, MOST, &exact));
    TEST_ASSERT_TRUE(exact);
    TEST_ASSERT_TRUE(canopy_can_masks_accept(masks, 2, 0x7FF));
    TEST_ASSERT_TRUE(canopy_can_masks_accept(masks, 2, 0x1FFFFFFF | EXT));
    TEST_ASSERT_EQUAL(1, canopy_can_acceptance_masks(CANOPY_CAN_ACCEPT_EVERYTHING, masks, 1, &exact));
    TEST_ASSERT_TRUE(canopy_can_masks_accept(masks, 1, 0x1FFFFFFF | EXT));
    TEST_ASSERT_TRUE(canopy_can_masks_accept(masks, 1, 0));
    TEST_ASSERT_EQUAL(0, canopy_can_acceptance_masks(&(canopy_can_acceptance_t){0}, masks, MOST, &exact));
    TEST_ASSERT_TRUE(exact);
    TEST_ASSERT_FALSE(canopy_can_masks_accept(masks, 0, 0));
}

static void test_lists_go_on_in_others(void)
{
    static const uint32_t more[] = {0x300};
    static const canopy_can_acceptance_t second = {.ids = more, .count = 1};
    const canopy_can_acceptance_t first = {.ids = ids, .count = 1, .next = &second};

    ids[0] = 0x200;
    TEST_ASSERT_EQUAL(2, canopy_can_acceptance_masks(&first, masks, MOST, &exact));
    TEST_ASSERT_TRUE(canopy_can_masks_accept(masks, 2, 0x300));
    TEST_ASSERT_EQUAL(1, canopy_can_acceptance_masks(&first, masks, 1, &exact)); /* they differ in one bit */
    TEST_ASSERT_TRUE(exact);
}

static void test_bad_arguments_are_refused(void)
{
    const canopy_can_acceptance_t empty = {0};

    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_can_acceptance_masks(NULL, masks, MOST, &exact));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_can_acceptance_masks(&empty, NULL, MOST, &exact));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_can_acceptance_masks(&empty, masks, 0, &exact));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_can_acceptance_masks(&empty, masks, MOST, NULL));
}

static uint32_t seed;

static uint32_t random_number(void)
{
    seed = seed * 1664525u + 1013904223u;
    return seed >> 8;
}

static void test_listed_sets_stay_as_they_are(void)
{
    static const canopy_can_mask_t groups[] = {
        {0x00F00400u | EXT, 0x03FFFF00u | EXT}, /* a J1939 parameter group from anyone */
        {0x00FEF100u | EXT, 0x03FFFF00u | EXT},
    };
    static const uint32_t own[] = {0x18F00421u | EXT, 0x100};
    const canopy_can_acceptance_t acceptance = {.ids = own, .count = 2, .masks = groups, .mask_count = 2};

    TEST_ASSERT_EQUAL(3,
                      canopy_can_acceptance_masks(&acceptance, masks, MOST, &exact)); /* the first id is in a group */
    TEST_ASSERT_TRUE(exact);
    TEST_ASSERT_TRUE(canopy_can_masks_accept(masks, 3, 0x0CF00400u | EXT));
    TEST_ASSERT_TRUE(canopy_can_masks_accept(masks, 3, 0x18FEF1FEu | EXT));
    TEST_ASSERT_TRUE(canopy_can_masks_accept(masks, 3, 0x100));
    TEST_ASSERT_FALSE(canopy_can_masks_accept(masks, 3, 0x18FEF2FEu | EXT));
    TEST_ASSERT_EQUAL(2, canopy_can_acceptance_masks(&acceptance, masks, 2, &exact));
    TEST_ASSERT_FALSE(exact); /* the groups have become one set, which has others, too */
    TEST_ASSERT_TRUE(canopy_can_masks_accept(masks, 2, 0x0CF00400u | EXT));
    TEST_ASSERT_TRUE(canopy_can_masks_accept(masks, 2, 0x18FEF1FEu | EXT));
}

enum { STANDARD, BOTH, EXTENDED, CLOSE, KINDS };

static void fill(uint16_t count, unsigned kind)
{
    for (uint16_t index = 0; index < count; index++) {
        uint32_t number = random_number() ^ (random_number() << 12);
        bool extended = kind == (unsigned)EXTENDED || (kind == (unsigned)BOTH && number % 2u == 0u);

        ids[index] = extended ? (number & 0x1FFFFFFFu) | EXT : number & (kind == (unsigned)CLOSE ? 0x3Fu : 0x7FFu);
    }
}

/** Does a mask let a standard id through that is not in the list? */
static bool another_passes(uint16_t listed, uint16_t count)
{
    const canopy_can_acceptance_t acceptance = {.ids = ids, .count = listed};

    for (uint32_t id = 0; id < 0x800u; id++) {
        const canopy_can_frame_t frame = {.id = id};

        if (canopy_can_masks_accept(masks, count, id) && !canopy_can_accepts(&acceptance, &frame)) {
            return true;
        }
    }
    return false;
}

static void test_random_sets(void)
{
    unsigned merged_exactly = 0;

    seed = 7;
    for (unsigned round = 0; round < 400u; round++) {
        uint16_t listed = (uint16_t)(1u + random_number() % (round % 20u < 4u ? 200u : 40u));
        uint16_t most = (uint16_t)(1u + random_number() % MOST);
        unsigned kind = round % (unsigned)KINDS;
        int count;

        fill(listed, kind);
        count = find(listed, most);
        TEST_ASSERT_GREATER_THAN(0, count);
        TEST_ASSERT_LESS_OR_EQUAL(most, count);
        for (uint16_t index = 0; index < listed; index++) {
            TEST_ASSERT_TRUE(canopy_can_masks_accept(masks, (uint16_t)count, ids[index]));
        }
        if (kind == (unsigned)STANDARD || kind == (unsigned)CLOSE) { /* all 2,048 can be looked at */
            TEST_ASSERT_EQUAL(exact, !another_passes(listed, (uint16_t)count));
        }
        TEST_ASSERT_TRUE(exact || listed > most); /* where all have room, nothing else passes */
        merged_exactly += exact && listed > most ? 1u : 0u;
    }
    TEST_ASSERT_GREATER_THAN_UINT(0, merged_exactly);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_ids_that_have_room_pass_exactly);
    RUN_TEST(test_neighbours_are_merged_without_letting_others_through);
    RUN_TEST(test_what_must_be_merged_lets_few_others_through_and_says_so);
    RUN_TEST(test_formats_are_kept_apart_but_where_there_is_one_filter);
    RUN_TEST(test_everything_and_nothing);
    RUN_TEST(test_lists_go_on_in_others);
    RUN_TEST(test_bad_arguments_are_refused);
    RUN_TEST(test_listed_sets_stay_as_they_are);
    RUN_TEST(test_random_sets);
    return UNITY_END();
}
