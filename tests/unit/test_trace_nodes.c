/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The nodes of the trace: which changes are told, in which frames, and what is marked as old. The statuses are the test's
 * own: no tree is ticked.
 */
#include <string.h>

#include "canopy/trace.h"
#include "fake_can.h"
#include "unity.h"

enum { NODES_MAX = 1000, PLACES = 64, ID = 0x600 };
enum { R = 7, S = 8, F = 9, K = 10, WAS = 16, OLD = 32, NEVER = 32, HALTED = 19 }; /* canopy/status_code.h */

static uint32_t status_words[NODES_MAX / 4 + 1];
static uint32_t sent_words[NODES_MAX / 4];
static uint8_t *const status = (uint8_t *)status_words;
static uint8_t *const sent = (uint8_t *)sent_words;
static canopy_tree_t tree;
static canopy_tree_instance_t instance;
static canopy_bus_t bus;
static canopy_bus_state_t bus_state;
static canopy_cycle_t cycle;
static canopy_tx_t tx;
static canopy_tx_trace_t places[PLACES];
static canopy_trace_config_t config;
static canopy_trace_state_t state;
static uint32_t tick;

static void start(uint16_t nodes)
{
    tree = (canopy_tree_t){.node_count = nodes};
    memset(status_words, NEVER, sizeof status_words);
    canopy_trace_start(&config, &state, nodes);
    state.snapshot_in = (uint16_t)(config.snapshot_every - 1u); /* not at once */
    tick = 0;
}

void setUp(void)
{
    fake_can_reset();
    bus_state = (canopy_bus_state_t){.bus = &bus};
    instance = (canopy_tree_instance_t){.tree = &tree, .status = status};
    config = (canopy_trace_config_t){
        .id = ID, .data_id = CANOPY_E2E_NONE, .changes_max = 4, .snapshot_every = 60000, .model_every = 60000};
    state = (canopy_trace_state_t){.sent = sent};
    TEST_ASSERT_EQUAL(
        CANOPY_OK,
        canopy_tx_init(&tx, NULL, 0, &(canopy_tx_memory_t){.trace = places, .trace_capacity = PLACES}, &fake_can));
    start(20);
}

void tearDown(void)
{
}

/** A tick's trace; fake.tx is what it sends. */
static void trace(void)
{
    fake.tx_count = 0;
    canopy_trace_send(&config, &state, &instance, &tx,
                      &(canopy_trace_tick_t){
                          .tick = tick, .root = CANOPY_RUNNING, .cycle = &cycle, .bus = &bus_state, .until = 1000});
    canopy_tx_service(&tx, 0);
    tick++;
}

/** Ticks until a tick does not differ from the one before. */
static void settle(void)
{
    trace();
    trace();
    trace();
    TEST_ASSERT_EQUAL_HEX8(0, fake.tx[0].data[6] & 0xC0);
}

static const uint8_t *frame_of(canopy_trace_message_t message, unsigned number)
{
    for (unsigned frame = 0; frame < fake.tx_count; frame++) {
        if (fake.tx[frame].id == (uint32_t)ID + (uint32_t)message && number-- == 0u) {
            return fake.tx[frame].data;
        }
    }
    TEST_FAIL_MESSAGE("no such frame");
    return NULL;
}

static unsigned count_of(canopy_trace_message_t message)
{
    unsigned count = 0;

    for (unsigned frame = 0; frame < fake.tx_count; frame++) {
        count += fake.tx[frame].id == (uint32_t)ID + (uint32_t)message ? 1u : 0u;
    }
    return count;
}

/** The frame's bytes, but for its sequence number. */
static void expect_change(unsigned number, unsigned more, const uint8_t rest[7])
{
    const uint8_t *frame = frame_of(CANOPY_TRACE_CHANGE, number);

    TEST_ASSERT_EQUAL_UINT8(more, frame[0] >> 6);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(rest, &frame[1], 7);
}

