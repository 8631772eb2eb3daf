/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The time of arrival, from a controller's stamps to the age that a leaf sees: two FIFOs merged by stamp, a timer of 16
 * bits that wraps around, a coarse one, FIFOs that overflow. nao_home, whose two sensors go to two FIFOs.
 */
#include <inttypes.h>
#include <stdio.h>

#include "nao_home_app.h"
#include "rig.h"
#include "unity.h"

static rig_t rig;
static canopy_can_t checked;    /* the driver, looked at by the test */
static canopy_time_t last_time; /* of the last received frame */
static uint32_t received;
static uint32_t most_early_us; /* a frame's time before the end of its last bit */
static uint32_t out_of_order;
static uint32_t overloaded;
static uint32_t oldest_ms;

void setUp(void)
{
}

void tearDown(void)
{
}

static int receive(void *context, canopy_can_frame_t *frame)
{
    int result = rig.port.can.receive(context, frame);
    nanoseconds_t end;

    if (result != 1) {
        return result;
    }
    received++;
    end = rig.peer.on_wire_at[peer_number(frame) % (unsigned)PEER_NUMBERS];
    TEST_ASSERT_TRUE_MESSAGE(frame->time * NS_PER_US <= end, "a frame looks younger than it is");
    if ((end - frame->time * NS_PER_US) / NS_PER_US > most_early_us) {
        most_early_us = (uint32_t)((end - frame->time * NS_PER_US) / NS_PER_US);
    }
    out_of_order += frame->time < last_time ? 1u : 0u;
    last_time = frame->time;
    return result;
}

static void after(rig_t *self)
{
    (void)self;
    overloaded += nao_home_input->overload ? 1u : 0u;
    if (nao_home_input->posture.fresh && nao_home_input->posture.age_ms > oldest_ms) {
        oldest_ms = nao_home_input->posture.age_ms;
    }
}

static void run(const controller_config_t *controller, rig_options_t options, nanoseconds_t length)
{
    options.app = &nao_home_app;
    options.controller = controller;
    received = 0;
    last_time = 0;
    most_early_us = 0;
    out_of_order = 0;
    overloaded = 0;
    oldest_ms = 0;
    rig_init(&rig, &options);
    checked = rig.port.can;
    checked.receive = receive;
    rig.config.can = &checked;
    rig.after = after;
    TEST_ASSERT_EQUAL(CANOPY_OK, rig_run(&rig, rig.world.now + length));
}

/* Five frames of each sensor between two ticks, in two FIFOs: they come out as they arrived. */
static void test_two_fifos_are_merged_by_stamp(void)
{
    controller_config_t deep = CONTROLLER_COMMON;

    deep.depth = 16;
    run(&deep, (rig_options_t){.fifos = 2, .polled = true, .peer_period = 10u * NS_PER_MS}, 10u * NS_PER_S);
    TEST_ASSERT_GREATER_THAN_UINT32(1900, received);
    TEST_ASSERT_EQUAL_UINT32(0, out_of_order);
    TEST_ASSERT_EQUAL_UINT32(0, canopy_bus_rejected(&nao_home_app.bus_state->counters));
    TEST_ASSERT_EQUAL_UINT32(0, overloaded);
    run(&deep, (rig_options_t){.fifos = 2, .peer_period = 10u * NS_PER_MS}, 10u * NS_PER_S);
    TEST_ASSERT_GREATER_THAN_UINT32(1900, received);
    TEST_ASSERT_EQUAL_UINT32(0, out_of_order);
}

/* A turn is 131 ms: 76 of them. The frames that arrived before a wrap and are taken after it have their time, too. */
static void test_a_timer_that_wraps_changes_no_age(void)
{
    controller_config_t common = CONTROLLER_COMMON;

    for (unsigned phase = 0; phase < 50u; phase += 7u) {
        run(&common, (rig_options_t){.polled = true, .peer_phase = phase * NS_PER_MS}, 10u * NS_PER_S);
        TEST_ASSERT_GREATER_THAN_UINT32(390, received);
        TEST_ASSERT_LESS_OR_EQUAL_UINT32(6, most_early_us); /* a bit, a count, and the rounding */
        TEST_ASSERT_LESS_OR_EQUAL_UINT32(51, oldest_ms);
    }
}

/* A timer that counts every 100 us: a frame looks older by up to a count, never younger. */
static void test_a_coarse_timer_makes_frames_older_only(void)
{
    controller_config_t coarse = CONTROLLER_COMMON;

    coarse.stamp_ns = 100000;
    run(&coarse, (rig_options_t){.peer_phase = 333u * NS_PER_US, .peer_period = 50u * NS_PER_MS + 7u * NS_PER_US},
        10u * NS_PER_S);
    TEST_ASSERT_GREATER_THAN_UINT32(390, received);
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(204, most_early_us);
}

/* FIFOs of 3, and 25 frames of each sensor between two ticks: counted, reported, and told. */
static void test_a_fifo_that_overflows_is_overload(void)
{
    controller_config_t common = CONTROLLER_COMMON;

    for (unsigned overwrites = 0; overwrites < 2u; overwrites++) {
        common.overwrites = overwrites != 0u;
        run(&common, (rig_options_t){.fifos = 2, .polled = true, .peer_period = 2u * NS_PER_MS}, 5u * NS_PER_S);
        TEST_ASSERT_UINT32_WITHIN(5, rig.loop.ticks, overloaded);
        TEST_ASSERT_UINT32_WITHIN(5, rig.loop.ticks, rig.faults[CANOPY_FAULT_RX_LOST].count);
        /* All but the few after the last tick. */
        TEST_ASSERT_LESS_OR_EQUAL_UINT32(rig.port.controller.fifos[0].lost + rig.port.controller.fifos[1].lost,
                                         rig.loop.rx_lost);
        TEST_ASSERT_GREATER_THAN_UINT32(40u * rig.loop.ticks, rig.loop.rx_lost);
        TEST_ASSERT_EQUAL_UINT32(0, out_of_order);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_two_fifos_are_merged_by_stamp);
    RUN_TEST(test_a_timer_that_wraps_changes_no_age);
    RUN_TEST(test_a_coarse_timer_makes_frames_older_only);
    RUN_TEST(test_a_fifo_that_overflows_is_overload);
    return UNITY_END();
}
