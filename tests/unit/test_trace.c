/* SPDX-License-Identifier: MIT */
/** @file The trace of the loop: heartbeat, what the tick worked with, values, health, which tree. */
#include <string.h>

#include "canopy/e2e.h"
#include "fake_can.h"
#include "small_app.h"
#include "still_clock.h"
#include "unity.h"

enum { DATA_ID = 0x1234 };

/** What the traced values lie in. */
typedef struct {
    int8_t small;
    uint8_t byte;
    int16_t half;
    uint16_t unsigned_half;
    int32_t word;
    uint64_t whole;
    uint32_t single; /* in place of a float: the bits of one */
    uint64_t twice;
} values_t;

#define VALUE(member, its_kind) {.offset = offsetof(values_t, member), .kind = CANOPY_TRACE_##its_kind}
static const canopy_trace_value_t traced[] = {
    VALUE(small, I8),  VALUE(byte, U8),    VALUE(half, I16),     VALUE(unsigned_half, U16), VALUE(word, WORD),
    VALUE(whole, LOW), VALUE(whole, HIGH), VALUE(single, FLOAT), VALUE(twice, DOUBLE_LOW),  VALUE(twice, DOUBLE_HIGH)};
enum { SLOTS = sizeof traced / sizeof traced[0] };

static small_memory_t memory;
static uint32_t told[SLOTS];
static values_t values;
static canopy_app_t app;
static canopy_can_t can;
static canopy_trace_config_t traces;
static canopy_loop_config_t config;
static canopy_loop_t loop;

static void start(void)
{
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&loop, &config));
}

void setUp(void)
{
    fake_can_reset();
    can = fake_can;
    values = (values_t){0};
    app = small_app(&memory);
    traces = trace;
    traces.health_every = 60000;
    app.trace = &traces;
    app.told = told;
    app.memory = &values;
    config = (canopy_loop_config_t){.app = &app, .can = &can, .clock = &still_clock};
    clock_now = 0;
    start();
}

void tearDown(void)
{
}

static void cycle(unsigned frames)
{
    fake.rx_count = frames;
    fake.rx_taken = 0;
    fake.tx_count = 0;
    (void)canopy_loop_cycle(&loop, clock_now);
}

static const canopy_can_frame_t *frame_of(canopy_trace_message_t message, unsigned number)
{
    for (unsigned frame = 0; frame < fake.tx_count; frame++) {
        if (fake.tx[frame].id == traces.id + (uint32_t)message && number-- == 0u) {
            return &fake.tx[frame];
        }
    }
    TEST_FAIL_MESSAGE("no such frame");
    return NULL;
}

static unsigned count_of(canopy_trace_message_t message)
{
    unsigned count = 0;

    for (unsigned frame = 0; frame < fake.tx_count; frame++) {
        count += fake.tx[frame].id == traces.id + (uint32_t)message ? 1u : 0u;
    }
    return count;
}

static void expect(canopy_trace_message_t message, unsigned number, const uint8_t data[8])
{
    TEST_ASSERT_EQUAL_UINT8(8, frame_of(message, number)->length);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(data, frame_of(message, number)->data, 8);
}

/** A frame of message `number` that has arrived `age_ms` ago. */
static void arrive(unsigned number, unsigned age_ms)
{
    fake.rx[fake.rx_count++] =
        (canopy_can_frame_t){.time = clock_now - 1000u * (canopy_time_t)age_ms, .id = RX_ID + number, .length = 1};
}

/** A cycle that takes what has arrived. */
static void cycle_with_arrived(void)
{
    fake.rx_taken = 0;
    fake.tx_count = 0;
    (void)canopy_loop_cycle(&loop, clock_now);
    fake.rx_count = 0;
}

/* --- CanopyTick ----------------------------------------------------------------------------------------------------- */

