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
    int rx_error;        /* what receive returns when it has nothing: 0, or an error */
    int tx_result;       /* what send returns; what it takes is out at once */
    uint32_t rx_dropped; /* what stats says */
    canopy_can_controller_t controller;
    unsigned restarts;
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

static inline int fake_can_send(void *context, uint8_t mailbox, const canopy_can_frame_t *frame)
{
    fake_can_t *fake = context;

    (void)mailbox;
    if (fake->tx_result == 1 && fake->tx_count < (unsigned)FAKE_FRAMES) {
        fake->tx[fake->tx_count++] = *frame;
    }
    return fake->tx_result;
}

static inline void fake_can_stats(void *context, canopy_can_stats_t *stats)
{
    const fake_can_t *fake = context;

    *stats = (canopy_can_stats_t){.rx_dropped = fake->rx_dropped};
}

static inline canopy_can_controller_t fake_can_state(void *context)
{
    const fake_can_t *fake = context;

    return fake->controller;
}

static inline void fake_can_restart(void *context)
{
    fake_can_t *fake = context;

    fake->restarts++;
}

static fake_can_t fake;
static const canopy_can_t fake_can = {.context = &fake,
                                      .receive = fake_can_receive,
                                      .send = fake_can_send,
                                      .state = fake_can_state,
                                      .restart = fake_can_restart,
                                      .stats = fake_can_stats};

static inline void fake_can_reset(void)
{
    fake = (fake_can_t){.tx_result = 1};
}

#endif
