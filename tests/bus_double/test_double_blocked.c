/* SPDX-License-Identifier: MIT */
/**
 * @file
 * A bus that lets nothing through for 1 and 8 s (or as many seconds as the first argument says): the cable is out, or
 * somebody else has it all. What leaves afterwards is not old, whatever the driver can do; what was not sent is counted;
 * receivers see no gap; leaves are told.
 */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "rig.h"
#include "six/probe.h"
#include "six_app.h"
#include "unity.h"

enum {
    COMMANDS = 6,
    PERIOD_MS = 10,
    DEADLINE_US = 10000,
    SLACK_US = 300, /* a frame on the wire at its deadline goes to its end; an interrupt has a latency */
    BEFORE_MS = 500,
    AFTER_MS = 1000,
    TOLD_US = 40000 /* from the block to the tick in which leaves are told: the deadline, and two ticks */
};

typedef enum { CABLE_OUT, OTHERS_HAVE_IT } block_t;

static rig_t rig;
static traffic_t babbler;
static block_t kind;
static unsigned length_ms;
static actor_t begin;
static actor_t end;
static nanoseconds_t blocked_at;
static nanoseconds_t free_at;
static nanoseconds_t told_at;
static uint32_t commands; /* seen on the wire */
static uint32_t old;      /* of those, later than their deadline */
static uint32_t oldest_us;
static bool is_told_free;

void setUp(void)
{
}

void tearDown(void)
{
}

static void see(rig_t *self, const canopy_can_frame_t *frame, nanoseconds_t at)
{
    uint32_t stamp = (uint32_t)frame->data[2] | ((uint32_t)frame->data[3] << 8) | ((uint32_t)frame->data[4] << 16) |
                     ((uint32_t)frame->data[5] << 24);
    uint32_t age;

    if (rig_command_of(self, frame) < 0) {
        return;
    }
    commands++;
    if (stamp == 0u) {
        return; /* of the stop */
    }
    age = (uint32_t)(at / NS_PER_US) - stamp;
    old += age > DEADLINE_US + SLACK_US ? 1u : 0u;
    oldest_us = age > oldest_us ? age : oldest_us;
}

static void after(rig_t *self)
{
    if (six_probe.can_state == CANOPY_CAN_BLOCKED && told_at == 0u) {
        told_at = self->world.now;
    }
    is_told_free = six_probe.can_state != CANOPY_CAN_BLOCKED;
}

static void block(void *context)
{
    (void)context;
    blocked_at = rig.world.now;
    if (kind == CABLE_OUT) {
        rig_unplug(&rig);
    } else {
        traffic_init(&babbler, &rig.wire,
                     &(traffic_config_t){.seed = 5, .per_mille = 1200, .burst = 10, .highest_id = 0xFF});
    }
}

static void unblock(void *context)
{
    (void)context;
    free_at = rig.world.now;
    if (kind == CABLE_OUT) {
        rig_plug(&rig);
    } else {
        babbler.actor.due = NEVER;
        babbler.waiting = 0;
    }
}

static void run(const rig_options_t *options, block_t how, unsigned length)
{
    nanoseconds_t start;

    kind = how;
    length_ms = length;
    commands = 0;
    old = 0;
    oldest_us = 0;
    told_at = 0;
    rig_init(&rig, options);
    rig.saw = see;
    rig.after = after;
    start = rig.world.now;
    world_at(&rig.world, &begin, start + BEFORE_MS * NS_PER_MS, block, NULL);
    world_at(&rig.world, &end, start + BEFORE_MS * NS_PER_MS + length_ms * NS_PER_MS, unblock, NULL);
    TEST_ASSERT_EQUAL(CANOPY_OK, rig_run(&rig, start + (BEFORE_MS + AFTER_MS) * NS_PER_MS + length_ms * NS_PER_MS));
}

static void print(const char *driver)
{
    const canopy_tx_counters_t counters = rig_counters(&rig);

    printf("%-34s %-14s %5u ms: %5" PRIu32 " commands on the wire, %4" PRIu32 " old (oldest %5" PRIu32
           " ms); expired %5" PRIu32 ", replaced %5" PRIu32 "; told after %" PRIu64 " us\n",
           driver, kind == CABLE_OUT ? "cable out" : "others have it", length_ms, commands, old, oldest_us / 1000u,
           counters.expired, counters.replaced, told_at != 0u ? (told_at - blocked_at) / NS_PER_US : 0u);
}

/** What holds with any driver that knows when a frame is out. */
static void check(uint32_t most_old)
{
    const canopy_tx_counters_t counters = rig_counters(&rig);
    uint32_t posted = (rig.loop.ticks + 1u) * COMMANDS;

    TEST_ASSERT_LESS_OR_EQUAL_UINT32_MESSAGE(most_old, old, "old commands left");
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(commands, counters.sent, "sent is what was on the wire");
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(posted, counters.sent + counters.expired + counters.replaced,
                                     "every command is counted as one thing");
    TEST_ASSERT_GREATER_THAN_UINT32((length_ms / PERIOD_MS - 3u) * COMMANDS, counters.expired + counters.replaced);
    for (unsigned command = 0; command < COMMANDS; command++) {
        TEST_ASSERT_EQUAL_UINT32_MESSAGE(0, rig.peer.commands[command].refused, "the receiver saw a gap");
        TEST_ASSERT_EQUAL_HEX8(0, rig.peer.commands[command].value);
    }
    TEST_ASSERT_NOT_EQUAL_UINT64_MESSAGE(0, told_at, "leaves were not told");
    TEST_ASSERT_LESS_OR_EQUAL_UINT64(TOLD_US * NS_PER_US, told_at - blocked_at);
    TEST_ASSERT_TRUE_MESSAGE(is_told_free, "leaves are still told that the bus is blocked");
    TEST_ASSERT_EQUAL_UINT32(counters.expired != 0u, rig.faults[CANOPY_FAULT_TX_EXPIRED].count != 0u);
    TEST_ASSERT_GREATER_THAN_UINT32(0, rig.faults[CANOPY_FAULT_TX_EXPIRED].count +
                                           rig.faults[CANOPY_FAULT_TX_REPLACED].count);
}

