/* SPDX-License-Identifier: MIT */
/**
 * @file
 * A CAN frame, and the small interface behind which every CAN driver stands.
 *
 * Threads: the functions of one driver are called from the loop's thread only. A driver that receives in an interrupt
 * or a thread of its own hands frames over through a canopy_ring_t.
 *
 * receive and send are O(bytes) and do not allocate; what else a driver costs, its header says.
 */
#ifndef CANOPY_CAN_H
#define CANOPY_CAN_H

#include <stdint.h>

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
    uint32_t id;    /**< Arbitration id without flags: 0..0x7FF, extended 0..0x1FFFFFFF. */
    uint8_t flags;  /**< CANOPY_CAN_... */
    uint8_t length; /**< Bytes of data: 0..8; CAN FD 0..8, 12, 16, 20, 24, 32, 48, 64. */
    uint8_t data[CANOPY_CAN_DATA_MAX];
} canopy_can_frame_t;

/** What a driver has lost and seen since it was opened. Counters only grow. */
typedef struct {
    uint32_t received;      /**< Frames handed to the loop. */
    uint32_t sent;          /**< Frames taken over by the hardware or the kernel. */
    uint32_t rx_dropped;    /**< Frames lost before the loop could take them. */
    uint32_t tx_dropped;    /**< Frames that send() could not take (returned 0 or an error). */
    uint32_t error_frames;  /**< Error frames seen. */
    uint32_t rx_high_water; /**< Most frames ever waiting in the driver's own queue; 0 when it has none. */
} canopy_can_stats_t;

/**
 * A CAN driver: functions and the object they work on. Constant once the driver is open.
 */
typedef struct {
    /** The driver's object; handed to every function. */
    void *context;
    /**
     * Takes the oldest waiting frame. Never blocks.
     * @return 1 a frame was written to *frame, 0 none is waiting, negative canopy_error_t (*frame is untouched).
     */
    int (*receive)(void *context, canopy_can_frame_t *frame);
    /**
     * Sends one frame. Never blocks longer than the driver's header says, never queues behind the caller's back
     * beyond the hardware's own buffer: an old command must not leave late.
     * @return 1 taken, 0 no room now (the frame is dropped and counted), negative canopy_error_t.
     */
    int (*send)(void *context, const canopy_can_frame_t *frame);
    /**
     * Waits until a frame is there or timeout_us has passed. NULL where the driver cannot wait.
     * @return 1 a frame is waiting, 0 time is over, negative canopy_error_t.
     */
    int (*wait)(void *context, uint32_t timeout_us);
    /** Copies the counters. O(1). */
    void (*stats)(void *context, canopy_can_stats_t *stats);
} canopy_can_t;

#endif
