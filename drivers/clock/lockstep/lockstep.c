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

/** Waits a little for the inner driver. @return false: the bound is reached */
static bool wait_for_inner(canopy_lockstep_t *self, unsigned *polls, unsigned *waits)
{
    if (self->inner->wait(self->inner->context, CANOPY_LOCKSTEP_POLL_US) == 0) {
        (*waits)++;
    }
    (*polls)++;
    return *waits < CANOPY_LOCKSTEP_SEND_WAITS && *polls < CANOPY_LOCKSTEP_SEND_POLLS;
}

/** What has become of the frame that is with the inner driver; SENT when none is. */
static canopy_can_outcome_t settle(canopy_lockstep_t *self)
{
    const canopy_can_t *inner = self->inner;
    canopy_can_outcome_t outcome = CANOPY_CAN_SENT;

    if (self->in_flight && inner->outcome != NULL) {
        outcome = inner->outcome(inner->context, 0);
    }
    self->in_flight = outcome == CANOPY_CAN_PENDING;
    return outcome;
}

/** One attempt. @return 1 it is out, 0 not yet, negative canopy_error_t */
static int advance(canopy_lockstep_t *self, const canopy_can_frame_t *frame, bool *taken)
{
    canopy_can_outcome_t outcome = settle(self); /* of this frame, or of an earlier one for which the time was over */
    int result = 1;

    if (outcome == CANOPY_CAN_PENDING) {
        return 0;
    }
    if (!*taken) {
        result = self->inner->send(self->inner->context, 0, frame);
        *taken = result == 1;
        self->in_flight = *taken;
        outcome = settle(self);
    }
    if (result != 1 || outcome == CANOPY_CAN_PENDING) {
        return result < 0 ? result : 0;
    }
    return outcome == CANOPY_CAN_SENT ? 1 : CANOPY_ERROR_BUS_DOWN;
}

/**
 * Sends, and waits until the frame is out: time stands still meanwhile, so nothing may be left to do between two ticks.
 * Never 0: the loop would try again between two ticks, and take the next step for it.
 */
static int lockstep_send(void *context, uint8_t mailbox, const canopy_can_frame_t *frame)
{
    canopy_lockstep_t *self = context;
    unsigned polls = 0;
    unsigned waits = 0;
    bool taken = false;

    (void)mailbox;
    do {
        int result = advance(self, frame, &taken);

        if (result != 0) {
            return result;
        }
    } while (wait_for_inner(self, &polls, &waits));
    if (self->in_flight && self->inner->abort != NULL) {
        self->inner->abort(self->inner->context, 0);
    }
    return CANOPY_ERROR_BUS_DOWN;
}

static canopy_can_controller_t lockstep_state(void *context)
{
    const canopy_lockstep_t *self = context;

    return self->inner->state != NULL ? self->inner->state(self->inner->context) : CANOPY_CAN_CONTROLLER_ACTIVE;
}

static void lockstep_restart(void *context)
{
    const canopy_lockstep_t *self = context;

    if (self->inner->restart != NULL) {
        self->inner->restart(self->inner->context);
    }
}

static void lockstep_stats(void *context, canopy_can_stats_t *stats)
{
    const canopy_lockstep_t *self = context;
    *stats = (canopy_can_stats_t){0};
    if (self->inner->stats != NULL) {
        self->inner->stats(self->inner->context, stats);
    }
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
        .state = lockstep_state,
        .restart = lockstep_restart,
        .wait = NULL,
        .stats = lockstep_stats,
        .mailboxes = 1,
        .is_filtered = inner->is_filtered,
    };
    self->clock = (canopy_clock_t){.context = self, .now = lockstep_now, .wait_until = lockstep_wait_until};
    self->inner = inner;
    self->stop = stop;
    self->step_id = step_id;
    self->now = 0u;
    self->joined = false;
    self->in_flight = false;
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
