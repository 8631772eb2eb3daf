/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The application's side of the CAN bus: frames into the input image, the output image into frames.
 *
 * `canopy compile` makes the constant tables here from the DBC. A frame is checked from the outside in (arbitration id,
 * flags, length, CRC, counter, ranges of the values); one that fails changes nothing that a leaf can see, but a counter.
 *
 * Threads: the loop's thread only.
 */
#ifndef CANOPY_BUS_H
#define CANOPY_BUS_H

#include <stdbool.h>
#include <stdint.h>

#include "canopy/can.h"
#include "canopy/clock.h"
#include "canopy/e2e.h"

/** In data_id: the message has no end-to-end protection. */
#define CANOPY_E2E_NONE (-1)

/** A message that the controller receives. Constant. */
typedef struct {
    uint32_t id;           /**< Arbitration id. */
    uint8_t flags;         /**< CANOPY_CAN_EXTENDED, CANOPY_CAN_FD as the frame must have them. */
    uint8_t length;        /**< Bytes; another length is refused. */
    int32_t data_id;       /**< E2E data id 0..65535, or CANOPY_E2E_NONE. */
    canopy_time_t timeout; /**< [us] after which the message is stale; 0: never. */
    /**
     * Takes the values of `length` bytes into the input image.
     * @return false when one lies outside the DBC's range: then nothing was taken.
     */
    bool (*decode)(void *input, const uint8_t *data);
    /** Tells the leaves (through the input image) whether the message is fresh. */
    void (*set_fresh)(void *input, bool fresh);
} canopy_rx_message_t;

/** A message that the controller sends. Constant. */
typedef struct {
    uint32_t id;
    uint8_t flags;
    uint8_t length;
    int32_t data_id; /**< E2E data id 0..65535, or CANOPY_E2E_NONE. */
    uint16_t every;  /**< Sent in every `every`-th tick, >= 1. */
    /** Writes the output image's values into `length` bytes, all of them. */
    void (*encode)(const void *output, uint8_t *data);
} canopy_tx_message_t;

/** The bus of one application. Constant. */
typedef struct {
    const canopy_rx_message_t *rx; /**< In ascending order of (extended, id). */
    const canopy_tx_message_t *tx; /**< In the order in which they are sent. */
    uint16_t rx_count;
    uint16_t tx_count;
    /** Gives every output its safe value: what is sent when no leaf writes it. */
    void (*reset_output)(void *output);
    /** Hands `now` to the leaves through the input image. */
    void (*set_now)(void *input, canopy_time_t now);
} canopy_bus_t;

/** State of a received message. */
typedef struct {
    canopy_time_t received_at; /**< Of the last accepted frame. */
    canopy_e2e_receiver_t e2e;
    bool received; /**< Has a frame ever been accepted? */
    bool fresh;
} canopy_rx_state_t;

/** What became of frames. Counters only grow, and saturate. */
typedef struct {
    uint32_t accepted;
    uint32_t unknown_id;     /**< Not a message of this controller. */
    uint32_t wrong_form;     /**< Wrong flags or length. */
    uint32_t wrong_crc;      /**< E2E: damaged. */
    uint32_t wrong_sequence; /**< E2E: repeated, or out of order. */
    uint32_t out_of_range;   /**< A value outside the DBC's range. */
    uint32_t timeouts;       /**< A message became stale. */
    uint32_t sent;
    uint32_t tx_dropped; /**< The driver had no room or failed; the frame is not tried again. */
} canopy_bus_counters_t;

/** An application's bus at run time: the tables, the images, and the state. Set up by
 * canopy_loop_init(). */
typedef struct {
    const canopy_bus_t *bus;
    void *input;
    void *output;
    canopy_rx_state_t *rx; /**< bus->rx_count. */
    uint8_t *tx_counters;  /**< bus->tx_count E2E counters. */
    canopy_bus_counters_t counters;
    /** What CanopyInputs tells of the frames taken since the start, so that a replay can take the same ones: */
    uint8_t taken; /**< How many had the id of a message, refused ones too; modulo 256. */
    uint8_t check; /**< canopy_bus_check() over those of a right form. */
} canopy_bus_state_t;

/** The sum, or the largest value where that is less. O(1); may be called from anywhere. */
static inline uint32_t canopy_sum(uint32_t a, uint32_t b)
{
    return a <= UINT32_MAX - b ? a + b : UINT32_MAX;
}

/** Adds one, and stays at the largest value instead of starting again at 0. O(1). */
static inline void canopy_count(uint32_t *counter)
{
    *counter += *counter != UINT32_MAX ? 1u : 0u;
}

/**
 * The running check of CanopyInputs after one more frame: the one before, rotated left by 3, XOR the low byte of the id,
 * XOR every byte of data. It tells frames apart and notices their order; it protects nothing. O(length).
 * @param length bytes of data; not checked
 */
uint8_t canopy_bus_check(uint8_t check, uint32_t id, const uint8_t *data, uint8_t length);

/**
 * Takes one frame into the input image, or refuses and counts it. O(log messages + bytes).
 * @param now when it was taken from the driver [us]
 */
void canopy_bus_receive(canopy_bus_state_t *self, const canopy_can_frame_t *frame, canopy_time_t now);

/** Before a tick: tells the leaves what is fresh and what time it is; outputs take their safe values. O(messages). */
void canopy_bus_begin_tick(canopy_bus_state_t *self, canopy_time_t now);

/**
 * After a tick: sends the messages that are due in tick number `tick`. O(messages).
 * A frame that the driver does not take is dropped and counted: a command must not leave late.
 */
void canopy_bus_commit(canopy_bus_state_t *self, const canopy_can_t *can, uint32_t tick);

/** Frames refused for any reason but an unknown id; saturates. O(1). */
uint32_t canopy_bus_rejected(const canopy_bus_counters_t *counters);

#endif
