/* SPDX-License-Identifier: MIT */
/**
 * @file
 * README's fan on a bus on which others send 1,500 frames a second, and no filter keeps them away: what is older than its
 * timeout is never fresh, however far behind the loop gets, and the fan stops in time when the thermometer is cut off.
 */
#include <inttypes.h>
#include <stdio.h>

#include "fan_app.h"
#include "rig.h"
#include "unity.h"

enum {
    TIMEOUT_US = 500000, /* five cycles of Climate */
    PERIOD_US = 100000,
    WARM = 300, /* 30 degrees and more: the numbers of the messages are the temperatures */
    SECONDS = 20,
    FRAME_US = 300
};

static rig_t rig;
static actor_t cutter;
static uint32_t ticks;
static uint32_t fresh;
static uint32_t overloaded;
static uint32_t oldest_us;
static nanoseconds_t stopped_at; /* the first frame that stops the fan, after the cut */
static bool is_cut;

void setUp(void)
{
}

void tearDown(void)
{
}

static void see(rig_t *self, const canopy_can_frame_t *frame, nanoseconds_t end)
{
    (void)self;
    if (is_cut && frame->data[0] == 0u && stopped_at == 0u) {
        stopped_at = end;
    }
}

static void after(rig_t *self)
{
    const nanoseconds_t tick = fan_input->now * NS_PER_US;
    const uint16_t number = (uint16_t)fan_input->climate.temperature;
    uint32_t age_us;

    ticks++;
    overloaded += fan_input->overload ? 1u : 0u;
    if (!fan_input->climate.fresh) {
        return;
    }
    fresh++;
    age_us = (uint32_t)((tick - self->peer.on_wire_at[number % (unsigned)PEER_NUMBERS]) / NS_PER_US);
    oldest_us = age_us > oldest_us ? age_us : oldest_us;
    TEST_ASSERT_LESS_THAN_UINT32_MESSAGE(TIMEOUT_US, age_us, "old data was called fresh");
    TEST_ASSERT_GREATER_OR_EQUAL_UINT32_MESSAGE(age_us, fan_input->climate.age_ms * 1000u, "it is older than was told");
}

static void cut(void *context)
{
    (void)context;
    rig.peer.silent = true;
    is_cut = true;
}

static void run(const char *what, rig_options_t options)
{
    options.app = &fan_app;
    options.unfiltered = true;
    options.traffic = (traffic_config_t){.per_second = 1500, .lowest_id = 0x101, .highest_id = 0x1FF, .shortest = 8};
    options.peer_phase = 30u * NS_PER_MS;
    ticks = 0;
    fresh = 0;
    overloaded = 0;
    oldest_us = 0;
    stopped_at = 0;
    is_cut = false;
    rig_init(&rig, &options);
    rig.peer.first_number = WARM;
    rig.peer.number = WARM;
    rig.saw = see;
    rig.after = after;
    world_at(&rig.world, &cutter, rig.world.now + SECONDS * NS_PER_S + 50u * NS_PER_MS, cut, NULL);
    TEST_ASSERT_EQUAL(CANOPY_OK, rig_run(&rig, rig.world.now + (SECONDS + 2u) * NS_PER_S));
    printf("%s, seed %" PRIu32 ": fresh in %" PRIu32 " of %" PRIu32 " ticks, at most %" PRIu32
           " us old; overload in %" PRIu32 "; the fan stops %" PRIu64 " us after the last reading, if it still ran\n",
           what, rig.traffic.config.seed, fresh, ticks, oldest_us, overloaded,
           stopped_at > rig.peer.last_on_wire ? (stopped_at - rig.peer.last_on_wire) / NS_PER_US : 0u);
    TEST_ASSERT_NOT_EQUAL_UINT64_MESSAGE(0, stopped_at, "the fan was never stopped");
    TEST_ASSERT_TRUE(stopped_at <= rig.peer.last_on_wire + (TIMEOUT_US + PERIOD_US + FRAME_US) * NS_PER_US);
}

/** What the bus can carry is drained: the reading is always there. */
static void check_keeps_up(void)
{
    TEST_ASSERT_EQUAL_UINT32(0, overloaded);
    TEST_ASSERT_GREATER_THAN_UINT32(SECONDS * 10u - 3u, fresh);
    TEST_ASSERT_GREATER_THAN_UINT32(1400u * SECONDS, fan_app.bus_state->counters.unknown_id);
}

/** Less is drained than comes: leaves are told, and the hook is called. */
static void check_falls_behind(void)
{
    TEST_ASSERT_GREATER_THAN_UINT32(SECONDS * 9u, overloaded);
    TEST_ASSERT_GREATER_THAN_UINT32(0, rig.faults[CANOPY_FAULT_RX_BACKLOG].count);
    TEST_ASSERT_GREATER_THAN_UINT32(0, rig.faults[CANOPY_FAULT_RX_LOST].count); /* a queue is full at last */
    TEST_ASSERT_LESS_THAN_UINT32(SECONDS * 5u, fresh); /* the readings are there, but too old: the first seconds only */
}

static void test_the_application_drains_what_the_bus_can_carry(void)
{
    run("interrupt", (rig_options_t){.mailboxes = 3});
    check_keeps_up();
    run("like SocketCAN", (rig_options_t){.queue = 10});
    check_keeps_up();
}

static void test_a_drain_of_64_frames_falls_behind(void)
{
    run("interrupt, 64 frames a tick", (rig_options_t){.mailboxes = 3, .rx_max = 64});
    check_falls_behind();
    run("like SocketCAN, 64 frames a tick", (rig_options_t){.queue = 10, .rx_max = 64});
    check_falls_behind();
}

/* Polled, a FIFO of 64 overflows between two ticks: it is told, and what is lost is at worst not fresh. */
static void test_a_polled_fifo_overflows(void)
{
    controller_config_t deep = CONTROLLER_COMMON;

    deep.depth = CONTROLLER_FIFO_MAX;
    deep.stamp_bits = 32;
    run("polled", (rig_options_t){.controller = &deep, .polled = true});
    TEST_ASSERT_GREATER_THAN_UINT32(SECONDS * 9u, overloaded);
    TEST_ASSERT_GREATER_THAN_UINT32(0, rig.faults[CANOPY_FAULT_RX_LOST].count);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_application_drains_what_the_bus_can_carry);
    RUN_TEST(test_a_drain_of_64_frames_falls_behind);
    RUN_TEST(test_a_polled_fifo_overflows);
    return UNITY_END();
}
