/* SPDX-License-Identifier: MIT */
/**
 * @file
 * A CAN frame, and the small interface behind which every CAN driver stands.
 *
 * Threads: receive, wait, state, restart and stats are called from the loop's thread only. A driver that receives in an
 * interrupt or a thread of its own hands frames over through a canopy_ring_t. send, outcome and abort are called from the
 * transmit context only: whatever calls canopy_tx_service() (canopy/tx.h), which is the loop's thread for a driver
 * without request().
 *
 * receive and send are O(bytes) and do not allocate; what else a driver costs, its header says.
 */
#ifndef CANOPY_CAN_H
#define CANOPY_CAN_H

#include <stdbool.h>
#include <stdint.h>

#include "canopy/clock.h"

#define CANOPY_CAN_DATA_MAX 64u

/** Flags of a frame. */
enum {
    CANOPY_CAN_EXTENDED = 1u << 0, /**< 29-bit arbitration id; else 11-bit. */
    CANOPY_CAN_REMOTE = 1u << 1,   /**< Remote request: length is the length asked for, no data. */
    CANOPY_CAN_ERROR = 1u << 2,    /**< An error frame from the driver, not from a node of the bus. */
    CANOPY_CAN_FD = 1u << 3,       /**< CAN FD frame. */
    CANOPY_CAN_BITRATE_SWITCH = 1u << 4,
    CANOPY_CAN_ERROR_STATE = 1u << 5
};

/**
 * One frame. Bytes of data past length are not defined, nor is any of a remote frame: a driver neither reads them nor
 * lets them out, to the bus or into a log.
 */
typedef struct {
    /**
     * On the clock of the loop [us]. Of a received frame: when it arrived on the wire, as the kernel or the controller
     * stamped it; never later than it was, for what a leaf may call fresh is counted from here. canopy_time_of_stamp()
     * makes it from a controller's timer. Of one to be sent: when it was handed to the driver.
     */
    canopy_time_t time;
    uint32_t id;                       /**< Arbitration id without flags: 0..0x7FF, extended 0..0x1FFFFFFF. */
    uint8_t data[CANOPY_CAN_DATA_MAX]; /**< Behind a word, so that a driver can move words. */
    uint8_t flags;                     /**< CANOPY_CAN_... */
    uint8_t length;                    /**< Bytes of data: 0..8; CAN FD 0..8, 12, 16, 20, 24, 32, 48, 64. */
} canopy_can_frame_t;

/** What a driver has lost and seen since it was opened. Counters only grow. */
typedef struct {
    uint32_t received;      /**< Frames handed to the loop. */
    uint32_t sent;          /**< Frames that are out, as far as the driver can know. */
    uint32_t rx_dropped;    /**< Frames lost before the loop could take them. */
    uint32_t tx_dropped;    /**< Frames that send() took and that never got out, or that it refused with an error. */
    uint32_t error_frames;  /**< Error frames seen. */
    uint32_t rx_high_water; /**< Most frames ever waiting in the driver's own queue; 0 when it has none. */
} canopy_can_stats_t;

/** What a controller says of itself and of its bus; canopy/can_state.h makes of it what leaves see. */
typedef enum {
    CANOPY_CAN_CONTROLLER_ACTIVE = 0, /**< Error-active; also of a driver that does not know. */
    CANOPY_CAN_CONTROLLER_WARNING,    /**< An error counter is at 96 or more. */
    CANOPY_CAN_CONTROLLER_PASSIVE,    /**< Error-passive: an error counter is at 128 or more. */
    CANOPY_CAN_CONTROLLER_BUS_OFF, /**< The transmit error counter went over 255: takes part no more until restart(). */
    CANOPY_CAN_CONTROLLER_DOWN,    /**< Switched off, by the operating system for example. */
    CANOPY_CAN_CONTROLLER_GONE     /**< The interface does not exist any more. */
} canopy_can_controller_t;

/** What a cycle worked with besides its frames. A replay tells the loop what it was. */
typedef struct {
    uint8_t can_state; /**< A canopy_can_state_t. */
    bool overload;     /**< canopy_cycle_t.overload. */
    bool returning;    /**< Safe values went out instead of the tree's, because the bus had been unusable. */
} canopy_can_conditions_t;

