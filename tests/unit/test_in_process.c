/* SPDX-License-Identifier: MIT */
/** @file An application in one program with what surrounds it: what comes in, what goes out, and what a world is asked. */
#include <string.h>

#include "canopy/in_process.h"
#include "features_app.h"
#include "nao_home_app.h"
#include "unity.h"

enum { SENSORS = FEATURES_RX_MESSAGES > NAO_HOME_RX_MESSAGES ? FEATURES_RX_MESSAGES : NAO_HOME_RX_MESSAGES };

static canopy_in_process_t host;
static canopy_in_process_sensor_t sensors[SENSORS];
static unsigned came, went, sensed, stepped, steps_left;

static bool is_received(const canopy_can_frame_t *frame)
{
    return canopy_in_process_find(&host, frame->id, (frame->flags & (unsigned)CANOPY_CAN_EXTENDED) != 0u) !=
           CANOPY_IN_PROCESS_NONE;
}

static void tap(void *context, const canopy_can_frame_t *frame)
{
    (void)context;
    if (is_received(frame)) {
        came++;
    } else {
        went++;
    }
}

static void sense(void *context, canopy_in_process_t *application)
{
    (void)context;
    TEST_ASSERT_EQUAL_PTR(&host, application);
    sensed++;
}

static bool step(void *context)
{
    (void)context;
    stepped++;
    return --steps_left > 0u;
}

void setUp(void)
{
    came = went = sensed = stepped = 0;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_in_process_init(&host, &features_app, sensors, SENSORS, NULL, true));
    host.tap = tap;
}

void tearDown(void)
{
}

static void what_is_missing_is_refused(void)
{
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_in_process_init(NULL, &features_app, sensors, SENSORS, NULL, true));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_in_process_init(&host, NULL, sensors, SENSORS, NULL, true));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT, canopy_in_process_init(&host, &features_app, NULL, SENSORS, NULL, true));
    TEST_ASSERT_EQUAL(CANOPY_ERROR_ARGUMENT,
                      canopy_in_process_init(&host, &features_app, sensors, FEATURES_RX_MESSAGES - 1, NULL, true));
}

static void a_message_that_was_put_comes_once_and_a_held_one_always(void)
{
    uint8_t data[CANOPY_CAN_DATA_MAX] = {0};
    uint16_t message = canopy_in_process_find(&host, features_bus.rx[0].id,
                                              (features_bus.rx[0].flags & (unsigned)CANOPY_CAN_EXTENDED) != 0u);

    TEST_ASSERT_EQUAL_UINT16(0, message);
    canopy_in_process_put(&host, message, data, 0);
    canopy_in_process_put(&host, message, data, 0); /* the newer bytes, one frame */
    (void)canopy_in_process_tick(&host);
    (void)canopy_in_process_tick(&host);
    TEST_ASSERT_EQUAL_UINT(1, came);
    canopy_in_process_hold(&host, message, true);
    canopy_in_process_hold(&host, message, true);
    TEST_ASSERT_EQUAL_UINT64(20, canopy_in_process_run(&host, 20, 0)); /* more than the counter's 15 */
    TEST_ASSERT_EQUAL_UINT(21, came);
    canopy_in_process_hold(&host, message, false);
    (void)canopy_in_process_tick(&host);
    TEST_ASSERT_EQUAL_UINT(21, came);
    TEST_ASSERT_EQUAL_UINT32(0, features_app.bus_state->counters.wrong_crc);
    TEST_ASSERT_EQUAL_UINT32(0, features_app.bus_state->counters.wrong_sequence);
    TEST_ASSERT_EQUAL_UINT32(0, host.loop.rx_backlogs);
}

static void the_clock_goes_on_by_a_period_a_tick(void)
{
    TEST_ASSERT_EQUAL_UINT64(0, host.now);
    TEST_ASSERT_EQUAL_UINT64(3, canopy_in_process_run(&host, 3, 0));
    TEST_ASSERT_EQUAL_UINT64(3u * features_app.period, host.now);
    TEST_ASSERT_EQUAL_UINT64(3, host.ticks);
}

static void a_run_ends_with_the_status_it_waits_for(void)
{
    canopy_status_t first = canopy_in_process_tick(&host);

    TEST_ASSERT_EQUAL_UINT64(1, canopy_in_process_run(&host, 10, 1u << (unsigned)first));
    TEST_ASSERT_EQUAL(first, host.root);
}

static void without_a_trace_only_commands_go_out(void)
{
    const uint16_t count = (uint16_t)SENSORS;

    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_in_process_init(&host, &nao_home_app, sensors, count, NULL, true));
    host.tap = tap;
    (void)canopy_in_process_run(&host, 10, 0);
    TEST_ASSERT_GREATER_THAN_UINT(20, went);
    went = 0;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_in_process_init(&host, &nao_home_app, sensors, count, NULL, false));
    host.tap = tap;
    (void)canopy_in_process_run(&host, 10, 0);
    TEST_ASSERT_EQUAL_UINT(20, went); /* two commands a tick */
}

static void a_world_is_asked_and_may_end_the_run(void)
{
    const canopy_world_t world = {.sense = sense, .step = step};

    steps_left = 5;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_in_process_init(&host, &features_app, sensors, SENSORS, &world, true));
    TEST_ASSERT_EQUAL_UINT64(5, canopy_in_process_run(&host, 100, 0));
    TEST_ASSERT_EQUAL_UINT(5, sensed);
    TEST_ASSERT_EQUAL_UINT(5, stepped);
    TEST_ASSERT_TRUE(host.has_ended);
}

static void outputs_are_read_as_bytes(void)
{
    uint8_t data[CANOPY_CAN_DATA_MAX];
    uint8_t expected[CANOPY_CAN_DATA_MAX];

    (void)canopy_in_process_tick(&host);
    memset(data, 0xAA, sizeof data);
    memset(expected, 0xAA, sizeof expected);
    canopy_in_process_read(&host, 0, data);
    features_bus.tx[0].encode(features_output, expected);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, data, sizeof data);
}

static void what_each_node_has_been_is_kept(void)
{
    static uint8_t seen[FEATURES_NODES];

    host.seen = seen;
    (void)canopy_in_process_run(&host, 3, 0);
    TEST_ASSERT_NOT_EQUAL(0, seen[0] & (1u << (unsigned)host.root));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(what_is_missing_is_refused);
    RUN_TEST(a_message_that_was_put_comes_once_and_a_held_one_always);
    RUN_TEST(the_clock_goes_on_by_a_period_a_tick);
    RUN_TEST(a_run_ends_with_the_status_it_waits_for);
    RUN_TEST(without_a_trace_only_commands_go_out);
    RUN_TEST(a_world_is_asked_and_may_end_the_run);
    RUN_TEST(outputs_are_read_as_bytes);
    RUN_TEST(what_each_node_has_been_is_kept);
    return UNITY_END();
}
