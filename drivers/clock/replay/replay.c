/* SPDX-License-Identifier: MIT */
/**
 * @file
 * CAN driver and clock that replay a record; the contract is in replay.h.
 */
#include "canopy/clock/replay.h"

#include <stddef.h>

static void read_next(canopy_replay_t *self)
{
    self->left = self->io.read(self->io.context, &self->next);
    if (self->left < 0) {
        self->error = (canopy_error_t)self->left;
    }
}

static int replay_receive(void *context, canopy_can_frame_t *frame)
{
    canopy_replay_t *self = context;

    if (self->left != 1 || self->next.is_tick) {
        return 0;
    }
    *frame = self->next.frame;
    frame->time = self->now - UINT64_C(1000) * self->next.age;
    self->stats.received++;
    read_next(self);
    return 1;
}

static int replay_send(void *context, uint8_t mailbox, const canopy_can_frame_t *frame)
{
    canopy_replay_t *self = context;
    (void)mailbox;
    int result = self->io.write != NULL ? self->io.write(self->io.context, frame) : 1;

    if (result < 0) {
        self->error = (canopy_error_t)result;
        self->stats.tx_dropped++;
        return result;
    }
    self->stats.sent++;
    return 1;
}

static void replay_conditions(void *context, canopy_can_conditions_t *conditions)
{
    const canopy_replay_t *self = context;

    *conditions = self->conditions;
}

static void replay_stats(void *context, canopy_can_stats_t *stats)
{
    const canopy_replay_t *self = context;

    *stats = self->stats;
}

static canopy_time_t replay_now(void *context)
{
    const canopy_replay_t *self = context;

    return self->now;
}

static bool replay_wait_until(void *context, canopy_time_t deadline)
{
    canopy_replay_t *self = context;

    (void)deadline;
    /* The first tick waits since canopy_replay_init(). What a tick has left (rx_max) is not for the next. */
    while (self->left == 1 && !self->next.is_tick) {
        self->stats.rx_dropped++;
        read_next(self);
    }
    if (self->left != 1 || self->error != CANOPY_OK) {
        return false;
    }
    self->now = self->next.now;
    self->conditions = self->next.conditions;
    read_next(self);
    return true;
}

canopy_error_t canopy_replay_init(canopy_replay_t *self, const canopy_replay_io_t *io)
{
    if (self == NULL || io == NULL || io->read == NULL) {
        return CANOPY_ERROR_ARGUMENT;
    }
    *self = (canopy_replay_t){.can = {.context = self,
                                      .receive = replay_receive,
                                      .send = replay_send,
                                      .conditions = replay_conditions,
                                      .stats = replay_stats,
                                      .mailboxes = 1,
                                      .is_filtered = true},
                              .clock = {.context = self, .now = replay_now, .wait_until = replay_wait_until},
                              .io = *io};
    read_next(self);
    if (self->error != CANOPY_OK) {
        return self->error;
    }
    if (self->left != 1 || !self->next.is_tick) {
        return CANOPY_ERROR_NOT_FOUND;
    }
    self->now = self->next.now;
    return CANOPY_OK;
}

canopy_error_t canopy_replay_error(const canopy_replay_t *self)
{
    return self->error;
}
