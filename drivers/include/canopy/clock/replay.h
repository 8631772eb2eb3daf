/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Replay of a record: a CAN driver and a clock in one, which give the loop the frames and the times of an earlier run
 * (docs/replay.md). The loop, the tree and the leaves are the real ones; they cannot tell the difference.
 *
 * A record is a sequence of frames. Each tick is, in this order:
 *
 *   CanopyInputs     begins the tick; its Now is the tick's time. Taken and Check are ignored.
 *   CanopyArrivals   says what is true from here on. CanState, Overload and Returning are the tick's: the last frame of
 *                    the tick counts, and a tick without one has those of the tick before (all 0 at the start).
 *                    Age0 is the age in ms of each frame that follows in this tick, until the next CanopyArrivals; frames
 *                    before the first one have the age 0. Count, Age1, Age2 and Tick are ignored.
 *   any other frame  was taken by the tick. Its time is Now - Age0.
 *
 * The frames of a tick are in the order in which they were taken. `canopy replay` makes the record from a log of the bus:
 * there a tick's CanopyArrivals holds up to three ages; in the record it gives one for each taken frame (which may be left
 * out while nothing changes). Time stands still within a tick, and the next one begins at once; so a replay is as fast as
 * the machine.
 *
 * What the loop sends is out at once: frames that a busy bus held up, replaced or dropped in the recorded run are sent in
 * the replay. The state of the bus is the recorded one (canopy_can_t.conditions), so the decisions are the same.
 *
 * Threads: everything is called from the loop's thread. Memory: the object is the caller's; nothing is allocated. Needs
 * no operating system: on a target the record may come from flash, a serial line, or semihosting.
 */
#ifndef CANOPY_CLOCK_REPLAY_H
#define CANOPY_CLOCK_REPLAY_H

#include <stdbool.h>
#include <stdint.h>

#include "canopy/can.h"
#include "canopy/clock.h"
#include "canopy/status.h"
#include "canopy/trace.h"

/** Where the record comes from, and where the frames go that the controller sends. */
typedef struct {
    void *context; /**< Handed to both. */
    /** Gives the record's next frame. @return 1 a frame was written, 0 the record ends, negative canopy_error_t. */
    int (*read)(void *context, canopy_can_frame_t *frame);
    /** Takes a frame that the controller sends. @return 1, or negative canopy_error_t: the replay ends. NULL: nobody looks. */
    int (*write)(void *context, const canopy_can_frame_t *frame);
} canopy_replay_io_t;

/** The pair. Owned by the caller, stays where it is; members but `can` and `clock` are private. */
typedef struct {
    /** For the loop. receive() gives the frames of the current tick, then 0. send() writes. wait is NULL. */
    canopy_can_t can;
    /**
     * For the loop. now() is the time in the record. wait_until() goes to the next tick, whatever the deadline; false:
     * none is left.
     */
    canopy_clock_t clock;
    canopy_replay_io_t io;
    canopy_trace_id_t inputs;
    canopy_trace_id_t arrivals;
    canopy_can_conditions_t conditions;
    canopy_time_t age;       /* of the frames that follow [us] */
    canopy_can_frame_t next; /* read ahead, when `left` is 1 */
    int left;                /* what the last read said */
    canopy_time_t now;
    canopy_can_stats_t stats;
    canopy_error_t error;
} canopy_replay_t;

/**
 * Makes the pair, and reads the record's first frame: the loop's first deadline is its time.
 *
 * @param self   the object
 * @param io     copied; what its context points to lives longer than the pair
 * @param trace  the application's trace, with its CanopyInputs and CanopyArrivals: `app->trace`
 * @return CANOPY_OK; CANOPY_ERROR_ARGUMENT: a NULL; CANOPY_ERROR_UNSUPPORTED: the application does not send both messages;
 *         CANOPY_ERROR_NOT_FOUND: the record does not begin with a CanopyInputs frame of this application; what read
 *         says. O(1).
 */
canopy_error_t canopy_replay_init(canopy_replay_t *self, const canopy_replay_io_t *io,
                                  const canopy_trace_config_t *trace);

/** Why wait_until() gave false: what read or write said, or CANOPY_OK at the record's end. O(1). */
canopy_error_t canopy_replay_error(const canopy_replay_t *self);

#endif