static void codes_say_what_was_last_and_when(void)
{
    static const struct {
        uint8_t stored;
        uint8_t code;
        canopy_status_t now;
    } cases[] = {
        {NEVER, 0, CANOPY_IDLE},
        {0, 0, CANOPY_IDLE},
        {NEVER | WAS, 0, CANOPY_IDLE},
        {R, 1, CANOPY_RUNNING},
        {S, 2, CANOPY_SUCCESS},
        {F, 3, CANOPY_FAILURE},
        {K, 4, CANOPY_SKIPPED},
        {R | OLD, 5, CANOPY_RUNNING},
        {S | OLD, 6, CANOPY_SUCCESS},
        {F | OLD, 7, CANOPY_FAILURE},
        {K | OLD, 8, CANOPY_SKIPPED},
        {HALTED, 9, CANOPY_IDLE},
        {S | WAS, 10, CANOPY_IDLE},
        {F | WAS, 11, CANOPY_IDLE},
        {HALTED | OLD, 12, CANOPY_IDLE},
        {S | WAS | OLD, 13, CANOPY_IDLE},
        {F | WAS | OLD, 14, CANOPY_IDLE},
        {K | WAS, 4, CANOPY_IDLE},
        {K | WAS | OLD, 8, CANOPY_IDLE},
        {3, 0, CANOPY_IDLE},  /* never stored */
        {6, 0, CANOPY_IDLE},  /* nor this */
        {11, 0, CANOPY_IDLE}, /* nor this */
    };

    for (unsigned number = 0; number < sizeof cases / sizeof cases[0]; number++) {
        TEST_ASSERT_EQUAL_UINT8(cases[number].code, canopy_status_code(cases[number].stored));
        TEST_ASSERT_EQUAL(cases[number].now, canopy_status_now(cases[number].stored));
    }
    TEST_ASSERT_EQUAL_HEX8(HALTED, canopy_status_reset(canopy_status_stored(CANOPY_RUNNING)));
}

static void a_tick_in_which_nothing_happens_is_two_frames(void)
{
    settle();
    TEST_ASSERT_EQUAL_UINT(2, fake.tx_count);
    TEST_ASSERT_EQUAL_HEX32(ID, fake.tx[0].id);
    TEST_ASSERT_EQUAL_HEX32(ID + 1, fake.tx[1].id);
}

static void a_node_that_is_ticked_again_with_the_same_result_is_no_change(void)
{
    memset(status, S, 20);
    trace();
    TEST_ASSERT_EQUAL_UINT(4, count_of(CANOPY_TRACE_CHANGE)); /* 20 nodes, five in a frame */
    for (unsigned again = 0; again < 3u; again++) {
        TEST_ASSERT_EACH_EQUAL_HEX8(S | OLD, status, 20);
        memset(status, S, 20); /* the tick stores it */
        trace();
        TEST_ASSERT_EQUAL_UINT(0, count_of(CANOPY_TRACE_CHANGE));
    }
}

static void a_node_that_is_not_ticked_any_more_is_told_once(void)
{
    static const uint8_t ticked[] = {0x00, 0x00, 0x52, 0xFF, 0xFF, 0xFF, 0xFF}; /* node 5: SUCCESS */
    static const uint8_t kept[] = {0x00, 0x10, 0x56, 0xFF, 0xFF, 0xFF, 0xFF};
    static const uint8_t again[] = {0x00, 0x30, 0x52, 0xFF, 0xFF, 0xFF, 0xFF};

    status[5] = S;
    trace();
    expect_change(0, 1, ticked);
    trace();
    expect_change(0, 1, kept);
    trace();
    TEST_ASSERT_EQUAL_UINT(0, count_of(CANOPY_TRACE_CHANGE));
    status[5] = S;
    trace();
    expect_change(0, 1, again);
}

static void bytes_that_differ_and_have_one_code_are_no_change(void)
{
    status[3] = K;
    trace();
    status[3] = K | WAS;
    status[7] = NEVER | WAS;
    trace();
    TEST_ASSERT_EQUAL_UINT(0, count_of(CANOPY_TRACE_CHANGE));
    TEST_ASSERT_EQUAL_HEX8(K | WAS, sent[3]);
}

static void far_nodes_are_skipped_to_or_begin_a_frame(void)
{
    static const uint8_t near[] = {0x00, 0x00, 0x01, 0xF2, 0x0F, 0x02, 0xFF};   /* 0, 16, 33 */
    static const uint8_t first[] = {0x00, 0x00, 0x02, 0xDF, 0x02, 0xDF, 0x02};  /* 0, 225, 450 */
    static const uint8_t second[] = {0x1C, 0x00, 0x32, 0xDF, 0x0F, 0x12, 0xFF}; /* 451, 693 */

    start(1000);
    status[0] = R;
    status[16] = S;
    status[33] = S;
    status[50] = S;
    trace();
    TEST_ASSERT_EQUAL_UINT(2, count_of(CANOPY_TRACE_CHANGE));
    expect_change(0, 0, near);
    start(1000);
    status[0] = S;
    status[225] = S;
    status[450] = S;
    status[451] = S;
    status[693] = S;
    trace();
    expect_change(0, 0, first);
    expect_change(1, 1, second);
}

