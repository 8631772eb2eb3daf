/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The drivers' common filter, and which frames can exist on a CAN bus.
 */
#include "canopy/acceptance.h"

#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

static canopy_can_frame_t frame(uint32_t id, int flags, uint8_t length)
{
    return (canopy_can_frame_t){.id = id, .flags = (uint8_t)flags, .length = length};
}

static bool is_valid(uint32_t id, int flags, uint8_t length)
{
    const canopy_can_frame_t made = frame(id, flags, length);
    return canopy_can_frame_is_valid(&made);
}

static bool accepts(const canopy_can_acceptance_t *acceptance, uint32_t id, int flags)
{
    const canopy_can_frame_t made = frame(id, flags, 0);
    return canopy_can_accepts(acceptance, &made);
}

static void test_everything_is_all_but_error_frames(void)
{
    TEST_ASSERT_TRUE(accepts(CANOPY_CAN_ACCEPT_EVERYTHING, 0x123, 0));
    TEST_ASSERT_TRUE(accepts(CANOPY_CAN_ACCEPT_EVERYTHING, 0x1ABCDEF0, CANOPY_CAN_EXTENDED));
    TEST_ASSERT_TRUE(accepts(CANOPY_CAN_ACCEPT_EVERYTHING, 0x123, CANOPY_CAN_REMOTE));
    TEST_ASSERT_FALSE(accepts(CANOPY_CAN_ACCEPT_EVERYTHING, 0x40, CANOPY_CAN_ERROR));
    TEST_ASSERT_TRUE(canopy_can_accepts_everything(CANOPY_CAN_ACCEPT_EVERYTHING));
}

static void test_an_empty_list_accepts_nothing(void)
{
    const canopy_can_acceptance_t empty = {0};

    TEST_ASSERT_FALSE(accepts(&empty, 0x123, 0));
    TEST_ASSERT_FALSE(accepts(&empty, 0x40, CANOPY_CAN_ERROR));
    TEST_ASSERT_FALSE(canopy_can_accepts_everything(&empty));
}

static void test_a_list_goes_on_in_the_next(void)
{
    static const uint32_t own[] = {0x700};
    static const uint32_t ids[] = {0x100};
    const canopy_can_acceptance_t second = {.ids = ids, .count = 1};
    const canopy_can_acceptance_t curious = {.error_frames = true, .next = &second};
    const canopy_can_acceptance_t first = {.ids = own, .count = 1, .next = &curious};
    const canopy_can_acceptance_t all = {.ids = own, .count = 1, .next = CANOPY_CAN_ACCEPT_EVERYTHING};

    TEST_ASSERT_TRUE(accepts(&first, 0x700, 0));
    TEST_ASSERT_TRUE(accepts(&first, 0x100, 0));
    TEST_ASSERT_FALSE(accepts(&first, 0x101, 0));
    TEST_ASSERT_TRUE(accepts(&first, 0x40, CANOPY_CAN_ERROR));
    TEST_ASSERT_FALSE(canopy_can_accepts_everything(&first));
    TEST_ASSERT_TRUE(canopy_can_accepts_everything(&all));
    TEST_ASSERT_TRUE(accepts(&all, 0x101, 0));
}

static void test_listed_ids_are_accepted_and_the_formats_are_told_apart(void)
{
    static const uint32_t ids[] = {0x100, 0x200 | CANOPY_CAN_ACCEPT_EXTENDED};
    const canopy_can_acceptance_t acceptance = {.ids = ids, .count = 2};

    TEST_ASSERT_TRUE(accepts(&acceptance, 0x100, 0));
    TEST_ASSERT_TRUE(accepts(&acceptance, 0x100, CANOPY_CAN_REMOTE));
    TEST_ASSERT_TRUE(accepts(&acceptance, 0x200, CANOPY_CAN_EXTENDED));
    TEST_ASSERT_FALSE(accepts(&acceptance, 0x100, CANOPY_CAN_EXTENDED));
    TEST_ASSERT_FALSE(accepts(&acceptance, 0x200, 0));
    TEST_ASSERT_FALSE(accepts(&acceptance, 0x101, 0));
}

