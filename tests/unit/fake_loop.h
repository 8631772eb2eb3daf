/* SPDX-License-Identifier: MIT */
/** @file An application's loop over the fake CAN driver. There is no clock: a cycle is when the test says so. */
#ifndef CANOPY_TESTS_FAKE_LOOP_H
#define CANOPY_TESTS_FAKE_LOOP_H

#include "canopy/loop.h"
#include "fake_can.h"
#include "unity.h"

static inline canopy_time_t fake_clock_now(void *context)
{
    (void)context;
    return 0;
}

static inline bool fake_clock_wait(void *context, canopy_time_t deadline)
{
    (void)context;
    (void)deadline;
    return false;
}

static const canopy_clock_t fake_clock = {.now = fake_clock_now, .wait_until = fake_clock_wait};
static canopy_loop_config_t fake_loop_config = {.can = &fake_can, .clock = &fake_clock};
static canopy_loop_t loop;
static canopy_time_t time; /* of the last cycle */

/** The application begins, at time 0, with no frame on the bus. */
static inline void fake_loop_start(const canopy_app_t *app)
{
    fake_can_reset();
    time = 0;
    fake_loop_config.app = app;
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_loop_init(&loop, &fake_loop_config));
}

/** A cycle, one period after the last one: it gets the first `frames` of fake.rx, just arrived; fake.tx is what it sends. */
static inline canopy_status_t fake_loop_cycle(unsigned frames)
{
    fake.rx_count = frames;
    fake.rx_taken = 0;
    fake.tx_count = 0;
    time += fake_loop_config.app->period;
    for (unsigned frame = 0; frame < frames; frame++) {
        fake.rx[frame].time = time;
    }
    return canopy_loop_cycle(&loop, time);
}

#endif
