/* SPDX-License-Identifier: MIT */
/** @file The ends of the loop's ranges: what is missing, optional, saturated, or very late. */
#include "canopy/loop.h"
#include "fake_can.h"
#include "unity.h"

enum { PERIOD_US = 1000, TRACE_ID = 0x600 };

static const canopy_node_t nodes[] = {{.type = CANOPY_NODE_ALWAYS_SUCCESS, .end = 1}};
static const canopy_tree_t tree = {.nodes = nodes, .node_count = 1};
static canopy_tree_instance_t instance;
static canopy_bus_state_t bus_state;
static canopy_trace_state_t trace_state;
static canopy_rx_state_t rx_state;
static canopy_tx_t transmit;
static canopy_tx_slot_t slot;
static canopy_tx_trace_t waiting[1];
static uint8_t tx_data[2];
static uint8_t status;
static uint8_t sent;
static int image;

static bool decode(void *input, const uint8_t *data)
{
    (void)input;
    (void)data;
    return true;
}

static void set_age(void *input, bool fresh, uint16_t age_ms)
{
    (void)input;
    (void)fresh;
    (void)age_ms;
}

static void encode(const void *output, uint8_t *data)
{
    (void)output;
    data[0] = 0;
}

static void reset_output(void *output)
{
    (void)output;
}

static void set_cycle(void *input, const canopy_cycle_t *cycle)
{
    (void)input;
    (void)cycle;
}

static const canopy_rx_message_t rx = {
    .id = 1, .length = 1, .data_id = CANOPY_E2E_NONE, .decode = decode, .set_age = set_age};
static const canopy_tx_message_t tx = {
    .id = 2, .length = 1, .data_id = CANOPY_E2E_NONE, .every = 1, .deadline = PERIOD_US, .encode = encode};
static const canopy_bus_t bus = {
    .rx = &rx, .rx_count = 1, .tx = &tx, .tx_count = 1, .reset_output = reset_output, .set_cycle = set_cycle};
static const canopy_bus_t mute_bus = {.rx = &rx, .rx_count = 1, .reset_output = reset_output, .set_cycle = set_cycle};
static const canopy_bus_t silent_bus = {.reset_output = reset_output, .set_cycle = set_cycle};
static const canopy_trace_value_t value = {.kind = CANOPY_TRACE_U8};
static canopy_trace_config_t trace;

/* A clock whose every reading and deadline the test gives. */
static canopy_time_t readings[8];
static unsigned reading;
static unsigned cycles_left;

static canopy_time_t now(void *context)
{
    (void)context;
    return readings[reading++];
}

static bool wait_until(void *context, canopy_time_t deadline)
{
    (void)context;
    (void)deadline;
    return cycles_left-- > 0u;
}

static const canopy_clock_t fake_clock = {.now = now, .wait_until = wait_until};

static canopy_app_t app;
static canopy_loop_config_t config;
static canopy_loop_t loop;

void setUp(void)
{
    fake_can_reset();
    reading = 0;
    for (unsigned place = 0; place < sizeof readings / sizeof readings[0]; place++) {
        readings[place] = 0;
    }
    app = (canopy_app_t){.name = "limits",
                         .period = PERIOD_US,
                         .rx_max = 8,
                         .frame_us = 220,
                         .tree = &tree,
                         .bus = &bus,
                         .trace = &trace,
                         .tree_instance = &instance,
                         .status = &status,
                         .bus_state = &bus_state,
                         .input = &image,
                         .output = &image,
                         .rx = &rx_state,
                         .tx = &transmit,
                         .tx_memory = {.slots = &slot, .data = tx_data, .trace = waiting, .trace_capacity = 1},
                         .trace_state = &trace_state,
                         .sent = &sent,
                         .nodes_max = 1};
    trace = (canopy_trace_config_t){.id = TRACE_ID,
                                    .data_id = CANOPY_E2E_NONE,
                                    .changes_max = 1,
                                    .snapshot_every = 1,
                                    .values_every = 1,
                                    .health_every = 1,
                                    .model_every = 1,
                                    .values = &value};
    config = (canopy_loop_config_t){.app = &app, .can = &fake_can, .clock = &fake_clock};
}

void tearDown(void)
{
}

/** A complete configuration, this change: refused. */
#define INCOMPLETE(change)                                                                           \
    do {                                                                                             \
        setUp();                                                                                     \
        TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&loop, &config));                              \
        change;                                                                                      \
        TEST_ASSERT_EQUAL_MESSAGE(CANOPY_ERROR_ARGUMENT, canopy_loop_init(&loop, &config), #change); \
    } while (false)