static void the_heartbeat_tells_number_root_overruns_and_what_follows(void)
{
    static const uint8_t first[] = {0, 0x20, 0, 0, 0, 0, 0x40, 0x02}; /* the snapshot has shown the one node */
    static const uint8_t later[] = {0, 0x20, 4, 3, 2, 1, 0x02, 0xC2};

    cycle(0);
    expect(CANOPY_TRACE_TICK, 0, first);
    loop.ticks = 0x01020304;
    loop.overruns = 7;
    cycle(0);
    expect(CANOPY_TRACE_TICK, 0, later);
}

static void the_sequence_counts_to_63_and_tick_0_with_0_is_the_start_only(void)
{
    for (unsigned number = 0; number < 130u; number++) {
        cycle(0);
    }
    TEST_ASSERT_EQUAL_UINT8(131u % 64u, memory.trace_state.sequence); /* the first tick had a snapshot, too */
    memory.trace_state.sequence = 0;
    loop.ticks = 0;
    cycle(0);
    TEST_ASSERT_EQUAL_UINT8(1, frame_of(CANOPY_TRACE_TICK, 0)->data[6]);
    loop.ticks = 0;
    cycle(0);
    TEST_ASSERT_EQUAL_UINT8(2, frame_of(CANOPY_TRACE_TICK, 0)->data[6]);
}

static void the_heartbeat_can_be_guarded(void)
{
    canopy_e2e_receiver_t receiver = {0};

    traces.data_id = DATA_ID;
    for (unsigned number = 0; number < 40u; number++) {
        cycle(0);
        TEST_ASSERT_EQUAL(CANOPY_E2E_OK, canopy_e2e_check(&receiver, DATA_ID, frame_of(CANOPY_TRACE_TICK, 0)->data, 8));
        TEST_ASSERT_EQUAL_UINT8(number % CANOPY_E2E_COUNTERS, frame_of(CANOPY_TRACE_TICK, 0)->data[1] & 15u);
        TEST_ASSERT_EQUAL_UINT8(CANOPY_TRACE_VERSION, frame_of(CANOPY_TRACE_TICK, 0)->data[1] >> 4);
    }
}

static void ids_may_have_29_bits(void)
{
    traces.id = UINT32_C(0x18FF0000);
    traces.flags = CANOPY_CAN_EXTENDED;
    cycle(0);
    TEST_ASSERT_EQUAL_HEX8(CANOPY_CAN_EXTENDED, frame_of(CANOPY_TRACE_SNAPSHOT, 0)->flags);
}

static void lost_frames_have_used_up_their_numbers(void)
{
    canopy_tx_counters_t counters;

    fake.tx_result = 0;
    for (unsigned number = 0; number < 10u; number++) {
        cycle(0); /* 6 frames, and then 2 a tick: 16 have room */
    }
    canopy_tx_count(&memory.tx, &counters);
    TEST_ASSERT_EQUAL_UINT32(6 + 9 * 2 - TRACE_PLACES, counters.trace_dropped);
    TEST_ASSERT_EQUAL_UINT8(11, memory.trace_state.sequence);
    clock_now = (canopy_time_t)CANOPY_TRACE_PERIODS * PERIOD_US;
    cycle(0); /* all that wait are too late now */
    fake.tx_result = 1;
    cycle(0);
    TEST_ASSERT_EQUAL_UINT8(11, frame_of(CANOPY_TRACE_TICK, 0)->data[6]);
}

/* --- CanopyInputs, CanopyArrivals ----------------------------------------------------------------------------------- */

