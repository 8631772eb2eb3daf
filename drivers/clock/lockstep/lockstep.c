/* SPDX-License-Identifier: MIT */
/**
 * @file
 * CAN driver and clock in lock-step with a simulator; the contract is in lockstep.h.
 */
#include "canopy/clock/lockstep.h"

#include <string.h>

static int lockstep_receive(void *context, canopy_can_frame_t *frame)
{
    canopy_lockstep_t *self = context;
    if (!canopy_ring_pop(&self->queue, frame)) {
        return 0;
    }
    frame->time = self->now;
    self->received++;
    return 1;
}

static int lockstep_send(void *context, uint8_t mailbox, const canopy_can_frame_t *frame)
{
    const canopy_lockstep_t *self = context;
    return self->inner->send(self->inner->context, mailbox, frame);
}

static void lockstep_stats(void *context, canopy_can_stats_t *stats)
{
    const canopy_lockstep_t *self = context;
    self->inner->stats(self->inner->context, stats);
    stats->received = self->received;
    stats->rx_dropped += self->overwritten;
    if (stats->rx_high_water < canopy_ring_high_water(&self->queue)) {
        stats->rx_high_water = canopy_ring_high_water(&self->queue);
    }
}

static canopy_time_t lockstep_now(void *context)
{
    const canopy_lockstep_t *self = context;
    return self->now;
}

static bool is_step(const canopy_lockstep_t *self, const canopy_can_frame_t *frame)
{
    return frame->flags == 0u && frame->id == self->step_id;
}

static bool is_new_step(const canopy_lockstep_t *self, const canopy_can_frame_t *step)
{
    return !self->joined || step->length != self->last.length || memcmp(step->data, self->last.data, step->length) != 0;
}

/* Newer sensor frames replace older ones: after a long wait the last ones are those of the step. */
static void keep(canopy_lockstep_t *self, const canopy_can_frame_t *frame)
{
    if (canopy_ring_count(&self->queue) == CANOPY_LOCKSTEP_FRAMES) {
        canopy_can_frame_t oldest;
        (void)canopy_ring_pop(&self->queue, &oldest);
        self->overwritten++;
    }
    (void)canopy_ring_push(&self->queue, frame);
}

/** Takes frames up to a new step. @return 1 a new step, 0 no frame is left, negative canopy_error_t. */
static int read_step(canopy_lockstep_t *self)
{
    canopy_can_frame_t frame;
    int result;
    while ((result = self->inner->receive(self->inner->context, &frame)) == 1) {
        if (!is_step(self, &frame)) {
            keep(self, &frame);
        } else if (is_new_step(self, &frame)) {
            self->last = frame;
            self->joined = true;
            return 1;
        }
    }
    return result;
}

static bool lockstep_wait_until(void *context, canopy_time_t deadline)
{
    canopy_lockstep_t *self = context;
    unsigned failures = 0;
    self->error = CANOPY_OK;
    while (self->stop == NULL || !atomic_load_explicit(self->stop, memory_order_relaxed)) {
        int result = read_step(self);
        if (result == 1) {
            if (canopy_time_reached(deadline, self->now)) {
                self->now = deadline;
            }
            return true;
        }
        if (result == 0) {
            result = self->inner->wait(self->inner->context, CANOPY_LOCKSTEP_SLICE_US);
        }
        failures = result < 0 ? failures + 1u : 0u;
        if (failures == CANOPY_LOCKSTEP_FAILURES_MAX) {
            self->error = (canopy_error_t)result;
            return false;
        }
    }
    return false;
}

canopy_error_t canopy_lockstep_init(canopy_lockstep_t *self, const canopy_can_t *inner, uint32_t step_id,
                                    const atomic_bool *stop)
{
    if (self == NULL || inner == NULL || step_id > 0x7FFu) {
        return CANOPY_ERROR_ARGUMENT;
    }
    if (inner->wait == NULL) {
        return CANOPY_ERROR_UNSUPPORTED;
    }
    self->can = (canopy_can_t){
        .context = self,
        .receive = lockstep_receive,
        .send = lockstep_send,
        .wait = NULL,
        .stats = lockstep_stats,
    };
    self->clock = (canopy_clock_t){.context = self, .now = lockstep_now, .wait_until = lockstep_wait_until};
    self->inner = inner;
    self->stop = stop;
    self->step_id = step_id;
    self->now = 0u;
    self->joined = false;
    self->received = 0u;
    self->overwritten = 0u;
    self->error = CANOPY_OK;
    return canopy_ring_init(&self->queue, self->storage, sizeof self->storage, sizeof self->storage[0],
                            CANOPY_LOCKSTEP_FRAMES);
}

canopy_error_t canopy_lockstep_error(const canopy_lockstep_t *self)
{
    return self->error;
}