/** What has become of a frame that send() took. */
typedef enum {
    CANOPY_CAN_PENDING = 0, /**< Waits for the bus, or is on it. */
    CANOPY_CAN_SENT,        /**< It is out: it was acknowledged. The mailbox is free. */
    CANOPY_CAN_ABORTED      /**< It is not out and never will be. The mailbox is free. */
} canopy_can_outcome_t;

/**
 * A CAN driver: functions and the object they work on. Constant once the driver is open.
 */
typedef struct {
    /** The driver's object; handed to every function. */
    void *context;
    /**
     * Takes the oldest waiting frame, of several queues the one that arrived first. Never blocks.
     * @return 1 a frame was written to *frame, 0 none is waiting, negative canopy_error_t (*frame is untouched).
     */
    int (*receive)(void *context, canopy_can_frame_t *frame);
    /**
     * Hands one frame to a free mailbox of the hardware, or of what stands for it. Never blocks longer than the driver's
     * header says, and never queues behind the mailbox: an old command must not leave late.
     * @param mailbox 0..mailboxes - 1, one whose last frame has had its outcome
     * @return 1 taken; 0 no room just now: it may be offered again; negative canopy_error_t: it cannot be sent now.
     */
    int (*send)(void *context, uint8_t mailbox, const canopy_can_frame_t *frame);
    /**
     * What has become of the frame in a mailbox; asked until it is no longer PENDING. NULL: what send() takes is out at
     * once (a bus in memory), and there is one mailbox.
     */
    canopy_can_outcome_t (*outcome)(void *context, uint8_t mailbox);
    /**
     * Asks the hardware to take back the frame in a mailbox; outcome() then says what came of it, at once or later. NULL:
     * the hardware cannot.
     */
    void (*abort)(void *context, uint8_t mailbox);
    /**
     * Lets the transmit context run soon: sets the transmit interrupt pending, wakes a thread. It calls canopy_tx_service().
     * Called from the loop's thread after it has posted frames. NULL: the loop calls canopy_tx_service() itself.
     */
    void (*request)(void *context);
    /** What the controller says of itself. O(1), does not block. NULL: always error-active. */
    canopy_can_controller_t (*state)(void *context);
    /**
     * Tries to bring a controller back that is bus-off, down or gone. Does not block; state() tells what came of it.
     * NULL: it comes back by itself, or never.
     */
    void (*restart)(void *context);
    /**
     * Waits until a frame is there or timeout_us has passed. NULL where the driver cannot wait.
     * @return 1 a frame is waiting, 0 time is over, negative canopy_error_t.
     */
    int (*wait)(void *context, uint32_t timeout_us);
    /**
     * What the cycle at hand worked with when it was recorded; asked after its frames were taken. The loop then does not
     * judge by itself. NULL but for a replay.
     */
    void (*conditions)(void *context, canopy_can_conditions_t *conditions);
    /** Copies the counters. O(1). NULL: there are none. */
    void (*stats)(void *context, canopy_can_stats_t *stats);
    uint8_t mailboxes; /**< Frames that the hardware can hold, 1..CANOPY_CAN_MAILBOXES_MAX; 0 is 1. */
    bool is_filtered;  /**< Hands over the frames of its acceptance list and no others: nothing unknown is ever seen. */
} canopy_can_t;

/** Most mailboxes that are used. More do not help: they only let a less urgent frame stand before a more urgent one. */
#define CANOPY_CAN_MAILBOXES_MAX 4u

/**
 * The time on the loop's clock at which a controller's free-running timer had a certain value: for its receive stamps.
 *
 * @param now       the loop's clock, read together with `timer` [us]
 * @param timer     the timer now
 * @param stamp     the timer when the frame arrived; less than one turn of the timer ago
 * @param bits      width of the timer, 1..32; not checked
 * @param tick_ns   length of one count [ns]
 * @return the time of arrival [us], or up to a count earlier: a frame never looks younger than it is. O(1).
 */
static inline canopy_time_t canopy_time_of_stamp(canopy_time_t now, uint32_t timer, uint32_t stamp, unsigned bits,
                                                 uint32_t tick_ns)
{
    const uint32_t mask = UINT32_MAX >> (32u - bits);
    const uint64_t ago_ns = ((uint64_t)((timer - stamp) & mask) + 1u) * tick_ns; /* whole counts: up to one more */

    return now - (ago_ns + 999u) / 1000u;
}

#endif