static void inputs_tell_time_frames_check_and_the_bus(void)
{
    static const uint8_t quiet[] = {0xA6, 0xA5, 0xA4, 200, 0xD2, 0x00, 0, 0}; /* 0x5A, rotated */
    static const uint8_t passive[] = {0xA6, 0xA5, 0xA4, 200, 0x94, 0x02, 0, 0};

    clock_now = UINT64_C(0xFFFFA1A2A3A4A5A6);
    memory.bus_state.taken = 0xFFFFFF00u + 200u;
    memory.trace_state.taken = memory.bus_state.taken;
    memory.bus_state.check = 0x5A;
    cycle(0);
    expect(CANOPY_TRACE_INPUTS, 0, quiet);
    fake.controller = CANOPY_CAN_CONTROLLER_PASSIVE;
    cycle(0);
    expect(CANOPY_TRACE_INPUTS, 0, passive);
    fake.controller = CANOPY_CAN_CONTROLLER_ACTIVE;
    fake.rx_dropped = 1;
    cycle(0);
    TEST_ASSERT_EQUAL_HEX8(0x08, frame_of(CANOPY_TRACE_INPUTS, 0)->data[5]);
    fake.controller = CANOPY_CAN_CONTROLLER_DOWN;
    cycle(0);
    TEST_ASSERT_EQUAL_HEX8(0x10 | CANOPY_CAN_DOWN, frame_of(CANOPY_TRACE_INPUTS, 0)->data[5]);
    TEST_ASSERT_EQUAL_UINT(0, count_of(CANOPY_TRACE_ARRIVALS));
}

static void ages_fill_inputs_first_and_then_frames_of_seven(void)
{
    static const uint8_t rest[] = {0x90 | 1, 7, 0, 0, 0, 0, 0, 0};

    clock_now = 1000000;
    cycle_with_arrived();
    arrive(3, 254);
    cycle_with_arrived();
    TEST_ASSERT_EQUAL_HEX8(0x20, frame_of(CANOPY_TRACE_INPUTS, 0)->data[5]);
    TEST_ASSERT_EQUAL_UINT8(254, frame_of(CANOPY_TRACE_INPUTS, 0)->data[6]);
    TEST_ASSERT_EQUAL_UINT8(0, frame_of(CANOPY_TRACE_INPUTS, 0)->data[7]);
    arrive(4, 9);
    arrive(1, 3);
    cycle_with_arrived();
    TEST_ASSERT_EQUAL_HEX8(0x40, frame_of(CANOPY_TRACE_INPUTS, 0)->data[5]);
    TEST_ASSERT_EQUAL_UINT8(3, frame_of(CANOPY_TRACE_INPUTS, 0)->data[6]); /* in the order of the ids */
    TEST_ASSERT_EQUAL_UINT8(9, frame_of(CANOPY_TRACE_INPUTS, 0)->data[7]);
    TEST_ASSERT_EQUAL_UINT(0, count_of(CANOPY_TRACE_ARRIVALS));
    loop.ticks = 0x11;
    arrive(0, 5);
    arrive(1, 6);
    arrive(2, 7);
    cycle_with_arrived();
    TEST_ASSERT_EQUAL_HEX8(0x60, frame_of(CANOPY_TRACE_INPUTS, 0)->data[5]);
    TEST_ASSERT_EQUAL_UINT(1, count_of(CANOPY_TRACE_ARRIVALS));
    expect(CANOPY_TRACE_ARRIVALS, 0, rest);
}

static void old_frames_have_ages_of_three_bytes(void)
{
    static const uint8_t first[] = {0x70, 0x00, 255, 0x2C, 0x01, 255, 0xFF, 0xFF};
    static const uint8_t last[] = {0xB0, 255, 0xFF, 0xFF, 0, 0, 0, 0};

    clock_now = UINT64_C(200000000);
    loop.ticks = 0x20;
    arrive(0, 255);
    arrive(1, 300);
    arrive(2, 70000);
    arrive(3, 100000);
    cycle_with_arrived();
    TEST_ASSERT_EQUAL_HEX8(0x60, frame_of(CANOPY_TRACE_INPUTS, 0)->data[5]);
    TEST_ASSERT_EQUAL_UINT8(255, frame_of(CANOPY_TRACE_INPUTS, 0)->data[6]);
    TEST_ASSERT_EQUAL_UINT8(255, frame_of(CANOPY_TRACE_INPUTS, 0)->data[7]);
    TEST_ASSERT_EQUAL_UINT(2, count_of(CANOPY_TRACE_ARRIVALS));
    expect(CANOPY_TRACE_ARRIVALS, 0, first);
    expect(CANOPY_TRACE_ARRIVALS, 1, last);
}

