/* SPDX-License-Identifier: MIT */
/** @file The fixed-period loop and the trace, with a clock and a bus that do what the test says. */
#include <string.h>

#include "canopy/loop.h"
#include "fake_can.h"
#include "unity.h"

enum {
    NODES = 13,
    PERIOD_US = 1000,
    TICK_ID = 0x600,
    CHANGE_ID = 0x601,
    SNAPSHOT_ID = 0x602,
    HEALTH_ID = 0x603,
    INPUTS_ID = 0x604,
    MODEL_ID = 0x605
};

/* --- an application by hand: a ReactiveFallback over twelve conditions -------------------------------------------- */

static canopy_node_t nodes[NODES];
static canopy_status_t returns[NODES];

static canopy_status_t leaf_tick(void *application, uint16_t parameter)
{
    (void)application;
    return returns[parameter];
}

static const canopy_leaf_t leaves[] = {{.tick = leaf_tick}};
static const canopy_tree_t tree = {
    .nodes = nodes, .leaves = leaves, .node_count = NODES, .leaf_count = 1, .hash = 0x14BD7221};

static void reset_output(void *output)
{
    (void)output;
}

static canopy_time_t last_now;

static void set_cycle(void *input, const canopy_cycle_t *its)
{
    (void)input;
    last_now = its->now;
}

static const canopy_bus_t bus = {.reset_output = reset_output, .set_cycle = set_cycle};
static const canopy_trace_config_t trace = {.tick = {.id = TICK_ID},
                                            .change = {.id = CHANGE_ID},
                                            .snapshot = {.id = SNAPSHOT_ID},
                                            .inputs = {.id = CANOPY_TRACE_OFF},
                                            .arrivals = {.id = CANOPY_TRACE_OFF},
                                            .health = {.id = HEALTH_ID},
                                            .model = {.id = CANOPY_TRACE_OFF},
                                            .health_every = 4,
                                            .changes_max = 2,
                                            .tree = 3};
static canopy_tree_instance_t instance;
static canopy_bus_state_t bus_state;
static canopy_trace_state_t trace_state;
static uint8_t status[NODES];
static uint8_t sent[NODES];
static int image;
static canopy_tx_t tx;
static canopy_tx_trace_t waiting[8];
static const canopy_app_t app = {.name = "test",
                                 .period = PERIOD_US,
                                 .rx_max = 4,
                                 .frame_us = 220,
                                 .tree = &tree,
                                 .bus = &bus,
                                 .trace = &trace,
                                 .tree_instance = &instance,
                                 .status = status,
                                 .bus_state = &bus_state,
                                 .input = &image,
                                 .output = &image,
                                 .tx = &tx,
                                 .tx_memory = {.trace = waiting, .trace_capacity = 8},
                                 .trace_state = &trace_state,
                                 .sent = sent};

/* --- a clock that is late by what the test says ------------------------------------------------------------------- */

static canopy_time_t clock_now;
static canopy_time_t cycle_length[16]; /* how long the n-th cycle takes */
static canopy_time_t lateness[16];     /* how late the n-th cycle starts */
static unsigned cycle;
static unsigned cycles_max;
static bool in_cycle;

static canopy_time_t now(void *context)
{
    (void)context;
    if (in_cycle) {
        /* The loop reads the clock at the start of a cycle and at its end. */
        static bool started;

        if (started) {
            clock_now += cycle_length[cycle];
            cycle++;
            in_cycle = false;
        }
        started = !started;
    }
    return clock_now;
}

static bool wait_until(void *context, canopy_time_t deadline)
{
    (void)context;
    if (cycle == cycles_max) {
        return false;
    }
    if (clock_now < deadline) {
        clock_now = deadline;
    }
    clock_now += lateness[cycle];
    in_cycle = true;
    return true;
}

static const canopy_clock_t fake_clock = {.now = now, .wait_until = wait_until};
static unsigned kicks;
static unsigned faults[CANOPY_FAULT_TX_REPLACED + 1];

static void kick(void *context)
{
    (void)context;
    kicks++;
}

static void on_fault(void *context, canopy_fault_t fault, uint32_t detail)
{
    (void)context;
    (void)detail;
    faults[fault]++;
}

static const canopy_loop_config_t config = {
    .app = &app, .can = &fake_can, .clock = &fake_clock, .kick_watchdog = kick, .on_fault = on_fault};
static canopy_loop_t loop;