static void test_error_frames_are_accepted_on_request_whatever_their_id(void)
{
    static const uint32_t ids[] = {0x100};
    canopy_can_acceptance_t acceptance = {.ids = ids, .count = 1};

    TEST_ASSERT_FALSE(accepts(&acceptance, 0x100, CANOPY_CAN_ERROR));
    acceptance.error_frames = true;
    TEST_ASSERT_TRUE(accepts(&acceptance, 0x40, CANOPY_CAN_ERROR));
}

static void test_filter_is_checked(void)
{
    static const uint32_t ids[] = {1};

    static const uint32_t many[CANOPY_CAN_ACCEPT_MAX] = {0};
    const canopy_can_acceptance_t full = {.ids = many, .count = CANOPY_CAN_ACCEPT_MAX};
    canopy_can_acceptance_t circle = {.ids = ids, .count = 1};

    circle.next = &circle;
    TEST_ASSERT_FALSE(canopy_can_acceptance_is_valid(NULL));
    TEST_ASSERT_TRUE(canopy_can_acceptance_is_valid(&full));
    TEST_ASSERT_FALSE(
        canopy_can_acceptance_is_valid(&(canopy_can_acceptance_t){.ids = ids, .count = 1, .next = &full}));
    TEST_ASSERT_FALSE(canopy_can_acceptance_is_valid(&circle));
    circle.ids = NULL;
    circle.count = 0;
    TEST_ASSERT_FALSE(canopy_can_acceptance_is_valid(&circle));
    TEST_ASSERT_TRUE(canopy_can_acceptance_is_valid(&(canopy_can_acceptance_t){0}));
    TEST_ASSERT_TRUE(canopy_can_acceptance_is_valid(&(canopy_can_acceptance_t){.ids = ids, .count = 1}));
    TEST_ASSERT_FALSE(canopy_can_acceptance_is_valid(&(canopy_can_acceptance_t){.ids = ids, .count = 0}));
    TEST_ASSERT_FALSE(canopy_can_acceptance_is_valid(&(canopy_can_acceptance_t){.ids = NULL, .count = 1}));
    TEST_ASSERT_FALSE(canopy_can_acceptance_is_valid(&(canopy_can_acceptance_t){.ids = ids, .count = 513}));
}

static void test_sets_of_ids_pass(void)
{
    static const uint32_t ids[] = {0x100};
    static const canopy_can_mask_t groups[] = {
        {0x00F00400u | CANOPY_CAN_ACCEPT_EXTENDED, 0x03FFFF00u | CANOPY_CAN_ACCEPT_EXTENDED}};
    const canopy_can_acceptance_t acceptance = {.ids = ids, .count = 1, .masks = groups, .mask_count = 1};

    TEST_ASSERT_TRUE(accepts(&acceptance, 0x100, 0));
    TEST_ASSERT_TRUE(accepts(&acceptance, 0x0CF00400, CANOPY_CAN_EXTENDED));
    TEST_ASSERT_TRUE(accepts(&acceptance, 0x18F00421, CANOPY_CAN_EXTENDED));
    TEST_ASSERT_FALSE(accepts(&acceptance, 0x18F00521, CANOPY_CAN_EXTENDED));
    TEST_ASSERT_FALSE(accepts(&acceptance, 0x421, 0));
    TEST_ASSERT_FALSE(accepts(&acceptance, 0x18F00421, CANOPY_CAN_EXTENDED | CANOPY_CAN_ERROR));
    TEST_ASSERT_TRUE(canopy_can_acceptance_is_valid(&acceptance));
    TEST_ASSERT_FALSE(canopy_can_acceptance_is_valid(&(canopy_can_acceptance_t){.masks = groups}));
    TEST_ASSERT_FALSE(canopy_can_acceptance_is_valid(&(canopy_can_acceptance_t){.mask_count = 1}));
    TEST_ASSERT_FALSE(canopy_can_acceptance_is_valid(
        &(canopy_can_acceptance_t){.ids = ids, .count = 1, .masks = groups, .mask_count = CANOPY_CAN_ACCEPT_MAX}));
}