static void many_frames_of_a_tick_are_counted(void)
{
    static const uint8_t rest[] = {0xC0, 0, 0, 8, 0, 0, 0, 0};

    clock_now = 1000000;
    memory.bus_state.taken = 255; /* as if this cycle had taken so many before */
    arrive(2, 8);
    cycle_with_arrived();
    TEST_ASSERT_EQUAL_HEX8(0xE0, frame_of(CANOPY_TRACE_INPUTS, 0)->data[5]);
    TEST_ASSERT_EQUAL_UINT8(0, frame_of(CANOPY_TRACE_INPUTS, 0)->data[3]);
    TEST_ASSERT_EQUAL_UINT8(0, frame_of(CANOPY_TRACE_INPUTS, 0)->data[6]);
    TEST_ASSERT_EQUAL_UINT8(1, frame_of(CANOPY_TRACE_INPUTS, 0)->data[7]); /* 256 */
    TEST_ASSERT_EQUAL_HEX8(0xB0, frame_of(CANOPY_TRACE_ARRIVALS, 0)->data[0]);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(&rest[1], &frame_of(CANOPY_TRACE_ARRIVALS, 0)->data[1], 7);
}

/* --- CanopyModel ---------------------------------------------------------------------------------------------------- */

static void the_model_tells_the_tree_and_the_upper_bits_of_the_time(void)
{
    static const uint8_t which[] = {0x20, 0, 0, 0, 0, 1, 0, 0};
    static const uint8_t time[] = {0x21, 0, 0, 0xA3, 0xA2, 0xA1, 0, 0};
    static const uint8_t again[] = {0x21, 2, 0, 0xA4, 0xA2, 0xA1, 0, 0};

    clock_now = UINT64_C(0xFFFFA1A2A3FFFFFF);
    cycle(0);
    expect(CANOPY_TRACE_MODEL, 0, which);
    expect(CANOPY_TRACE_MODEL, 1, time);
    cycle(0);
    TEST_ASSERT_EQUAL_UINT(0, count_of(CANOPY_TRACE_MODEL));
    clock_now++;
    cycle(0);
    TEST_ASSERT_EQUAL_UINT(1, count_of(CANOPY_TRACE_MODEL));
    expect(CANOPY_TRACE_MODEL, 0, again);
    traces.model_every = 2;
    start();
    for (unsigned number = 0; number < 6u; number++) {
        cycle(0);
        TEST_ASSERT_EQUAL_UINT(number % 2u == 0u ? 2u : 0u, count_of(CANOPY_TRACE_MODEL));
    }
}

/* --- CanopyValue ---------------------------------------------------------------------------------------------------- */

static void trace_values(uint8_t values_max, uint16_t every)
{
    traces.values = traced;
    traces.value_count = SLOTS;
    traces.values_max = values_max;
    traces.values_every = every;
    memset(told, 0xFF, sizeof told);
    start();
    cycle(0); /* tells slot 0 in any case */
}

static void expect_value(unsigned number, unsigned slot, uint32_t value)
{
    const uint8_t *data = frame_of(CANOPY_TRACE_VALUE, number)->data;

    TEST_ASSERT_EQUAL_UINT(slot, data[0] | (data[1] & 15u) << 8);
    TEST_ASSERT_EQUAL_UINT8((loop.ticks - 1u) & 15u, data[1] >> 4);
    TEST_ASSERT_EQUAL_HEX32(value,
                            data[4] | (uint32_t)data[5] << 8 | (uint32_t)data[6] << 16 | (uint32_t)data[7] << 24);
}