void setUp(void)
{
    fake_can_reset();
    nodes[0] = (canopy_node_t){.type = CANOPY_NODE_REACTIVE_FALLBACK, .end = NODES};
    for (uint16_t node = 1; node < (uint16_t)NODES; node++) {
        nodes[node] = (canopy_node_t){.type = CANOPY_NODE_CONDITION, .end = (uint16_t)(node + 1u), .parameter = node};
        returns[node] = CANOPY_FAILURE;
    }
    clock_now = 100000;
    memset(cycle_length, 0, sizeof cycle_length);
    memset(lateness, 0, sizeof lateness);
    memset(faults, 0, sizeof faults);
    cycle = 0;
    cycles_max = 5;
    kicks = 0;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_tree_validate(&tree, NULL));
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&loop, &config));
}

void tearDown(void)
{
}

static void cycles_start_at_absolute_deadlines(void)
{
    lateness[1] = 300;
    lateness[3] = 20;
    cycle_length[2] = 700;
    canopy_loop_run(&loop);
    TEST_ASSERT_EQUAL_UINT32(5, loop.ticks);
    TEST_ASSERT_EQUAL_UINT64(100000 + 5 * PERIOD_US, loop.deadline);
    TEST_ASSERT_EQUAL_UINT32(0, loop.overruns);
    TEST_ASSERT_EQUAL_UINT64(300, loop.most_late);
    TEST_ASSERT_EQUAL_UINT64(700, loop.longest_cycle);
    TEST_ASSERT_EQUAL_UINT32(3, loop.lateness[0]);
    TEST_ASSERT_EQUAL_UINT32(1, loop.lateness[1]);
    TEST_ASSERT_EQUAL_UINT32(1, loop.lateness[5]);
    TEST_ASSERT_EQUAL_UINT(5, kicks);
}

static void an_overrun_is_counted_and_the_phase_kept(void)
{
    cycle_length[1] = 2500;
    canopy_loop_run(&loop);
    TEST_ASSERT_EQUAL_UINT32(1, loop.overruns);
    TEST_ASSERT_EQUAL_UINT32(2, loop.slips);
    TEST_ASSERT_EQUAL_UINT64(100000 + 7 * PERIOD_US, loop.deadline);
    TEST_ASSERT_EQUAL_UINT(4, kicks);
    TEST_ASSERT_EQUAL_UINT(1, faults[CANOPY_FAULT_OVERRUN]);
}

static void a_cycle_that_ends_on_the_deadline_is_in_time(void)
{
    cycle_length[1] = PERIOD_US;
    canopy_loop_run(&loop);
    TEST_ASSERT_EQUAL_UINT32(0, loop.overruns);
}

static void a_flooded_bus_cannot_hold_up_the_tick(void)
{
    fake.rx_count = 10;
    for (unsigned frame = 0; frame < 10u; frame++) {
        fake.rx[frame] = (canopy_can_frame_t){.id = 0x7FF};
    }
    (void)canopy_loop_cycle(&loop, 0);
    TEST_ASSERT_EQUAL_UINT(4, fake.rx_taken);
    TEST_ASSERT_EQUAL_UINT32(1, loop.rx_backlogs);
    (void)canopy_loop_cycle(&loop, 0);
    (void)canopy_loop_cycle(&loop, 0);
    TEST_ASSERT_EQUAL_UINT(10, fake.rx_taken);
    TEST_ASSERT_EQUAL_UINT32(2, loop.rx_backlogs);
    TEST_ASSERT_EQUAL_UINT32(10, bus_state.counters.unknown_id);
}

static void a_configuration_can_take_fewer_frames_than_the_bus_carries(void)
{
    canopy_loop_config_t fewer = config;

    fewer.rx_max = 2;
    fake.rx_count = 3;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&loop, &fewer));
    (void)canopy_loop_cycle(&loop, 0);
    TEST_ASSERT_EQUAL_UINT(2, fake.rx_taken);
}

static void faults_are_counted_and_reported(void)
{
    fake.rx_error = CANOPY_ERROR_BUS_DOWN;
    returns[1] = CANOPY_RUNNING;
    (void)canopy_loop_cycle(&loop, 5);
    TEST_ASSERT_EQUAL_UINT32(1, loop.rx_errors);
    TEST_ASSERT_EQUAL_UINT(1, faults[CANOPY_FAULT_CAN_RECEIVE]);
    TEST_ASSERT_EQUAL_UINT(1, faults[CANOPY_FAULT_LEAF_STATUS]);
    TEST_ASSERT_EQUAL_UINT64(5, last_now);
}

static const canopy_can_frame_t *only(uint32_t id, unsigned *count)
{
    const canopy_can_frame_t *last = NULL;

    *count = 0;
    for (unsigned frame = 0; frame < fake.tx_count; frame++) {
        if (fake.tx[frame].id == id) {
            last = &fake.tx[frame];
            (*count)++;
        }
    }
    return last;
}

