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
#include "canopy/can_state.h"
#include "canopy/clock.h"
#include "canopy/count.h"
#include "canopy/e2e.h"
#include "canopy/tx.h"

/** The age of a message that never came, and of one that is older than all others [ms]. */
#define CANOPY_AGE_MAX UINT16_MAX

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
    /**
     * Tells the leaves (through the input image) whether the message is fresh, and how old its values are.
     * @param age_ms since they were on the wire, rounded up [ms]; CANOPY_AGE_MAX: none are there, or they are older
     */
    void (*set_age)(void *input, bool fresh, uint16_t age_ms);
} canopy_rx_message_t;

/** What is true of a whole cycle: a part of the input image. */
typedef struct {
    canopy_time_t now;            /**< Time of this tick [us]. */
    canopy_can_state_t can_state; /**< The state of the bus. */
    /** More has come than is taken, for more than one cycle, or the driver has lost frames: what is here may not be all. */
    bool overload;
} canopy_cycle_t;

/** The bus of one application. Constant. */
typedef struct {
    const canopy_rx_message_t *rx; /**< In ascending order of (extended, id). */
    const canopy_tx_message_t *tx; /**< In the order of their urgency: the lowest arbitration id first. */
    uint16_t rx_count;
    uint16_t tx_count;
    /** Gives every output its safe value: what is sent when no leaf writes it. */
    void (*reset_output)(void *output);
    /** Hands to the leaves, through the input image, what is true of the whole cycle. */
    void (*set_cycle)(void *input, const canopy_cycle_t *cycle);
} canopy_bus_t;

/** State of a received message. */
typedef struct {
    canopy_time_t arrived_at; /**< On the wire, of the last accepted frame; a whole number of ms before it was taken. */
    canopy_e2e_receiver_t e2e;
    bool received;   /**< Has a frame ever been accepted, and is it not stale? */
    bool fresh;      /**< As the leaves saw it in the last tick. */
    bool taken;      /**< A frame was taken since the last tick, accepted or not. */
    bool taken_then; /**< The same of the tick before: what the trace tells. */
    uint16_t age_ms; /**< When it was taken, of the frame accepted last [ms]; CANOPY_AGE_MAX and more are one. */
} canopy_rx_state_t;

/** What became of received frames. Counters only grow, and saturate. */
typedef struct {
    uint32_t accepted;
    uint32_t unknown_id;     /**< Not a message of this controller. */
    uint32_t wrong_form;     /**< Wrong flags or length. */
    uint32_t wrong_crc;      /**< E2E: damaged. */
    uint32_t wrong_sequence; /**< E2E: repeated, or out of order. */
    uint32_t out_of_range;   /**< A value outside the DBC's range. */
    uint32_t timeouts;       /**< A message became stale. */
} canopy_bus_counters_t;

/** An application's bus at run time: the tables, the images, and the state. Set up by
 * canopy_loop_init(). */
typedef struct {
    const canopy_bus_t *bus;
    void *input;
    void *output;
    canopy_rx_state_t *rx; /**< bus->rx_count. */
    canopy_bus_counters_t counters;
    /** What CanopyInputs tells of the frames taken since the start, so that a replay can take the same ones: */
    uint32_t taken;    /**< How many had the id of a message, refused ones too; modulo 2^32. */
    uint8_t check;     /**< canopy_bus_check() over those of a right form, and over each tick's ages and bus state. */
    uint16_t expected; /**< The message behind the one that came last: the first guess for the next frame. */
} canopy_bus_state_t;

/**
 * The running check of CanopyInputs after one more frame: the one before, rotated left by 3, XOR the low byte of the id,
 * XOR every byte of data. It tells frames apart and notices their order; it protects nothing. O(length).
 * @param length bytes of data; not checked
 */
uint8_t canopy_bus_check(uint8_t check, uint32_t id, const uint8_t *data, uint8_t length);

/**
 * Takes one frame into the input image, or refuses and counts it. O(log messages + bytes).
 * @param now the time of the cycle that takes it [us]; a frame that has arrived since has the age 0
 */
void canopy_bus_receive(canopy_bus_state_t *self, const canopy_can_frame_t *frame, canopy_time_t now);

/** Before a tick: tells the leaves what is fresh, and of the cycle; outputs take their safe values. O(messages). */
void canopy_bus_begin_tick(canopy_bus_state_t *self, const canopy_cycle_t *cycle);

/** After a tick: posts the messages that are due in tick number `tick`, each with its deadline. O(messages). */
void canopy_bus_commit(const canopy_bus_state_t *self, canopy_tx_t *tx, uint32_t tick, canopy_time_t now);

/** Posts every message, due or not, with one deadline. O(messages). */
void canopy_bus_commit_all(const canopy_bus_state_t *self, canopy_tx_t *tx, canopy_time_t until);

/**
 * On the way back after an unusable bus (canopy_tx_owe()): posts the messages that still owe a value, and holds back the
 * others, so that on a slow bus each gets its turn. O(messages).
 */
void canopy_bus_commit_owed(const canopy_bus_state_t *self, canopy_tx_t *tx, canopy_time_t until);

/** Frames refused for any reason but an unknown id; saturates. O(1). */
uint32_t canopy_bus_rejected(const canopy_bus_counters_t *counters);

#endif
