/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The transmit side between two threads: no value is torn or older than the one before, the newest one leaves in the end,
 * and every trace frame is sent or counted. With ThreadSanitizer (preset tsan) also: nothing is read while it is written.
 */
#include <pthread.h>
#include <sched.h>

#include "canopy/tx.h"
#include "unity.h"

enum { LENGTH = 8, TRACE_PLACES = 4, TRACE_ID = 0x600, NEVER = 1000000, ROUNDS = 60000, MESSAGES = 2 };

static void encode(const void *output, uint8_t *data)
{
    uint32_t value = *(const uint32_t *)output;

    for (unsigned byte = 0; byte < (unsigned)LENGTH; byte++) {
        data[byte] = (uint8_t)(value >> (8u * (byte % 4u)) & 0xFFu); /* twice */
    }
}

static const canopy_tx_message_t messages[MESSAGES] = {
    {.id = 0, .length = LENGTH, .data_id = CANOPY_E2E_NONE, .every = 1, .place = 0, .encode = encode},
    {.id = 1, .length = LENGTH, .data_id = CANOPY_E2E_NONE, .every = 1, .place = 2 * LENGTH, .encode = encode}};
static canopy_tx_slot_t slots[MESSAGES];
static uint8_t data[MESSAGES * 2 * LENGTH];
static canopy_tx_trace_t places[TRACE_PLACES];
static canopy_tx_t tx;

/* The service's. */
static uint32_t last[MESSAGES];
static uint32_t last_trace;
static uint32_t faults;
static uint32_t pending; /* polls until the frame in the mailbox is out */
static bool is_aborted;
/* Relaxed: they must not bring order into what is tested. */
static atomic_bool is_over;
static atomic_uint_least32_t requests;

static uint32_t value_of(const uint8_t *bytes)
{
    return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

static int send(void *context, uint8_t mailbox, const canopy_can_frame_t *frame)
{
    uint32_t value = value_of(frame->data);

    (void)context;
    (void)mailbox;
    is_aborted = false;
    pending = value % 3u;
    if (frame->id == (uint32_t)TRACE_ID) {
        faults += value < last_trace ? 1u : 0u; /* the same one again, when it was taken back */
        last_trace = value;
    } else {
        faults += value != value_of(&frame->data[4]) || value < last[frame->id] ? 1u : 0u;
        last[frame->id] = value;
    }
    return 1;
}

static canopy_can_outcome_t outcome(void *context, uint8_t mailbox)
{
    (void)context;
    (void)mailbox;
    if (is_aborted) {
        return CANOPY_CAN_ABORTED;
    }
    return pending-- > 0u ? CANOPY_CAN_PENDING : CANOPY_CAN_SENT;
}

static void take_back(void *context, uint8_t mailbox)
{
    (void)context;
    (void)mailbox;
    is_aborted = true;
}

static void request(void *context)
{
    (void)context;
    (void)atomic_fetch_add_explicit(&requests, 1u, memory_order_relaxed);
}

static const canopy_can_t can = {
    .send = send, .outcome = outcome, .abort = take_back, .request = request, .mailboxes = 1};

static void *serve(void *context)
{
    (void)context;
    while (!atomic_load_explicit(&is_over, memory_order_relaxed)) {
        canopy_tx_service(&tx, 0);
    }
    return NULL;
}

void setUp(void)
{
    const canopy_tx_memory_t memory = {.slots = slots, .data = data, .trace = places, .trace_capacity = TRACE_PLACES};

    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_tx_init(&tx, messages, MESSAGES, &memory, &can));
}

void tearDown(void)
{
}

static void between_two_threads_nothing_is_torn_old_or_forgotten(void)
{
    pthread_t service;
    canopy_tx_counters_t counters;

    TEST_ASSERT_EQUAL(0, pthread_create(&service, NULL, serve, NULL));
    for (uint32_t round = 1; round <= (uint32_t)ROUNDS; round++) {
        const canopy_tx_trace_data_t number = {
            {(uint8_t)(round & 0xFFu), (uint8_t)(round >> 8 & 0xFFu), (uint8_t)(round >> 16 & 0xFFu)}};

        canopy_tx_post(&tx, 0, &round, NEVER);
        canopy_tx_post(&tx, 1, &round, NEVER);
        canopy_tx_trace(&tx, TRACE_ID, 0, &number, NEVER);
        canopy_tx_kick(&tx, 0);
        if (round % 64u == 0u) {
            (void)sched_yield();
        }
    }
    while (!canopy_tx_is_out(&tx)) {
        (void)sched_yield();
    }
    atomic_store_explicit(&is_over, true, memory_order_relaxed);
    TEST_ASSERT_EQUAL(0, pthread_join(service, NULL));
    for (unsigned poll = 0; poll < 64u; poll++) {
        canopy_tx_service(&tx, 0); /* the trace that is left */
    }
    canopy_tx_count(&tx, &counters);
    TEST_ASSERT_EQUAL_UINT32(0, faults);
    TEST_ASSERT_EQUAL_UINT32(ROUNDS, last[0]);
    TEST_ASSERT_EQUAL_UINT32(ROUNDS, last[1]);
    TEST_ASSERT_EQUAL_UINT32(2 * ROUNDS, counters.sent + counters.replaced);
    TEST_ASSERT_EQUAL_UINT32(ROUNDS, counters.trace_sent + counters.trace_dropped);
    TEST_ASSERT_EQUAL_UINT32(ROUNDS, atomic_load_explicit(&requests, memory_order_relaxed));
    TEST_ASSERT_FALSE(canopy_tx_is_busy(&tx));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(between_two_threads_nothing_is_torn_old_or_forgotten);
    return UNITY_END();
}