static void the_trace_tells_what_changed_and_sends_the_rest_later(void)
{
    /* Tick 0: 13 nodes change (12 conditions fail and are reset, the root fails); two frames hold four of them. */
    static const uint8_t tick_0[] = {0, 0, 0, 0, 0, 0x33, 4, 0};
    static const uint8_t change_0[] = {1, 0, 0, 1, 0, 0xB3, 3, 0};
    static const uint8_t snapshot_0[] = {3, 0, 0, 0xB3, 0xBB, 0xBB, 0xBB, 0xBB};
    static const uint8_t health_0[] = {0, 0, 0, 0, 0, 0, 0, 0};
    static const uint8_t snapshot_1[] = {7, 10, 0, 0xBB, 0xFB, 0xFF, 0xFF, 0xFF};
    unsigned count;

    (void)canopy_loop_cycle(&loop, 0);
    TEST_ASSERT_EQUAL_UINT(5, fake.tx_count);
    TEST_ASSERT_EQUAL_HEX32(TICK_ID, fake.tx[0].id);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(tick_0, fake.tx[0].data, 8);
    TEST_ASSERT_EQUAL_HEX32(CHANGE_ID, fake.tx[1].id);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(change_0, fake.tx[1].data, 8);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(snapshot_0, only(SNAPSHOT_ID, &count)->data, 8);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(health_0, only(HEALTH_ID, &count)->data, 8);
    fake.tx_count = 0;
    (void)canopy_loop_cycle(&loop, 0);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(snapshot_1, only(SNAPSHOT_ID, &count)->data, 8);
    for (unsigned tick = 2; tick < 4u; tick++) {
        (void)canopy_loop_cycle(&loop, 0);
    }
    fake.tx_count = 0;
    (void)canopy_loop_cycle(&loop, 0);
    (void)only(CHANGE_ID, &count);
    TEST_ASSERT_EQUAL_UINT(0, count);
    TEST_ASSERT_EQUAL_UINT8(0, fake.tx[0].data[6]);
    returns[12] = CANOPY_SUCCESS;
    fake.tx_count = 0;
    (void)canopy_loop_cycle(&loop, 0);
    TEST_ASSERT_EQUAL_UINT8(2, fake.tx[0].data[6]);
    TEST_ASSERT_EQUAL_UINT16(12, only(CHANGE_ID, &count)->data[3]);
    TEST_ASSERT_EQUAL_HEX8(0xA2, only(CHANGE_ID, &count)->data[5]);
}

static void a_single_change_names_no_second_node(void)
{
    for (unsigned tick = 0; tick < 6u; tick++) {
        (void)canopy_loop_cycle(&loop, 0);
    }
    sent[5] = CANOPY_IDLE;
    fake.tx_count = 0;
    (void)canopy_loop_cycle(&loop, 0);
    TEST_ASSERT_EQUAL_UINT8(1, fake.tx[0].data[6]);
    TEST_ASSERT_EQUAL_UINT8(5, fake.tx[1].data[1]);
    TEST_ASSERT_EQUAL_HEX8(0xFF, fake.tx[1].data[3]);
    TEST_ASSERT_EQUAL_HEX8(0xFF, fake.tx[1].data[4]);
    TEST_ASSERT_EQUAL_HEX8(0xFB, fake.tx[1].data[5]);
}

static void inputs_tell_time_and_frames_taken_and_the_model_which_tree_it_is(void)
{
    static const canopy_trace_config_t replayed = {.tick = {.id = TICK_ID},
                                                   .inputs = {.id = INPUTS_ID, .flags = CANOPY_CAN_EXTENDED},
                                                   .arrivals = {.id = CANOPY_TRACE_OFF},
                                                   .change = {.id = CANOPY_TRACE_OFF},
                                                   .snapshot = {.id = CANOPY_TRACE_OFF},
                                                   .health = {.id = CANOPY_TRACE_OFF},
                                                   .model = {.id = MODEL_ID},
                                                   .health_every = 1,
                                                   .model_every = 3};
    static const uint8_t inputs_0[] = {0xA6, 0xA5, 0xA4, 0xA3, 0xA2, 0xA1, 200, 0xD2}; /* 0x5A, rotated */
    static const uint8_t model_0[] = {0x21, 0x72, 0xBD, 0x14, NODES, 0, 0, 0};
    canopy_app_t traced = app;
    canopy_loop_config_t traced_config = config;
    unsigned count;

    traced.trace = &replayed;
    traced_config.app = &traced;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&loop, &traced_config));
    bus_state.taken = 200;
    bus_state.check = 0x5A;
    (void)canopy_loop_cycle(&loop, UINT64_C(0xFFFFA1A2A3A4A5A6)); /* only 48 bits have room */
    TEST_ASSERT_EQUAL_UINT(3, fake.tx_count);
    TEST_ASSERT_EQUAL_HEX32(TICK_ID, fake.tx[0].id);
    TEST_ASSERT_EQUAL_HEX32(INPUTS_ID, fake.tx[1].id);
    TEST_ASSERT_EQUAL_HEX8(CANOPY_CAN_EXTENDED, fake.tx[1].flags);
    TEST_ASSERT_EQUAL_UINT8(8, fake.tx[1].length);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(inputs_0, fake.tx[1].data, 8);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(model_0, only(MODEL_ID, &count)->data, 8);
    TEST_ASSERT_EQUAL_UINT8(1, trace_state.sequence);
    (void)canopy_loop_cycle(&loop, 0);
    (void)canopy_loop_cycle(&loop, 0);
    (void)only(MODEL_ID, &count);
    TEST_ASSERT_EQUAL_UINT(1, count);
    (void)canopy_loop_cycle(&loop, 0);
    (void)only(MODEL_ID, &count);
    TEST_ASSERT_EQUAL_UINT(2, count);
    (void)only(INPUTS_ID, &count);
    TEST_ASSERT_EQUAL_UINT(4, count);
}

