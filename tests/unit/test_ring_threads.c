/* SPDX-License-Identifier: MIT */
/**
 * @file
 * canopy_ring_t between two threads: nothing is torn, doubled or out of order, and what is missing was counted.
 */
#include <pthread.h>
#include <sched.h>

#include "canopy/ring.h"
#include "unity.h"

#define ELEMENTS 300000u
#define CAPACITY 16u

/* Long enough that a copy takes several instructions: a torn element would show. */
typedef struct {
    uint32_t number;
    uint32_t copies[15];
} element_t;

static element_t storage[CAPACITY];
static canopy_ring_t ring;
static atomic_bool produced;

void setUp(void)
{
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_ring_init(&ring, storage, sizeof storage, sizeof storage[0], CAPACITY));
    atomic_store(&produced, false);
}

void tearDown(void)
{
}

static bool is_patient = true;
static bool is_hasty = false;

static void *produce(void *context)
{
    const bool patient = *(const bool *)context;
    for (uint32_t number = 0; number < ELEMENTS; number++) {
        element_t element = {.number = number};
        for (size_t i = 0; i < 15; i++) {
            element.copies[i] = number;
        }
        while (!canopy_ring_push(&ring, &element) && patient) {
            (void)sched_yield();
        }
    }
    atomic_store(&produced, true);
    return NULL;
}

/** Takes everything that the producer gives. @return number of elements */
static uint32_t consume(bool all_expected)
{
    uint32_t count = 0;
    uint32_t next = 0;
    for (;;) {
        element_t element;
        const bool last_look = atomic_load(&produced);
        if (!canopy_ring_pop(&ring, &element)) {
            if (last_look) {
                return count;
            }
            (void)sched_yield();
            continue;
        }
        count++;
        TEST_ASSERT_TRUE(all_expected ? element.number == next : element.number >= next);
        next = element.number + 1u;
        for (size_t i = 0; i < 15; i++) {
            TEST_ASSERT_EQUAL_UINT32(element.number, element.copies[i]);
        }
        TEST_ASSERT_LESS_OR_EQUAL_UINT32(CAPACITY, canopy_ring_count(&ring));
    }
}

static void test_patient_producer_loses_nothing(void)
{
    pthread_t producer;
    TEST_ASSERT_EQUAL(0, pthread_create(&producer, NULL, produce, &is_patient));
    const uint32_t count = consume(true);
    TEST_ASSERT_EQUAL(0, pthread_join(producer, NULL));

    TEST_ASSERT_EQUAL_UINT32(ELEMENTS, count);
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(CAPACITY, canopy_ring_high_water(&ring));
}

static void test_hasty_producer_loses_what_is_counted(void)
{
    pthread_t producer;
    TEST_ASSERT_EQUAL(0, pthread_create(&producer, NULL, produce, &is_hasty));
    const uint32_t count = consume(false);
    TEST_ASSERT_EQUAL(0, pthread_join(producer, NULL));

    TEST_ASSERT_EQUAL_UINT32(ELEMENTS, count + canopy_ring_dropped(&ring));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_patient_producer_loses_nothing);
    RUN_TEST(test_hasty_producer_loses_what_is_counted);
    return UNITY_END();
}
