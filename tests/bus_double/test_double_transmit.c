/* SPDX-License-Identifier: MIT */
/**
 * @file
 * What is due leaves: an application (TEST_APP) on controllers with one and three mailboxes, with and without abort,
 * interrupt-driven and polled, alone with the other side on the bus. Every command of every tick and the whole trace are
 * seen on the wire, and the safe values at the end.
 */
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "rig.h"
#include "unity.h"

extern const canopy_app_t TEST_APP;

enum { TICKS = 200 };

static rig_t rig;
static uint32_t commands[PEER_MESSAGES_MAX]; /* seen on the wire, by message */
static uint32_t commands_after_end;          /* of those, after the loop's last tick */
static uint32_t traces[CANOPY_TRACE_MESSAGES];
static uint8_t sequence;
static bool sequence_is_whole;
static uint8_t last_value[PEER_MESSAGES_MAX];

static void see_trace(canopy_trace_message_t message, const uint8_t *data)
{
    bool counts = message == CANOPY_TRACE_TICK || message == CANOPY_TRACE_CHANGE || message == CANOPY_TRACE_SNAPSHOT;

    traces[message]++;
    if (counts) {
        sequence_is_whole = sequence_is_whole && (data[message == CANOPY_TRACE_TICK ? 6 : 0] & 63u) == sequence;
        sequence = (uint8_t)((sequence + 1u) & 63u);
    }
}

static void see(rig_t *self, const canopy_can_frame_t *frame, nanoseconds_t end)
{
    int command = rig_command_of(self, frame);

    if (command >= 0) {
        commands[command]++;
        commands_after_end += end > self->end ? 1u : 0u;
        last_value[command] = frame->data[frame->length - 1u];
        return;
    }
    if (frame->id - TEST_APP.trace->id < (uint32_t)CANOPY_TRACE_MESSAGES) {
        see_trace((canopy_trace_message_t)(frame->id - TEST_APP.trace->id), frame->data);
    }
}

static void start(const rig_options_t *options)
{
    memset(commands, 0, sizeof commands);
    memset(traces, 0, sizeof traces);
    memset(last_value, 0xFF, sizeof last_value);
    commands_after_end = 0;
    sequence = 0;
    sequence_is_whole = true;
    rig_init(&rig, options);
    rig.saw = see;
}

void setUp(void)
{
}

void tearDown(void)
{
}

static void check_all_left(void)
{
    const canopy_tx_counters_t counters = rig_counters(&rig);
    uint32_t ticks = rig.loop.ticks;

    TEST_ASSERT_UINT32_WITHIN(1, TICKS, ticks);
    for (uint16_t index = 0; index < TEST_APP.bus->tx_count; index++) {
        /* Every tick's, and the safe one at the end. */
        TEST_ASSERT_EQUAL_UINT32(ticks / TEST_APP.bus->tx[index].every + 1u, commands[index]);
        TEST_ASSERT_EQUAL_UINT32(commands[index], rig.peer.commands[index].accepted);
        TEST_ASSERT_EQUAL_UINT32(0, rig.peer.commands[index].refused);
        TEST_ASSERT_EQUAL_HEX8(0, last_value[index]);
    }
    TEST_ASSERT_GREATER_OR_EQUAL_UINT32(TEST_APP.bus->tx_count, commands_after_end);
    TEST_ASSERT_EQUAL_UINT32(ticks, traces[CANOPY_TRACE_TICK]);
    TEST_ASSERT_EQUAL_UINT32(ticks, traces[CANOPY_TRACE_INPUTS]);
    TEST_ASSERT_EQUAL_UINT32((ticks - 1u) / TEST_APP.trace->snapshot_every + 1u, traces[CANOPY_TRACE_SNAPSHOT]);
    TEST_ASSERT_TRUE_MESSAGE(sequence_is_whole, "a trace frame is missing, or out of order");
    TEST_ASSERT_EQUAL_UINT32(0, counters.expired);
    TEST_ASSERT_EQUAL_UINT32(0, counters.replaced);
    TEST_ASSERT_EQUAL_UINT32(0, counters.trace_dropped);
    TEST_ASSERT_EQUAL_UINT32(rig.from_controller, counters.sent + counters.trace_sent);
    TEST_ASSERT_EQUAL_UINT32(0, rig.loop.overruns);
}