static void values_are_told_when_they_change(void)
{
    trace_values(7, 60000);
    TEST_ASSERT_EQUAL_UINT(1, count_of(CANOPY_TRACE_VALUE));
    cycle(0);
    TEST_ASSERT_EQUAL_UINT(0, count_of(CANOPY_TRACE_VALUE));
    TEST_ASSERT_EQUAL_HEX8(0, frame_of(CANOPY_TRACE_TICK, 0)->data[7] & 0x38);
    values = (values_t){-2, 254, -3, 65533, -4, UINT64_C(0x1122334455667788), 0, 0};
    cycle(0);
    TEST_ASSERT_EQUAL_HEX8(7u << 3, frame_of(CANOPY_TRACE_TICK, 0)->data[7] & 0x38);
    TEST_ASSERT_EQUAL_UINT(7, count_of(CANOPY_TRACE_VALUE));
    expect_value(0, 0, UINT32_MAX - 1u);
    expect_value(1, 1, 254);
    expect_value(2, 2, UINT32_MAX - 2u);
    expect_value(3, 3, 65533);
    expect_value(4, 4, UINT32_MAX - 3u);
    expect_value(5, 5, 0x55667788);
    expect_value(6, 6, 0x11223344);
    TEST_ASSERT_EQUAL_UINT8(0, frame_of(CANOPY_TRACE_VALUE, 6)->data[2]);
    cycle(0);
    TEST_ASSERT_EQUAL_UINT(0, count_of(CANOPY_TRACE_VALUE));
    values.single = 0x3FC00000;
    values.twice = UINT64_C(0x400921FB54442D18);
    cycle(0);
    TEST_ASSERT_EQUAL_UINT(3, count_of(CANOPY_TRACE_VALUE));
    expect_value(0, 7, 0x3FC00000);
    expect_value(1, 8, 0x54442D18);
    expect_value(2, 9, 0x400921FB);
}

static void values_that_do_not_fit_come_in_turn(void)
{
    trace_values(2, 60000);
    values = (values_t){1, 1, 1, 1, 1, 1, 0, 0};
    cycle(0);
    expect_value(0, 0, 1);
    expect_value(1, 1, 1);
    TEST_ASSERT_EQUAL_UINT8(1, frame_of(CANOPY_TRACE_VALUE, 0)->data[2]);
    TEST_ASSERT_EQUAL_UINT8(1, frame_of(CANOPY_TRACE_VALUE, 1)->data[2]);
    values.small = 2;
    values.byte = 2;
    cycle(0);
    expect_value(0, 2, 1);
    expect_value(1, 3, 1);
    cycle(0);
    expect_value(0, 4, 1);
    expect_value(1, 5, 1);
    cycle(0);
    expect_value(0, 0, 2);
    expect_value(1, 1, 2);
    TEST_ASSERT_EQUAL_UINT8(0, frame_of(CANOPY_TRACE_VALUE, 1)->data[2]);
}

static void values_that_do_not_change_are_told_slowly(void)
{
    unsigned slot = 1;

    trace_values(1, 3);
    for (unsigned number = 1; number < 60u; number++) {
        cycle(0);
        if (number % 3u == 0u) {
            expect_value(0, slot % SLOTS, 0);
            slot++;
        } else {
            TEST_ASSERT_EQUAL_UINT(0, count_of(CANOPY_TRACE_VALUE));
        }
    }
}

static void a_value_whose_turn_it_is_comes_once_though_it_has_changed(void)
{
    trace_values(3, 2);
    values.byte = 5;
    values.word = 6;
    cycle(0);
    TEST_ASSERT_EQUAL_UINT(2, count_of(CANOPY_TRACE_VALUE));
    values.byte = 7; /* slot 1's turn */
    values.word = 8;
    cycle(0);
    TEST_ASSERT_EQUAL_UINT(2, count_of(CANOPY_TRACE_VALUE));
    expect_value(0, 1, 7);
    expect_value(1, 4, 8);
}

/* --- CanopyHealth --------------------------------------------------------------------------------------------------- */