static void an_incomplete_configuration_is_refused(void)
{
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_loop_init(NULL, &config));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_loop_init(&loop, NULL));
    INCOMPLETE(config.app = NULL);
    INCOMPLETE(config.can = NULL);
    INCOMPLETE(config.clock = NULL);
    INCOMPLETE(app.period = 0);
    INCOMPLETE(app.tree = NULL);
    INCOMPLETE(app.bus = NULL);
    INCOMPLETE(app.tree_instance = NULL);
    INCOMPLETE(app.status = NULL);
    INCOMPLETE(app.bus_state = NULL);
    INCOMPLETE(app.input = NULL);
    INCOMPLETE(app.output = NULL);
    INCOMPLETE(app.rx = NULL);
    INCOMPLETE(app.tx = NULL);
    INCOMPLETE(app.tx_memory.slots = NULL);
    INCOMPLETE(app.tx_memory.data = NULL);
    INCOMPLETE(app.tx_memory.trace = NULL);
    INCOMPLETE(app.tx_memory.trace_capacity = 0);
    INCOMPLETE(app.tx_memory.trace_capacity = 3);
    INCOMPLETE(app.rx_max = 0);
    INCOMPLETE(app.frame_us = 0);
    INCOMPLETE(app.trace_state = NULL);
    INCOMPLETE(app.sent = NULL);
    INCOMPLETE(app.nodes_max = 0);
    INCOMPLETE(trace.value_count = 1);
    app.trace = NULL; /* without a trace it needs none of these */
    app.trace_state = NULL;
    app.sent = NULL;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&loop, &config));
}

static void a_bus_without_messages_needs_no_state_for_them(void)
{
    app.tx_memory.slots = NULL;
    app.tx_memory.data = NULL;
    app.bus = &mute_bus;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&loop, &config));
    app.bus = &silent_bus;
    app.rx = NULL;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&loop, &config));
}

static void hooks_may_be_missing(void)
{
    fake.rx_error = CANOPY_ERROR_IO; /* a fault that nobody wants to hear of */
    cycles_left = 2;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&loop, &config));
    canopy_loop_run(&loop);
    TEST_ASSERT_EQUAL_UINT32(2, loop.ticks);
    TEST_ASSERT_EQUAL_UINT32(2, loop.rx_errors);
}

static unsigned kicks;

static void kick(void *context)
{
    (void)context;
    kicks++;
}

static bool after_cycle(void *context, canopy_status_t root)
{
    (void)context;
    TEST_ASSERT_EQUAL(CANOPY_SUCCESS, root);
    return kicks < 2u;
}

static void the_hook_after_a_cycle_can_end_the_loop(void)
{
    config.after_cycle = after_cycle;
    config.kick_watchdog = kick;
    cycles_left = 5;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&loop, &config));
    canopy_loop_run(&loop);
    TEST_ASSERT_EQUAL_UINT32(2, loop.ticks);
    TEST_ASSERT_EQUAL_UINT(2, kicks);
}

static canopy_fault_t last_fault;
static uint32_t last_detail;

static void on_fault(void *context, canopy_fault_t fault, uint32_t detail)
{
    (void)context;
    last_fault = fault;
    last_detail = detail;
}

static void a_cycle_longer_than_32_bits_is_told_as_the_largest(void)
{
    app.period = UINT64_C(1) << 33;
    config.on_fault = on_fault;
    cycles_left = 1;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&loop, &config));
    readings[2] = (UINT64_C(1) << 33) + 1u;
    canopy_loop_run(&loop);
    TEST_ASSERT_EQUAL(CANOPY_FAULT_OVERRUN, last_fault);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, last_detail);
    TEST_ASSERT_EQUAL_UINT32(1, loop.slips);
}

static void a_cycle_that_ends_when_the_one_after_the_next_is_due_leaves_out_one(void)
{
    cycles_left = 1;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&loop, &config));
    readings[2] = UINT64_C(2) * PERIOD_US;
    canopy_loop_run(&loop);
    TEST_ASSERT_EQUAL_UINT32(1, loop.overruns);
    TEST_ASSERT_EQUAL_UINT32(1, loop.slips);
    TEST_ASSERT_EQUAL_UINT64(2u * PERIOD_US, loop.deadline);
}

/** One cycle, due at `due`, ends at `end`; how long the account takes may not depend on how much is missed. */
static void end_late(canopy_time_t due, canopy_time_t end)
{
    reading = 0;
    cycles_left = 1;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&loop, &config));
    loop.deadline = due;
    readings[reading] = due;
    readings[reading + 1u] = end;
    (void)canopy_loop_step(&loop);
}