static void check(const rig_options_t *options, const char *what)
{
    const nanoseconds_t length = TICKS * TEST_APP.period * NS_PER_US;

    start(options);
    TEST_ASSERT_EQUAL(CANOPY_OK, rig_run(&rig, rig.world.now + length - NS_PER_US));
    printf("%s, %s: %" PRIu32 " ticks, %" PRIu32 " frames of the controller, stopped in %" PRIu64 " us\n",
           TEST_APP.name, what, rig.loop.ticks, rig.from_controller, (rig.stopped_at - rig.end) / NS_PER_US);
    check_all_left();
}

static void test_one_mailbox(void)
{
    check(&(rig_options_t){.app = &TEST_APP, .mailboxes = 1}, "one mailbox");
}

static void test_one_mailbox_polled(void)
{
    check(&(rig_options_t){.app = &TEST_APP, .mailboxes = 1, .polled = true}, "one mailbox, polled");
}

static void test_three_mailboxes(void)
{
    check(&(rig_options_t){.app = &TEST_APP, .mailboxes = 3}, "three mailboxes");
}

static void test_three_mailboxes_polled(void)
{
    check(&(rig_options_t){.app = &TEST_APP, .mailboxes = 3, .polled = true}, "three mailboxes, polled");
}

static void test_without_abort(void)
{
    check(&(rig_options_t){.app = &TEST_APP, .mailboxes = 1, .cannot_abort = true}, "one mailbox, no abort");
    check(&(rig_options_t){.app = &TEST_APP, .mailboxes = 3, .cannot_abort = true}, "three mailboxes, no abort");
}

static void test_mailboxes_in_order(void)
{
    controller_config_t in_order = CONTROLLER_COMMON;

    in_order.in_order = true;
    check(&(rig_options_t){.app = &TEST_APP, .controller = &in_order}, "three mailboxes in order");
}

static void test_like_socketcan(void)
{
    check(&(rig_options_t){.app = &TEST_APP, .queue = 10}, "queue of 10, echo");
    check(&(rig_options_t){.app = &TEST_APP, .queue = 1000, .no_echo = true}, "queue of 1,000, no echo");
}

/* Nobody acknowledges: the stop ends in time, and says so. */
static void test_stop_without_a_bus_says_so(void)
{
    nanoseconds_t length = 20u * TEST_APP.period * NS_PER_US;

    start(&(rig_options_t){.app = &TEST_APP});
    rig.end = rig.world.now + length;
    rig_unplug(&rig);
    TEST_ASSERT_EQUAL(CANOPY_ERROR_BUS_DOWN, rig_run(&rig, rig.end));
    TEST_ASSERT_UINT64_WITHIN(2u * NS_PER_MS, CANOPY_LOOP_STOP_US * NS_PER_US, rig.stopped_at - rig.end);
    TEST_ASSERT_EQUAL_UINT32(0, rig.from_controller);
    rig_plug(&rig);
    world_run(&rig.world, rig.world.now + NS_PER_S);
    TEST_ASSERT_EQUAL_UINT32(0, rig.from_controller); /* after a stop nothing leaves any more */
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_one_mailbox);
    RUN_TEST(test_one_mailbox_polled);
    RUN_TEST(test_three_mailboxes);
    RUN_TEST(test_three_mailboxes_polled);
    RUN_TEST(test_without_abort);
    RUN_TEST(test_mailboxes_in_order);
    RUN_TEST(test_like_socketcan);
    RUN_TEST(test_stop_without_a_bus_says_so);
    return UNITY_END();
}
