/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Replay of a record: a CAN driver and a clock in one, which give the loop the frames and the times of an earlier run
 * (docs/replay.md). The loop, the tree and the leaves are the real ones; they cannot tell the difference.
 *
 * A record is a sequence of items. A tick's item gives its time and the state of the bus; behind it come the frames that
 * the tick has taken, in that order, each with its age. It has nothing to do with what the frames of the trace look like:
 * `canopy replay` reads those, and makes the record. Time stands still within a tick, and the next one begins at once; so a
 * replay is as fast as the machine.
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

/** One item of a record. */
typedef struct {
    bool is_tick;                       /**< Begins a tick; else a frame that the tick has taken. */
    canopy_time_t now;                  /**< Of a tick: its time [us]. */
    canopy_can_conditions_t conditions; /**< Of a tick: the state of its bus. */
    uint16_t age;                       /**< Of a frame: how old it was when it was taken [ms]. */
    canopy_can_frame_t frame;           /**< Its time is not looked at. */
} canopy_replay_item_t;

/** Where the record comes from, and where the frames go that the controller sends. */
typedef struct {
    void *context; /**< Handed to both. */
    /** Gives the record's next item. @return 1 an item was written, 0 the record ends, negative canopy_error_t. */
    int (*read)(void *context, canopy_replay_item_t *item);
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
    canopy_can_conditions_t conditions;
    canopy_replay_item_t next; /* read ahead, when `left` is 1 */
    int left;                  /* what the last read said */
    canopy_time_t now;
    canopy_can_stats_t stats;
    canopy_error_t error;
} canopy_replay_t;

/**
 * Makes the pair, and reads the record's first item: the loop's first deadline is its time.
 *
 * @param self   the object
 * @param io     copied; what its context points to lives longer than the pair
 * @return CANOPY_OK; CANOPY_ERROR_ARGUMENT: a NULL; CANOPY_ERROR_NOT_FOUND: the record does not begin with a tick; what
 *         read says. O(1).
 */
canopy_error_t canopy_replay_init(canopy_replay_t *self, const canopy_replay_io_t *io);

/** Why wait_until() gave false: what read or write said, or CANOPY_OK at the record's end. O(1). */
canopy_error_t canopy_replay_error(const canopy_replay_t *self);

#endif
