/* SPDX-License-Identifier: MIT */
/**
 * @file
 * canopy_ring_t in one thread: arguments, order, full and empty, counters, wrap-around of the 32-bit indices.
 */
#include "canopy/ring.h"

#include "unity.h"

static uint32_t storage[4];
static canopy_ring_t ring;

void setUp(void)
{
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_ring_init(&ring, storage, sizeof storage, sizeof storage[0], 4));
}

void tearDown(void)
{
}

static void push(uint32_t value)
{
    TEST_ASSERT_TRUE(canopy_ring_push(&ring, &value));
}

static void expect(uint32_t value)
{
    uint32_t popped = ~value;
    TEST_ASSERT_TRUE(canopy_ring_pop(&ring, &popped));
    TEST_ASSERT_EQUAL_UINT32(value, popped);
}

static void test_init_refuses_bad_arguments(void)
{
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_ring_init(NULL, storage, sizeof storage, 4, 4));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_ring_init(&ring, NULL, sizeof storage, 4, 4));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_ring_init(&ring, storage, sizeof storage, 0, 4));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_ring_init(&ring, storage, sizeof storage, 4, 0));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_ring_init(&ring, storage, sizeof storage, 4, 3));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_ring_init(&ring, storage, sizeof storage, 4, UINT32_MAX));
    /* The largest ring there can be. Its storage is not looked at. */
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_ring_init(&ring, storage, (size_t)1 << 31, 1, UINT32_C(1) << 31));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT,
                      canopy_ring_init(&ring, storage, ((size_t)1 << 31) - 1u, 1, UINT32_C(1) << 31));
}

static void test_init_refuses_too_little_storage_also_where_the_product_overflows(void)
{
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_ring_init(&ring, storage, sizeof storage - 1u, 4, 4));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_ring_init(&ring, storage, sizeof storage, 4, 8));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT,
                      canopy_ring_init(&ring, storage, sizeof storage, SIZE_MAX / 2u + 1u, UINT32_C(1) << 31));
}

static void test_new_ring_is_empty(void)
{
    uint32_t untouched = 0xA5A5A5A5u;

    TEST_ASSERT_FALSE(canopy_ring_pop(&ring, &untouched));
    TEST_ASSERT_EQUAL_HEX32(0xA5A5A5A5u, untouched);
    TEST_ASSERT_EQUAL_UINT32(0, canopy_ring_count(&ring));
    TEST_ASSERT_EQUAL_UINT32(0, canopy_ring_dropped(&ring));
    TEST_ASSERT_EQUAL_UINT32(0, canopy_ring_high_water(&ring));
}

static void test_elements_come_out_in_order(void)
{
    for (uint32_t round = 0; round < 10; round++) {
        push(3 * round);
        push(3 * round + 1);
        push(3 * round + 2);
        expect(3 * round);
        expect(3 * round + 1);
        expect(3 * round + 2);
    }
    TEST_ASSERT_EQUAL_UINT32(3, canopy_ring_high_water(&ring));
}

static void test_full_ring_keeps_the_old_and_counts_the_new(void)
{
    for (uint32_t i = 0; i < 4; i++) {
        push(i);
    }
    const uint32_t late = 99;

    TEST_ASSERT_FALSE(canopy_ring_push(&ring, &late));
    TEST_ASSERT_FALSE(canopy_ring_push(&ring, &late));

    TEST_ASSERT_EQUAL_UINT32(2, canopy_ring_dropped(&ring));
    TEST_ASSERT_EQUAL_UINT32(4, canopy_ring_count(&ring));
    TEST_ASSERT_EQUAL_UINT32(4, canopy_ring_high_water(&ring));
    for (uint32_t i = 0; i < 4; i++) {
        expect(i);
    }
    TEST_ASSERT_EQUAL_UINT32(0, canopy_ring_count(&ring));
    TEST_ASSERT_EQUAL_UINT32(4, canopy_ring_high_water(&ring));
}

static void test_indices_wrap_around(void)
{
    atomic_store(&ring.head, UINT32_MAX - 1u);
    atomic_store(&ring.tail, UINT32_MAX - 1u);

    for (uint32_t i = 0; i < 4; i++) {
        push(i);
    }
    const uint32_t late = 99;
    TEST_ASSERT_FALSE(canopy_ring_push(&ring, &late));
    TEST_ASSERT_EQUAL_UINT32(4, canopy_ring_count(&ring));
    for (uint32_t i = 0; i < 4; i++) {
        expect(i);
    }
    TEST_ASSERT_EQUAL_UINT32(2, atomic_load(&ring.tail));
}

static void test_elements_of_odd_size_in_unaligned_storage(void)
{
    static uint8_t bytes[1 + 2 * 3 + 1];
    static const uint8_t elements[2][3] = {{1, 2, 3}, {4, 5, 6}};
    uint8_t popped[3];
    bytes[7] = 0x5A;

    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_ring_init(&ring, bytes + 1, 6, 3, 2));
    TEST_ASSERT_TRUE(canopy_ring_push(&ring, elements[0]));
    TEST_ASSERT_TRUE(canopy_ring_push(&ring, elements[1]));
    TEST_ASSERT_EQUAL_HEX8(0x5A, bytes[7]);
    TEST_ASSERT_TRUE(canopy_ring_pop(&ring, popped));
    TEST_ASSERT_EQUAL_UINT8_ARRAY(elements[0], popped, 3);
    TEST_ASSERT_TRUE(canopy_ring_pop(&ring, popped));
    TEST_ASSERT_EQUAL_UINT8_ARRAY(elements[1], popped, 3);
}

static void test_ring_of_one_element(void)
{
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_ring_init(&ring, storage, sizeof storage[0], sizeof storage[0], 1));
    push(1);
    const uint32_t late = 2;
    TEST_ASSERT_FALSE(canopy_ring_push(&ring, &late));
    expect(1);
    push(3);
    expect(3);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_bad_arguments);
    RUN_TEST(test_init_refuses_too_little_storage_also_where_the_product_overflows);
    RUN_TEST(test_new_ring_is_empty);
    RUN_TEST(test_elements_come_out_in_order);
    RUN_TEST(test_full_ring_keeps_the_old_and_counts_the_new);
    RUN_TEST(test_indices_wrap_around);
    RUN_TEST(test_elements_of_odd_size_in_unaligned_storage);
    RUN_TEST(test_ring_of_one_element);
    return UNITY_END();
}