static void health_has_five_pages_in_turn(void)
{
    static const uint8_t pages[][8] = {{0, 3, 0, 4, 0, 5, 0, 6},
                                       {1, 7, 0, 8, 0, 9, 0, 10},
                                       {2, 11, 0, 0x56, 0x34, 0x12, 13, 0},
                                       {3, 0x10, 0x22, 0, 0, 0, 0xF1, 14},
                                       {4, 15, 0, 16, 0, 17, 0, 0}};

    traces.health_every = 2;
    start();
    memory.bus_state.counters =
        (canopy_bus_counters_t){.wrong_form = 1, .wrong_crc = 2, .unknown_id = 4, .timeouts = 17};
    loop.rx_lost = 5;
    fake.rx_dropped = 5;
    loop.rx_backlogs = 6;
    memory.tx.replaced = 7;
    memory.tx.expired = 8;
    memory.tx.trace_late = 4;
    memory.tx.trace_full = 5;
    loop.can_manager.restarts = 10;
    loop.overruns = 11;
    loop.longest_cycle = 0x123456;
    loop.most_late = 121;
    loop.lateness[1] = 1;
    loop.lateness[2] = 4;
    loop.lateness[3] = 15;
    loop.lateness[10] = 3;
    loop.lateness[11] = UINT32_MAX;
    loop.slips = 14;
    memory.instance.faults = 15;
    loop.rx_errors = 16;
    for (unsigned number = 0; number < 20u; number++) {
        cycle(0);
        TEST_ASSERT_EQUAL_UINT(number % 2u == 0u ? 1u : 0u, count_of(CANOPY_TRACE_HEALTH));
        if (number % 2u == 0u) {
            expect(CANOPY_TRACE_HEALTH, 0, pages[number / 2u % 5u]);
        }
    }
}

static void health_stops_at_its_largest_values_and_tells_of_a_filter(void)
{
    static const uint8_t pages[][8] = {{0x10, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF},
                                       {1, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF},
                                       {2, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF},
                                       {3, 0, 0, 0, 0, 0, 0, 0xFF},
                                       {4, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0}};

    traces.health_every = 1;
    can.is_filtered = true;
    can.stats = NULL;
    start();
    memory.bus_state.counters =
        (canopy_bus_counters_t){.wrong_form = UINT32_MAX, .unknown_id = 65536, .timeouts = UINT32_MAX};
    loop.rx_lost = UINT32_MAX;
    loop.rx_backlogs = 255;
    memory.tx.replaced = UINT32_MAX;
    memory.tx.expired = UINT32_MAX;
    memory.tx.trace_late = UINT32_MAX;
    loop.can_manager.restarts = UINT32_MAX;
    loop.overruns = UINT32_MAX;
    loop.longest_cycle = UINT64_MAX;
    loop.most_late = UINT64_C(655351);
    loop.slips = UINT32_MAX;
    memory.instance.faults = UINT32_MAX;
    loop.rx_errors = UINT32_MAX;
    for (unsigned page = 0; page < 5u; page++) {
        cycle(0);
        expect(CANOPY_TRACE_HEALTH, 0, pages[page]);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_heartbeat_tells_number_root_overruns_and_what_follows);
    RUN_TEST(the_sequence_counts_to_63_and_tick_0_with_0_is_the_start_only);
    RUN_TEST(the_heartbeat_can_be_guarded);
    RUN_TEST(ids_may_have_29_bits);
    RUN_TEST(lost_frames_have_used_up_their_numbers);
    RUN_TEST(inputs_tell_time_frames_check_and_the_bus);
    RUN_TEST(ages_fill_inputs_first_and_then_frames_of_seven);
    RUN_TEST(old_frames_have_ages_of_three_bytes);
    RUN_TEST(many_frames_of_a_tick_are_counted);
    RUN_TEST(the_model_tells_the_tree_and_the_upper_bits_of_the_time);
    RUN_TEST(values_are_told_when_they_change);
    RUN_TEST(values_that_do_not_fit_come_in_turn);
    RUN_TEST(values_that_do_not_change_are_told_slowly);
    RUN_TEST(a_value_whose_turn_it_is_comes_once_though_it_has_changed);
    RUN_TEST(health_has_five_pages_in_turn);
    RUN_TEST(health_stops_at_its_largest_values_and_tells_of_a_filter);
    return UNITY_END();
}