static unsigned lengths[] = {1000, 8000};

static void try_all(const rig_options_t *options, uint32_t most_old, const char *driver)
{
    for (unsigned index = 0; index < sizeof lengths / sizeof lengths[0]; index++) {
        run(options, CABLE_OUT, lengths[index]);
        print(driver);
        check(most_old);
        run(options, OTHERS_HAVE_IT, lengths[index]);
        print(driver);
        check(most_old);
    }
}

static void test_with_abort_nothing_old_leaves(void)
{
    try_all(&(rig_options_t){.app = &six_app, .mailboxes = 1}, 0, "1 mailbox, abort");
    try_all(&(rig_options_t){.app = &six_app, .mailboxes = 3}, 0, "3 mailboxes, abort");
    try_all(&(rig_options_t){.app = &six_app, .mailboxes = 1, .polled = true}, 0, "1 mailbox, abort, polled");
    try_all(&(rig_options_t){.app = &six_app, .mailboxes = 3, .polled = true}, 0, "3 mailboxes, abort, polled");
}

static void test_without_abort_only_what_was_handed_over(void)
{
    try_all(&(rig_options_t){.app = &six_app, .mailboxes = 1, .cannot_abort = true}, 1, "1 mailbox, no abort");
    try_all(&(rig_options_t){.app = &six_app, .mailboxes = 3, .cannot_abort = true}, 3, "3 mailboxes, no abort");
}

static void test_like_socketcan_with_echo_at_most_one(void)
{
    try_all(&(rig_options_t){.app = &six_app, .queue = 10}, 1, "queue of 10, echo");
    TEST_ASSERT_EQUAL_UINT32(1, rig.socket.highest);
    try_all(&(rig_options_t){.app = &six_app, .queue = 1000}, 1, "queue of 1,000, echo");
    TEST_ASSERT_EQUAL_UINT32(1, rig.socket.highest);
}

/* E2E accepts up to two lost frames, so a counter that went on while frames were replaced would show after three. */
static void test_the_first_frame_after_any_number_of_replaced_ones_is_accepted(void)
{
    static const unsigned replaced[] = {1, 2, 3, 4, 13, 14, 15, 16, 30, 100};

    for (unsigned index = 0; index < sizeof replaced / sizeof replaced[0]; index++) {
        for (uint8_t mailboxes = 1; mailboxes <= 3u; mailboxes += 2u) {
            run(&(rig_options_t){.app = &six_app, .mailboxes = mailboxes}, OTHERS_HAVE_IT,
                replaced[index] * (unsigned)PERIOD_MS);
            for (unsigned command = 0; command < COMMANDS; command++) {
                TEST_ASSERT_EQUAL_UINT32(0, rig.peer.commands[command].refused);
            }
            /* Blocked between two ticks: so many of each message were not sent. */
            TEST_ASSERT_UINT32_WITHIN(COMMANDS, replaced[index] * COMMANDS,
                                      rig_counters(&rig).expired + rig_counters(&rig).replaced);
        }
    }
}

/* What cannot be kept without an echo: the queue fills with what is taken for sent. Never more than it holds, though. */
static void test_like_socketcan_without_echo_the_queue_leaves(void)
{
    static const uint32_t queues[] = {10, 1000};

    for (unsigned index = 0; index < 2u; index++) {
        run(&(rig_options_t){.app = &six_app, .queue = queues[index], .no_echo = true}, CABLE_OUT, 8000);
        print(index == 0u ? "queue of 10, no echo" : "queue of 1,000, no echo");
        TEST_ASSERT_GREATER_THAN_UINT32_MESSAGE(0, old, "then docs and drivers may promise more");
        TEST_ASSERT_LESS_OR_EQUAL_UINT32(queues[index] + 3u, old);
        TEST_ASSERT_NOT_EQUAL_UINT64_MESSAGE(0, told_at, "leaves are told once the queue is full");
    }
}

int main(int argc, char **argv)
{
    if (argc > 1) {
        lengths[0] = 1000u * (unsigned)strtoul(argv[1], NULL, 10);
        lengths[1] = lengths[0];
    }
    UNITY_BEGIN();
    RUN_TEST(test_with_abort_nothing_old_leaves);
    RUN_TEST(test_without_abort_only_what_was_handed_over);
    RUN_TEST(test_the_first_frame_after_any_number_of_replaced_ones_is_accepted);
    RUN_TEST(test_like_socketcan_with_echo_at_most_one);
    RUN_TEST(test_like_socketcan_without_echo_the_queue_leaves);
    return UNITY_END();
}
