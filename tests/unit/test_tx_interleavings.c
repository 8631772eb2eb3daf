/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Every interleaving of the loop that posts and of the service that sends, as threads, as threads with store buffers, and
 * as an interrupt: what is sent is never torn and never older than what was sent before, and the newest value is sent in
 * the end. The same exploration finds each step of the protocol that is left out: so it could fail.
 */
#include "stepped.h"
/* The code under test, with its accesses as steps. */
#include "../../runtime/src/tx.c"         /* NOLINT(bugprone-suspicious-include) */
#include "../../runtime/src/tx_service.c" /* NOLINT(bugprone-suspicious-include) */
#include "unity.h"

enum { LENGTH = 2, NEVER = 1000000, TRACE_PLACES = 1 };

static uint8_t image;

static void encode(const void *output, uint8_t *data)
{
    for (unsigned byte = 0; byte < (unsigned)LENGTH; byte++) {
        stepped_store(&data[byte], 1, *(const uint8_t *)output, memory_order_relaxed);
    }
}

static const canopy_tx_message_t message = {
    .id = 0x100, .length = LENGTH, .data_id = CANOPY_E2E_NONE, .every = 1, .encode = encode};
static canopy_tx_slot_t slot;
static uint8_t data[2 * LENGTH];
static canopy_tx_trace_t places[TRACE_PLACES];
static canopy_can_t can;
static canopy_tx_t tx;

/* What the driver sees. */
static const char *wrong; /* NULL: nothing */
static uint8_t last_sent;
static uint8_t last_trace;
static bool is_full;
static bool is_aborted;
static bool is_flying; /* frames stay in their mailbox */

static int send(void *context, uint8_t mailbox, const canopy_can_frame_t *frame)
{
    (void)context;
    (void)mailbox;
    if (frame->id != message.id) {
        wrong = frame->data[0] != last_trace + 1u ? "trace out of order" : wrong;
        last_trace = frame->data[0];
        return 1;
    }
    if (frame->data[0] != frame->data[1]) {
        wrong = "torn";
    } else if (frame->data[0] < last_sent) {
        wrong = "older than the one before";
    }
    last_sent = frame->data[0];
    is_full = true;
    is_aborted = false;
    return 1;
}

static canopy_can_outcome_t outcome(void *context, uint8_t mailbox)
{
    (void)context;
    (void)mailbox;
    if (is_flying && !is_aborted) {
        return CANOPY_CAN_PENDING;
    }
    is_full = false;
    return is_aborted ? CANOPY_CAN_ABORTED : CANOPY_CAN_SENT;
}

static void abort_frame(void *context, uint8_t mailbox)
{
    (void)context;
    (void)mailbox;
    is_aborted = true;
}

static uint8_t posted;

static void post(void)
{
    image = ++posted;
    canopy_tx_post(&tx, 0, &image, NEVER + posted);
}

static void serve(void)
{
    canopy_tx_service(&tx, 0);
}

/** One value has been posted, and where frames stay in their mailbox, it is there. */
static void begin(void)
{
    const canopy_tx_memory_t memory = {.slots = &slot, .data = data, .trace = places, .trace_capacity = TRACE_PLACES};

    wrong = NULL;
    last_sent = last_trace = posted = 0;
    is_full = is_aborted = false;
    (void)canopy_tx_init(&tx, &message, 1, &memory, &can);
    post();
    if (is_flying) {
        serve();
    }
}

/** The loop asks for a service after it has posted: then the newest value leaves. */
static bool end(void)
{
    canopy_tx_counters_t counters;

    serve();
    canopy_tx_count(&tx, &counters);
    if (last_sent != posted) {
        wrong = wrong != NULL ? wrong : "the newest value was not sent";
    } else if (is_flying && tx.mailboxes[0].until != (canopy_time_t)NEVER + posted) {
        wrong = wrong != NULL ? wrong : "the deadline of another value";
    } else if (counters.sent + counters.replaced + (is_flying ? 1u : 0u) != posted) {
        wrong = wrong != NULL ? wrong : "a value has not ended once";
    }
    return wrong == NULL;
}

static void share(const volatile void *address, size_t size)
{
    shared[shared_count].address = address;
    shared[shared_count].size = size;
    shared_count++;
}

void setUp(void)
{
    can = (canopy_can_t){.send = send, .mailboxes = 1};
    is_flying = false;
    leave_out_store = NULL;
    change_order = NULL;
    change_load = NULL;
    shared_count = 0;
    share(&slot.latest, sizeof slot.latest);
    share(&slot.reading, sizeof slot.reading);
    share(data, sizeof data);
}

void tearDown(void)
{
}

/** Frames stay in their mailbox until a newer value takes them back. */
static void keep_frames_in_the_mailbox(void)
{
    can.outcome = outcome;
    can.abort = abort_frame;
    is_flying = true;
}

static void holds_in_all_orders(model_t which, unsigned posts, unsigned services, unsigned long at_least)
{
    unsigned long orders = explore(which, begin, post, posts, serve, services, end);

    TEST_ASSERT_NULL_MESSAGE(wrong, wrong);
    TEST_ASSERT_LESS_THAN_UINT(STEPS_MAX, depth);
    TEST_ASSERT_GREATER_OR_EQUAL_UINT(at_least, orders);
}

