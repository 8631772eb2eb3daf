/* SPDX-License-Identifier: MIT */
/** @file The fixed-period loop, with a clock and a bus that do what the test says. */
#include <string.h>

#include "canopy/loop.h"
#include "fake_can.h"
#include "unity.h"

enum { NODES = 13, PERIOD_US = 1000 };

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
static canopy_tree_instance_t instance;
static canopy_bus_state_t bus_state;
static uint8_t status[NODES];
static int image;
static canopy_tx_t tx;
static canopy_tx_trace_t waiting[8];
static const canopy_app_t app = {.name = "test",
                                 .period = PERIOD_US,
                                 .rx_max = 4,
                                 .frame_us = 220,
                                 .tree = &tree,
                                 .bus = &bus,
                                 .tree_instance = &instance,
                                 .status = status,
                                 .bus_state = &bus_state,
                                 .input = &image,
                                 .output = &image,
                                 .tx = &tx,
                                 .tx_memory = {.trace = waiting, .trace_capacity = 8}};

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
    wrong.trace = &(const canopy_trace_config_t){.changes_max = 1};
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
    RUN_TEST(init_refuses_an_incomplete_application);
    return UNITY_END();
}
