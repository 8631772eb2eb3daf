/* SPDX-License-Identifier: MIT */
/**
 * @file
 * CAN driver and clock that replay a record; the contract is in replay.h.
 */
#include "canopy/clock/replay.h"

#include <stddef.h>

enum { TRACE_LENGTH = 8, NOW_BYTES = 6 };

/* Of CanopyArrivals' first byte. */
enum { STATE_MASK = 7, OVERLOAD_BIT = 8, RETURNING_BIT = 0x40 };

static void read_next(canopy_replay_t *self)
{
    self->left = self->io.read(self->io.context, &self->next);
    if (self->left < 0) {
        self->error = (canopy_error_t)self->left;
    }
}

static bool is_at(const canopy_replay_t *self, canopy_trace_id_t message)
{
    return self->left == 1 && self->next.id == message.id && self->next.flags == message.flags &&
           self->next.length == (uint8_t)TRACE_LENGTH;
}

/** Is the next frame the beginning of a tick? */
static bool is_at_tick(const canopy_replay_t *self)
{
    return is_at(self, self->inputs);
}

/** Takes what CanopyArrivals frames say of the tick and of its next frame. */
static void read_arrivals(canopy_replay_t *self)
{
    while (is_at(self, self->arrivals)) {
        const uint8_t *data = self->next.data;

        self->conditions = (canopy_can_conditions_t){.can_state = data[0] & (uint8_t)STATE_MASK,
                                                     .overload = (data[0] & (uint8_t)OVERLOAD_BIT) != 0u,
                                                     .returning = (data[0] & (uint8_t)RETURNING_BIT) != 0u};
        self->age = UINT64_C(1000) * ((unsigned)data[1] | ((unsigned)data[2] << 8));
        read_next(self);
    }
}

static canopy_time_t time_of_tick(const canopy_replay_t *self)
{
    canopy_time_t time = 0;

    for (unsigned byte = 0; byte < (unsigned)NOW_BYTES; byte++) {
        time |= (canopy_time_t)self->next.data[byte] << (8u * byte);
    }
    return time;
}

static int replay_receive(void *context, canopy_can_frame_t *frame)
{
    canopy_replay_t *self = context;

    read_arrivals(self);
    if (self->left != 1 || is_at_tick(self)) {
        return 0;
    }
    *frame = self->next;
    frame->time = self->now - self->age;
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
    canopy_replay_t *self = context;

    read_arrivals(self); /* those behind the last frame taken, if any */
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
    /* The first tick's frame is waiting since canopy_replay_init(). What a tick has left (rx_max) is not for the next. */
    for (read_arrivals(self); self->left == 1 && !is_at_tick(self); read_arrivals(self)) {
        self->stats.rx_dropped++;
        read_next(self);
    }
    if (self->left != 1 || self->error != CANOPY_OK) {
        return false;
    }
    self->now = time_of_tick(self);
    self->age = 0;
    read_next(self);
    return true;
}

canopy_error_t canopy_replay_init(canopy_replay_t *self, const canopy_replay_io_t *io,
                                  const canopy_trace_config_t *trace)
{
    if (self == NULL || io == NULL || io->read == NULL || trace == NULL) {
        return CANOPY_ERROR_ARGUMENT;
    }
    if (trace->inputs.id == CANOPY_TRACE_OFF || trace->arrivals.id == CANOPY_TRACE_OFF) {
        return CANOPY_ERROR_UNSUPPORTED;
    }
    *self = (canopy_replay_t){.can = {.context = self,
                                      .receive = replay_receive,
                                      .send = replay_send,
                                      .conditions = replay_conditions,
                                      .stats = replay_stats,
                                      .mailboxes = 1,
                                      .is_filtered = true},
                              .clock = {.context = self, .now = replay_now, .wait_until = replay_wait_until},
                              .io = *io,
                              .inputs = trace->inputs,
                              .arrivals = trace->arrivals};
    read_next(self);
    if (self->error != CANOPY_OK) {
        return self->error;
    }
    if (!is_at_tick(self)) {
        return CANOPY_ERROR_NOT_FOUND;
    }
    self->now = time_of_tick(self);
    return CANOPY_OK;
}

canopy_error_t canopy_replay_error(const canopy_replay_t *self)
{
    return self->error;
}