static void what_does_not_fit_comes_with_the_next_ticks_in_turn(void)
{
    static const uint8_t results[] = {S, F, K, R, HALTED};
    const uint8_t *frame;

    config.changes_max = 2;
    start(40);
    for (unsigned round = 0; round < 8u; round++) {
        memset(status, results[round % 5u], 40); /* all of them, in every tick */
        trace();
        TEST_ASSERT_EQUAL_UINT(2, count_of(CANOPY_TRACE_CHANGE));
        frame = frame_of(CANOPY_TRACE_CHANGE, 0);
        TEST_ASSERT_EQUAL_UINT8(round * 10u % 40u, (frame[1] & 0xFu) * 16u + (frame[3] >> 4));
        TEST_ASSERT_EQUAL_UINT8(2, frame_of(CANOPY_TRACE_CHANGE, 1)[0] >> 6);
        TEST_ASSERT_EACH_EQUAL_HEX8(results[round % 5u] | OLD, status, 40);
    }
    memset(status, F, 40);
    for (unsigned left = 0; left < 3u; left++) {
        trace();
        memset(status, F, 40);
    }
    trace();
    TEST_ASSERT_EQUAL_UINT(0, count_of(CANOPY_TRACE_CHANGE));
}

/* Those before the cursor that have not changed lie between others that have: the search goes once around. */
static void the_search_goes_around_and_ends_where_it_began(void)
{
    config.changes_max = 1;
    start(40);
    for (unsigned node = 10; node < 18u; node++) {
        status[node] = S;
    }
    trace(); /* 10 .. 14; 15 is next */
    TEST_ASSERT_EQUAL_UINT16(15, state.next_node);
    for (unsigned node = 10; node < 18u; node++) {
        status[node] = S;
    }
    status[12] = F;
    trace(); /* 15, 16, 17; a new frame would be 12's, and there is none */
    TEST_ASSERT_EQUAL_UINT8(2, frame_of(CANOPY_TRACE_CHANGE, 0)[0] >> 6);
    TEST_ASSERT_EQUAL_UINT16(12, state.next_node);
    for (unsigned node = 10; node < 18u; node++) {
        status[node] = node == 12u ? F : S;
    }
    trace();
    TEST_ASSERT_EQUAL_UINT8(1, frame_of(CANOPY_TRACE_CHANGE, 0)[0] >> 6);
    TEST_ASSERT_EQUAL_UINT16(0, state.next_node);
    config.changes_max = 4;
    state.next_node = 30; /* and nothing behind it */
    status[31] = S;
    trace();
    TEST_ASSERT_EQUAL_UINT(3, count_of(CANOPY_TRACE_CHANGE)); /* 31; 10 .. 17, which are not ticked */
    TEST_ASSERT_EQUAL_UINT8(1, frame_of(CANOPY_TRACE_CHANGE, 0)[1]);
    TEST_ASSERT_EQUAL_UINT8(0, frame_of(CANOPY_TRACE_CHANGE, 1)[1]);
}

/* The case: 16 low nodes flip in every tick, and a later one changes. */
static void a_later_node_has_its_turn_however_often_others_change(void)
{
    unsigned ticks = 0;
    bool told = false;

    config.changes_max = 2;
    start(200);
    memset(status, S, 200);
    for (unsigned settled = 0; settled < 30u; settled++) {
        trace();
        memset(status, S, 200);
    }
    while (!told) {
        for (unsigned node = 0; node < 16u; node++) {
            status[node] = tick % 2u == 0u ? S : F;
        }
        memset(&status[16], S, 184);
        status[150] = R;
        trace();
        ticks++;
        told = sent[150] == (uint8_t)R;
        TEST_ASSERT_LESS_OR_EQUAL_UINT(10, ticks); /* 150 / 16 */
    }
}