static void a_sleep_of_hours_costs_no_more_than_one_of_a_period(void)
{
    const canopy_time_t sleep = UINT64_C(8) * 3600u * 1000000u;

    app.period = 10000;
    end_late(0, sleep);
    TEST_ASSERT_EQUAL_UINT32(1, loop.overruns);
    TEST_ASSERT_EQUAL_UINT32(8u * 3600u * 100u - 1u, loop.slips);
    TEST_ASSERT_EQUAL_UINT64(sleep, loop.deadline);
    end_late(123, sleep); /* the phase is kept */
    TEST_ASSERT_EQUAL_UINT32(8u * 3600u * 100u - 1u, loop.slips);
    TEST_ASSERT_EQUAL_UINT64(sleep + 123u, loop.deadline);
    end_late(123, sleep + 124u);
    TEST_ASSERT_EQUAL_UINT32(8u * 3600u * 100u, loop.slips);
    TEST_ASSERT_EQUAL_UINT64(sleep + 10123u, loop.deadline);
}

static void slips_are_counted_across_the_wrap_of_time(void)
{
    const canopy_time_t due = UINT64_MAX - 10499u;

    end_late(due, due + 10500u); /* 0: the count has begun again */
    TEST_ASSERT_EQUAL_UINT32(10, loop.slips);
    TEST_ASSERT_EQUAL_UINT64(due + 11000u, loop.deadline);
    TEST_ASSERT_EQUAL_UINT64(500, loop.deadline);
}

/** As many as can be told apart from a time that is yet to come: centuries. It would take hours to go through them. */
static void more_slips_than_can_be_counted_stay_at_the_largest_value(void)
{
    const canopy_time_t longest = (UINT64_C(1) << 63) - 1u;

    app.period = 1;
    end_late(0, longest + 1u);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, loop.slips);
    TEST_ASSERT_EQUAL_UINT64(longest + 1u, loop.deadline);
    end_late(0, UINT64_C(1) << 32);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, loop.slips); /* exactly */
    end_late(0, (UINT64_C(1) << 32) - 1u);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX - 1u, loop.slips);
    loop.deadline = 0;
    loop.slips = UINT32_MAX - 1u;
    reading = 0;
    readings[1] = 3;
    (void)canopy_loop_step(&loop);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, loop.slips);
    TEST_ASSERT_EQUAL_UINT64(3, loop.deadline);
}

/** The account by its definition: each deadline that is past when the cycle ends is one slip. */
static void slips_are_those_of_the_definition(void)
{
    for (canopy_time_t period = 1; period <= 7u; period++) {
        app.period = period;
        for (canopy_time_t end = 0; end < 60u; end++) {
            canopy_time_t due = 5u + period;
            uint32_t past = 0;

            while (due < end) {
                due += period;
                past++;
            }
            end_late(5, end < 5u ? 5u : end);
            TEST_ASSERT_EQUAL_UINT32(past, loop.slips);
            TEST_ASSERT_EQUAL_UINT64(due, loop.deadline);
            TEST_ASSERT_EQUAL_UINT32(past > 0u ? 1u : 0u, loop.overruns);
        }
    }
}

static void a_very_late_start_is_in_the_last_bucket(void)
{
    cycles_left = 1;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&loop, &config));
    readings[1] = UINT64_C(1000000);
    readings[2] = UINT64_C(1000000);
    canopy_loop_run(&loop);
    TEST_ASSERT_EQUAL_UINT32(1, loop.lateness[CANOPY_LATENESS_BUCKETS - 1u]);
    TEST_ASSERT_EQUAL_UINT64(1000000, loop.most_late);
}

static void counters_stay_at_their_largest_value(void)
{
    static const canopy_can_frame_t unknown = {.id = 99, .length = 1};
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&loop, &config));
    bus_state.counters = (canopy_bus_counters_t){.unknown_id = UINT32_MAX, .wrong_form = UINT32_MAX, .wrong_crc = 1};
    canopy_bus_receive(&bus_state, &unknown, 0);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, bus_state.counters.unknown_id);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, canopy_bus_rejected(&bus_state.counters));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(an_incomplete_configuration_is_refused);
    RUN_TEST(a_bus_without_messages_needs_no_state_for_them);
    RUN_TEST(hooks_may_be_missing);
    RUN_TEST(the_hook_after_a_cycle_can_end_the_loop);
    RUN_TEST(a_cycle_longer_than_32_bits_is_told_as_the_largest);
    RUN_TEST(a_cycle_that_ends_when_the_one_after_the_next_is_due_leaves_out_one);
    RUN_TEST(a_sleep_of_hours_costs_no_more_than_one_of_a_period);
    RUN_TEST(slips_are_counted_across_the_wrap_of_time);
    RUN_TEST(more_slips_than_can_be_counted_stay_at_the_largest_value);
    RUN_TEST(slips_are_those_of_the_definition);
    RUN_TEST(a_very_late_start_is_in_the_last_bucket);
    RUN_TEST(counters_stay_at_their_largest_value);
    return UNITY_END();
}