static void test_ids_have_11_or_29_bits(void)
{
    TEST_ASSERT_TRUE(is_valid(0x7FF, 0, 8));
    TEST_ASSERT_FALSE(is_valid(0x800, 0, 8));
    TEST_ASSERT_TRUE(is_valid(0x1FFFFFFF, CANOPY_CAN_EXTENDED, 8));
    TEST_ASSERT_FALSE(is_valid(0x20000000, CANOPY_CAN_EXTENDED, 8));
    TEST_ASSERT_TRUE(is_valid(0x1FFFFFFF, CANOPY_CAN_ERROR, 8));
}

static void test_lengths_are_those_that_a_dlc_can_say(void)
{
    static const uint8_t fd_lengths[] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64};
    unsigned valid = 0;

    for (unsigned length = 0; length <= 255; length++) {
        TEST_ASSERT_EQUAL(length <= 8, is_valid(1, 0, (uint8_t)length));
        valid += is_valid(1, CANOPY_CAN_FD, (uint8_t)length);
    }
    TEST_ASSERT_EQUAL_UINT(sizeof fd_lengths, valid);
    for (size_t i = 0; i < sizeof fd_lengths; i++) {
        TEST_ASSERT_TRUE(is_valid(1, CANOPY_CAN_FD, fd_lengths[i]));
    }
}

static void test_flags_fit_the_format(void)
{
    TEST_ASSERT_TRUE(is_valid(1, CANOPY_CAN_REMOTE, 8));
    TEST_ASSERT_TRUE(is_valid(1, CANOPY_CAN_FD | CANOPY_CAN_BITRATE_SWITCH | CANOPY_CAN_ERROR_STATE, 64));
    TEST_ASSERT_FALSE(is_valid(1, CANOPY_CAN_FD | CANOPY_CAN_REMOTE, 8));
    TEST_ASSERT_FALSE(is_valid(1, CANOPY_CAN_FD | CANOPY_CAN_ERROR, 8));
    TEST_ASSERT_FALSE(is_valid(1, CANOPY_CAN_BITRATE_SWITCH, 8));
    TEST_ASSERT_FALSE(is_valid(1, CANOPY_CAN_ERROR_STATE, 8));
    TEST_ASSERT_FALSE(is_valid(1, 64, 8));
    TEST_ASSERT_FALSE(is_valid(1, 128, 8));
}

static void test_error_frames_are_not_for_the_loop_to_send(void)
{
    const canopy_can_frame_t error = frame(0x40, CANOPY_CAN_ERROR, 8);
    const canopy_can_frame_t data = frame(0x40, 0, 8);

    TEST_ASSERT_FALSE(canopy_can_frame_can_be_sent(&error));
    TEST_ASSERT_TRUE(canopy_can_frame_can_be_sent(&data));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_everything_is_all_but_error_frames);
    RUN_TEST(test_an_empty_list_accepts_nothing);
    RUN_TEST(test_a_list_goes_on_in_the_next);
    RUN_TEST(test_listed_ids_are_accepted_and_the_formats_are_told_apart);
    RUN_TEST(test_error_frames_are_accepted_on_request_whatever_their_id);
    RUN_TEST(test_filter_is_checked);
    RUN_TEST(test_sets_of_ids_pass);
    RUN_TEST(test_ids_have_11_or_29_bits);
    RUN_TEST(test_lengths_are_those_that_a_dlc_can_say);
    RUN_TEST(test_flags_fit_the_format);
    RUN_TEST(test_error_frames_are_not_for_the_loop_to_send);
    return UNITY_END();
}