static void a_snapshot_shows_ten_nodes_and_counts_as_told(void)
{
    static const uint8_t first[] = {0x00, 0x00, 0x21, 0x43, 0xA9, 0x0B, 0x00};
    static const uint8_t last[] = {0x02, 0x80, 0x22, 0xF2, 0xFF, 0xFF, 0xFF};

    config.snapshot_every = 2;
    start(23);
    state.snapshot_in = 0;
    status[0] = R;
    status[1] = S;
    status[2] = F;
    status[3] = K;
    status[4] = HALTED;
    status[5] = S | WAS;
    status[6] = F | WAS;
    trace();
    TEST_ASSERT_EQUAL_UINT(5, fake.tx_count); /* Tick, Inputs, both pages of Model, Snapshot: no Change */
    TEST_ASSERT_EQUAL_HEX8(0x40, frame_of(CANOPY_TRACE_TICK, 0)[6]);
    TEST_ASSERT_EQUAL_UINT8(1, frame_of(CANOPY_TRACE_SNAPSHOT, 0)[0]);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(first, &frame_of(CANOPY_TRACE_SNAPSHOT, 0)[1], 7);
    trace();
    TEST_ASSERT_EQUAL_UINT(0, count_of(CANOPY_TRACE_SNAPSHOT));
    trace();
    TEST_ASSERT_EQUAL_HEX8(1, frame_of(CANOPY_TRACE_SNAPSHOT, 0)[1]);
    trace();
    memset(status, S, 23);
    trace();
    TEST_ASSERT_EQUAL_UINT(7,
                           fake.tx_count); /* Tick, Inputs, Snapshot, 20 nodes in 4 frames: 20 to 22 are told already */
    TEST_ASSERT_EQUAL_UINT8(1, frame_of(CANOPY_TRACE_CHANGE, 3)[0] >> 6);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(last, &frame_of(CANOPY_TRACE_SNAPSHOT, 0)[1], 7);
    trace();
    trace();
    TEST_ASSERT_EQUAL_HEX8(0, frame_of(CANOPY_TRACE_SNAPSHOT, 0)[1]); /* from the beginning */
}

static void tail_and_words_are_compared_alike(void)
{
    for (uint16_t nodes = 1; nodes < 12u; nodes++) {
        for (uint16_t node = 0; node < nodes; node++) {
            start(nodes);
            memset(status, S, nodes);
            trace();
            memset(status, S, nodes);
            trace();
            memset(status, S, nodes);
            status[node] = F;
            trace();
            TEST_ASSERT_EQUAL_UINT(1, count_of(CANOPY_TRACE_CHANGE));
            TEST_ASSERT_EQUAL_HEX8(0x03u | ((unsigned)node << 4), frame_of(CANOPY_TRACE_CHANGE, 0)[3]);
            TEST_ASSERT_EQUAL_HEX8(NEVER, status[nodes]); /* nothing behind the last one is touched */
        }
    }
}

static void after_an_exchange_it_begins_with_the_first_nodes_and_tells_which_tree_it_is(void)
{
    unsigned models = 0;

    settle();
    tree.node_count = 12;
    state.next_node = 15;
    state.next_shown = 10;
    canopy_trace_follow_exchange(&state);
    for (unsigned again = 0; again < 5u; again++) {
        trace();
        models += count_of(CANOPY_TRACE_MODEL) / 2u;
        TEST_ASSERT_EQUAL_UINT(again == 0u ? 1u : 0u, count_of(CANOPY_TRACE_SNAPSHOT));
    }
    TEST_ASSERT_EQUAL_UINT(3, models);
    state.next_node = 12; /* a cursor beyond the tree begins at 0 */
    status[2] = S;
    trace();
    TEST_ASSERT_EQUAL_HEX8(0x22, frame_of(CANOPY_TRACE_CHANGE, 0)[3]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(codes_say_what_was_last_and_when);
    RUN_TEST(a_tick_in_which_nothing_happens_is_two_frames);
    RUN_TEST(a_node_that_is_ticked_again_with_the_same_result_is_no_change);
    RUN_TEST(a_node_that_is_not_ticked_any_more_is_told_once);
    RUN_TEST(bytes_that_differ_and_have_one_code_are_no_change);
    RUN_TEST(far_nodes_are_skipped_to_or_begin_a_frame);
    RUN_TEST(what_does_not_fit_comes_with_the_next_ticks_in_turn);
    RUN_TEST(the_search_goes_around_and_ends_where_it_began);
    RUN_TEST(a_later_node_has_its_turn_however_often_others_change);
    RUN_TEST(a_snapshot_shows_ten_nodes_and_counts_as_told);
    RUN_TEST(tail_and_words_are_compared_alike);
    RUN_TEST(after_an_exchange_it_begins_with_the_first_nodes_and_tells_which_tree_it_is);
    return UNITY_END();
}