static void of_two_threads(void)
{
    holds_in_all_orders(IN_ORDER, 1, 1, 500);
    holds_in_all_orders(IN_ORDER, 2, 1, 5000);
    holds_in_all_orders(IN_ORDER, 3, 1, 30000);
    holds_in_all_orders(IN_ORDER, 1, 2, 2000);
    keep_frames_in_the_mailbox();
    holds_in_all_orders(IN_ORDER, 1, 1, 100);
    holds_in_all_orders(IN_ORDER, 2, 1, 1000);
    holds_in_all_orders(IN_ORDER, 1, 2, 300);
}

static void of_two_threads_with_store_buffers(void)
{
    holds_in_all_orders(STORE_BUFFERS, 1, 1, 10000);
    keep_frames_in_the_mailbox();
    holds_in_all_orders(STORE_BUFFERS, 1, 1, 1000);
    holds_in_all_orders(STORE_BUFFERS, 1, 2, 5000);
}

static void of_a_loop_that_is_interrupted(void)
{
    holds_in_all_orders(INTERRUPT, 1, 1, 5);
    holds_in_all_orders(INTERRUPT, 3, 4, 1000);
    keep_frames_in_the_mailbox();
    holds_in_all_orders(INTERRUPT, 3, 4, 1000);
}

/* --- trace frames ----------------------------------------------------------------------------------------------------- */

static uint8_t traced;

static void push_trace(void)
{
    const canopy_tx_trace_data_t number = {{(uint8_t)(traced + 1u)}};
    uint32_t full = tx.trace_full;

    canopy_tx_trace(&tx, 0x600, 0, &number, NEVER);
    if (full == tx.trace_full) {
        traced++;
    }
}

static void begin_trace(void)
{
    begin();
    serve();
    traced = 0;
}

static bool end_trace(void)
{
    serve();
    wrong = wrong == NULL && last_trace != traced ? "a trace frame is missing" : wrong;
    return wrong == NULL;
}

static void trace_frames_leave_in_their_order_and_none_is_missing(void)
{
    static const model_t models[] = {IN_ORDER, STORE_BUFFERS, INTERRUPT};

    shared_count = 0;
    share(&tx.trace_head, sizeof tx.trace_head);
    share(&tx.trace_tail, sizeof tx.trace_tail);
    for (unsigned which = 0; which < 3u; which++) {
        (void)explore(models[which], begin_trace, push_trace, 2, serve, 1, end_trace);
        TEST_ASSERT_NULL_MESSAGE(wrong, wrong);
        TEST_ASSERT_LESS_THAN_UINT(STEPS_MAX, depth);
    }
}

/* --- each step of the protocol is needed ------------------------------------------------------------------------------ */

static uint32_t latest_seen; /* by the service, last */

static uint32_t do_not_look_again(int thread, const volatile void *address, uint32_t value)
{
    if (thread == SECOND && address == &slot.latest) {
        if (slot.reading == 0u) {
            latest_seen = value;
        }
        return latest_seen;
    }
    return value;
}

static uint32_t do_not_look_who_reads(int thread, const volatile void *address, uint32_t value)
{
    return thread == FIRST && address == &slot.reading ? 0u : value;
}

static bool do_not_announce(int thread, const volatile void *address, uint32_t value)
{
    return thread == SECOND && address == &slot.reading && value != 0u;
}

static bool do_not_take_back(int thread, const volatile void *address, uint32_t value)
{
    return thread == FIRST && address == &slot.latest && value == 0u;
}

static memory_order announce_weakly(int thread, const volatile void *address, memory_order order)
{
    return thread == SECOND && address == &slot.reading ? memory_order_release : order;
}

static memory_order take_back_weakly(int thread, const volatile void *address, memory_order order)
{
    return thread == FIRST && address == &slot.latest ? memory_order_release : order;
}

static void is_found(model_t which)
{
    (void)explore(which, begin, post, 1, serve, 1, end);
    TEST_ASSERT_NOT_NULL(wrong);
    TEST_ASSERT_EQUAL_STRING("torn", wrong);
    setUp();
}

static void a_service_that_does_not_look_again_is_found(void)
{
    change_load = do_not_look_again;
    is_found(IN_ORDER);
}

static void a_service_that_does_not_announce_what_it_reads_is_found(void)
{
    leave_out_store = do_not_announce;
    is_found(IN_ORDER);
}

static void a_loop_that_does_not_look_who_reads_is_found(void)
{
    change_load = do_not_look_who_reads;
    is_found(IN_ORDER);
}

static void a_loop_that_does_not_take_back_what_it_writes_is_found(void)
{
    leave_out_store = do_not_take_back;
    is_found(IN_ORDER);
}

static void weaker_memory_orders_are_found(void)
{
    change_order = announce_weakly;
    is_found(STORE_BUFFERS);
    change_order = take_back_weakly;
    is_found(STORE_BUFFERS);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(of_two_threads);
    RUN_TEST(of_two_threads_with_store_buffers);
    RUN_TEST(of_a_loop_that_is_interrupted);
    RUN_TEST(trace_frames_leave_in_their_order_and_none_is_missing);
    RUN_TEST(a_service_that_does_not_look_again_is_found);
    RUN_TEST(a_service_that_does_not_announce_what_it_reads_is_found);
    RUN_TEST(a_loop_that_does_not_look_who_reads_is_found);
    RUN_TEST(a_loop_that_does_not_take_back_what_it_writes_is_found);
    RUN_TEST(weaker_memory_orders_are_found);
    return UNITY_END();
}
