/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Lock-step with a simulator: a CAN driver and a clock in one, around any other CAN driver.
 *
 * Time stands still until the simulator says that its sensor frames for the next step are complete: a frame with the
 * step message's id whose data differ from those of the last one. Then time jumps to the loop's deadline, the loop gets
 * exactly the frames that came before that frame, ticks once, and sends; the simulator answers with the next step.
 * So a run is the same, tick for tick, however fast or busy the machine is.
 *
 * A step frame with the same data again is the simulator's reminder (it re-sends while it waits). A controller that has
 * answered already ignores it; one that has just been started takes its first step from it.
 *
 * Threads: everything is called from the loop's thread. Only the stop flag may be written elsewhere (a signal handler).
 * Memory: the object is the caller's (about 5 KiB); nothing is allocated.
 */
#ifndef CANOPY_CLOCK_LOCKSTEP_H
#define CANOPY_CLOCK_LOCKSTEP_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

#include "canopy/can.h"
#include "canopy/clock.h"
#include "canopy/ring.h"
#include "canopy/status.h"

/** Frames that can wait for one step; when more come, the oldest are dropped and counted. */
#define CANOPY_LOCKSTEP_FRAMES 64u

/** Longest time after which a stop flag is noticed [µs]. */
#define CANOPY_LOCKSTEP_SLICE_US 100000u

/** Failed waits in a row after which the run is ended. */
#define CANOPY_LOCKSTEP_FAILURES_MAX 50u

/** Length of a wait until a frame is out [us], and how many of them; and how often the outcome is asked for at most. */
#define CANOPY_LOCKSTEP_POLL_US 1000u
#define CANOPY_LOCKSTEP_SEND_WAITS 100u
#define CANOPY_LOCKSTEP_SEND_POLLS 100000u

/** The pair. Owned by the caller, stays where it is; members but `can` and `clock` are private. */
typedef struct {
    /**
     * For the loop. receive() gives the frames of the current step, then 0 until the next one; step frames themselves
     * are kept back; their time is now, for time stands still while they come. send() waits until the inner driver knows that
     * the frame is out, CANOPY_LOCKSTEP_SEND_WAITS times CANOPY_LOCKSTEP_POLL_US at most; then it gives
     * CANOPY_ERROR_BUS_DOWN. state and restart are the inner driver's. wait is NULL. stats() are the inner driver's with
     * the own losses added to rx_dropped, and received and rx_high_water as the loop sees them.
     */
    canopy_can_t can;
    /**
     * For the loop. now() is virtual, from 0. Each wait_until() waits for one new step, also when the deadline is
     * past: no tick without a step. It returns false when the stop flag is set or the inner driver keeps failing.
     */
    canopy_clock_t clock;
    const canopy_can_t *inner;
    const atomic_bool *stop;
    uint32_t step_id;
    canopy_time_t now;
    bool in_flight; /* a frame is with the inner driver */
    bool joined;    /* `last` holds the last step frame */
    canopy_can_frame_t last;
    uint32_t received;
    uint32_t overwritten;
    canopy_error_t error;
    canopy_ring_t queue;
    canopy_can_frame_t storage[CANOPY_LOCKSTEP_FRAMES];
} canopy_lockstep_t;

/**
 * Makes the pair.
 *
 * @param self     the object
 * @param inner    an open driver that can wait; lives longer than the pair. Its filter lets the step message through.
 * @param step_id  11-bit id of the step message
 * @param stop     ends a wait within CANOPY_LOCKSTEP_SLICE_US when it becomes true; NULL: never
 * @return CANOPY_OK; CANOPY_ERROR_ARGUMENT: a NULL or an id over 0x7FF; CANOPY_ERROR_UNSUPPORTED: inner cannot wait. O(1).
 */
canopy_error_t canopy_lockstep_init(canopy_lockstep_t *self, const canopy_can_t *inner, uint32_t step_id,
                                    const atomic_bool *stop);

/** Why the last wait_until() gave false: the inner driver's error, or CANOPY_OK when the stop flag was set. O(1). */
canopy_error_t canopy_lockstep_error(const canopy_lockstep_t *self);

#endif
