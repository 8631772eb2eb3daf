/* SPDX-License-Identifier: MIT */
/** @file A CAN driver for tests: gives the frames that the test has put in, keeps those that are sent, fails on demand. */
#ifndef CANOPY_TESTS_FAKE_CAN_H
#define CANOPY_TESTS_FAKE_CAN_H

#include "canopy/can.h"
#include "canopy/status.h"

enum { FAKE_FRAMES = 64 };

typedef struct {
    canopy_can_frame_t rx[FAKE_FRAMES];
    canopy_can_frame_t tx[FAKE_FRAMES];
    unsigned rx_count;
    unsigned rx_taken;
    unsigned tx_count;
    int rx_error;  /* what receive returns when it has nothing: 0, or an error */
    int tx_result; /* what send returns */
} fake_can_t;

static inline int fake_can_receive(void *context, canopy_can_frame_t *frame)
{
    fake_can_t *fake = context;

    if (fake->rx_taken == fake->rx_count) {
        return fake->rx_error;
    }
    *frame = fake->rx[fake->rx_taken++];
    return 1;
}

static inline int fake_can_send(void *context, const canopy_can_frame_t *frame)
{
    fake_can_t *fake = context;

    if (fake->tx_result == 1 && fake->tx_count < (unsigned)FAKE_FRAMES) {
        fake->tx[fake->tx_count++] = *frame;
    }
    return fake->tx_result;
}

static inline void fake_can_stats(void *context, canopy_can_stats_t *stats)
{
    (void)context;
    *stats = (canopy_can_stats_t){0};
}

static fake_can_t fake;
static const canopy_can_t fake_can = {
    .context = &fake, .receive = fake_can_receive, .send = fake_can_send, .stats = fake_can_stats};

static inline void fake_can_reset(void)
{
    fake = (fake_can_t){.tx_result = 1};
}

#endif