static void lost_trace_frames_are_counted(void)
{
    canopy_tx_counters_t counters;

    fake.tx_result = 0;
    (void)canopy_loop_cycle(&loop, 0); /* 5 frames, and then 4: one more than there is room for */
    (void)canopy_loop_cycle(&loop, 0);
    canopy_tx_count(&tx, &counters);
    TEST_ASSERT_EQUAL_UINT32(1, counters.trace_dropped);
    TEST_ASSERT_EQUAL_UINT8(8, trace_state.sequence);
    (void)canopy_loop_cycle(&loop,
                            (canopy_time_t)CANOPY_TRACE_PERIODS * PERIOD_US); /* the 8 are too late now; 4 more wait */
    fake.tx_result = 1;
    (void)canopy_loop_cycle(&loop, (canopy_time_t)CANOPY_TRACE_PERIODS * PERIOD_US);
    canopy_tx_count(&tx, &counters);
    TEST_ASSERT_EQUAL_UINT32(9, counters.trace_dropped);
    TEST_ASSERT_EQUAL_UINT32(fake.tx_count, counters.trace_sent);
    TEST_ASSERT_EQUAL_UINT8(8, fake.tx[0].data[0]); /* by the sequence numbers a monitor knows how many it has missed */
}

static void the_tick_number_wraps_and_messages_go_on(void)
{
    unsigned count;

    loop.ticks = UINT32_MAX;
    (void)canopy_loop_cycle(&loop, 0);
    TEST_ASSERT_EQUAL_UINT32(0, loop.ticks);
    fake.tx_count = 0;
    for (unsigned tick = 0; tick < 8u; tick++) {
        (void)canopy_loop_cycle(&loop, 0);
    }
    (void)only(HEALTH_ID, &count);
    TEST_ASSERT_EQUAL_UINT(2, count);
}

static void init_refuses_an_incomplete_application(void)
{
    canopy_app_t wrong = app;
    canopy_loop_config_t wrong_config = config;

    wrong_config.app = &wrong;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&loop, &wrong_config));
    wrong.period = 0;
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_loop_init(&loop, &wrong_config));
    wrong = app;
    wrong.status = NULL;
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_loop_init(&loop, &wrong_config));
    wrong = app;
    wrong.sent = NULL;
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_loop_init(&loop, &wrong_config));
    wrong_config.can = NULL;
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_loop_init(&loop, &wrong_config));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_loop_init(&loop, NULL));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(cycles_start_at_absolute_deadlines);
    RUN_TEST(an_overrun_is_counted_and_the_phase_kept);
    RUN_TEST(a_cycle_that_ends_on_the_deadline_is_in_time);
    RUN_TEST(a_flooded_bus_cannot_hold_up_the_tick);
    RUN_TEST(a_configuration_can_take_fewer_frames_than_the_bus_carries);
    RUN_TEST(faults_are_counted_and_reported);
    RUN_TEST(the_trace_tells_what_changed_and_sends_the_rest_later);
    RUN_TEST(a_single_change_names_no_second_node);
    RUN_TEST(inputs_tell_time_and_frames_taken_and_the_model_which_tree_it_is);
    RUN_TEST(lost_trace_frames_are_counted);
    RUN_TEST(the_tick_number_wraps_and_messages_go_on);
    RUN_TEST(init_refuses_an_incomplete_application);
    return UNITY_END();
}
