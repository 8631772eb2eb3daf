/* SPDX-License-Identifier: MIT */
/**
 * @file
 * What a monitor sees of each tick, in few CAN frames (docs/trace.md has the layout bit by bit).
 *
 * After the commands of each tick: CanopyTick (tick number, the root's status; also the controller's heartbeat), then
 * CanopyChange frames with the (node, status) pairs that changed, at most `changes_max` frames, then one CanopySnapshot
 * frame with ten nodes' statuses, the next ten in the next tick, so that a monitor can join at any time. Changes that
 * did not fit are sent in the following ticks: the receiver is late then, but never wrong for good. CanopyInputs and
 * CanopyArrivals say what the tick worked with, so that a log of the bus can be replayed (docs/replay.md). CanopyHealth
 * carries the loss counters at a slow rate, CanopyModel which tree this is.
 *
 * CanopyTick, CanopyChange and CanopySnapshot count up a sequence number, so that a receiver knows when it has lost one.
 *
 * Threads: the loop's thread only. Nothing blocks: frames wait behind the commands (canopy/tx.h), and are dropped and
 * counted when there is no room or when they are not out after CANOPY_TRACE_PERIODS periods.
 */
#ifndef CANOPY_TRACE_H
#define CANOPY_TRACE_H

#include "canopy/bus.h"
#include "canopy/can.h"
#include "canopy/tree.h"
#include "canopy/tx.h"

/** A trace message's arbitration id; CANOPY_TRACE_OFF when the DBC does not have the message. */
typedef struct {
    uint32_t id;
    uint8_t flags; /**< CANOPY_CAN_EXTENDED or 0. */
} canopy_trace_id_t;

#define CANOPY_TRACE_OFF UINT32_MAX

/** Periods after which a trace frame that is not out is dropped. */
#define CANOPY_TRACE_PERIODS 4u

/** Constant: made by the compiler from the DBC's messages CanopyTick, CanopyInputs and so on. */
typedef struct {
    canopy_trace_id_t tick;
    canopy_trace_id_t inputs;
    canopy_trace_id_t arrivals;
    canopy_trace_id_t change;
    canopy_trace_id_t snapshot;
    canopy_trace_id_t health;
    canopy_trace_id_t model;
    uint16_t health_every; /**< CanopyHealth in every so-many-th tick, >= 1. */
    uint16_t model_every;  /**< The same of CanopyModel. */
    uint8_t changes_max;   /**< Most CanopyChange frames in one tick, 1..127. */
    uint8_t tree;          /**< Which tree of the application, 0..15. */
} canopy_trace_config_t;

/** State of the trace of one tree. All zero is the start. */
typedef struct {
    uint8_t *sent;      /**< node_count bytes: the status code last sent of each node. */
    uint16_t next_node; /**< Where the next snapshot starts. */
    uint8_t sequence;
    uint8_t conditions; /**< The bus state, the overload, the return that CanopyArrivals told last. */
} canopy_trace_state_t;

/** What goes with a tick into the trace. */
typedef struct {
    uint32_t tick;
    canopy_status_t root;
    uint32_t overruns;
    const canopy_cycle_t
        *cycle; /**< What the tick was handed; CanopyInputs has room for a time of 2^48 us, 8.9 years. */
    const canopy_bus_state_t *bus; /**< What it has taken. */
    canopy_time_t until;           /**< When the trace frames must be out [us]. */
    bool returning;                /**< Safe values were posted instead of the tree's (canopy_loop_t.returning). */
    bool is_filtered;              /**< The driver hands over no unknown frames: there is no count of them. */
} canopy_trace_tick_t;

/**
 * Posts the trace of a tick, after canopy_tree_tick(); canopy_loop_cycle() does it. O(nodes + messages), at most
 * changes_max + 5 + (received messages + 2) / 3 frames.
 *
 * @param self moves on: what has been posted
 * @param tree ticked
 * @param tx   takes the frames
 * @param tick what it was
 */
void canopy_trace_send(const canopy_trace_config_t *config, canopy_trace_state_t *self,
                       const canopy_tree_instance_t *tree, canopy_tx_t *tx, const canopy_trace_tick_t *tick);

#endif
