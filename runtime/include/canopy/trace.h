/* SPDX-License-Identifier: MIT */
/**
 * @file
 * What a monitor sees of each tick, in few CAN frames (docs/trace.md has the layout bit by bit).
 *
 * After the commands of each tick: CanopyTick (tick number, the root's status; also the controller's heartbeat), then
 * CanopyChange frames with the (node, status) pairs that changed, at most `changes_max` frames, then one CanopySnapshot
 * frame with ten nodes' statuses, the next ten in the next tick, so that a monitor can join at any time. Changes that
 * did not fit are sent in the following ticks: the receiver is late then, but never wrong for good. CanopyInputs says
 * what the tick worked with, so that a log of the bus can be replayed (docs/replay.md). CanopyHealth carries the loss
 * counters at a slow rate, CanopyModel which tree this is.
 *
 * CanopyTick, CanopyChange and CanopySnapshot count up a sequence number, so that a receiver knows when it has lost one.
 *
 * Threads: the loop's thread only. Nothing blocks: a frame that the driver does not take is dropped and counted.
 */
#ifndef CANOPY_TRACE_H
#define CANOPY_TRACE_H

#include "canopy/bus.h"
#include "canopy/can.h"
#include "canopy/tree.h"

/** A trace message's arbitration id; CANOPY_TRACE_OFF when the DBC does not have the message. */
typedef struct {
    uint32_t id;
    uint8_t flags; /**< CANOPY_CAN_EXTENDED or 0. */
} canopy_trace_id_t;

#define CANOPY_TRACE_OFF UINT32_MAX

/** Constant: made by the compiler from the DBC's messages CanopyTick, CanopyInputs and so on. */
typedef struct {
    canopy_trace_id_t tick;
    canopy_trace_id_t inputs;
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
    uint32_t tx_dropped; /**< Trace frames the driver did not take. Saturates. */
} canopy_trace_state_t;

/** The numbers that go with a tick into the trace. */
typedef struct {
    uint32_t tick;
    canopy_status_t root;
    uint32_t overruns;
    canopy_time_t now; /**< What the tick was handed [us]; CanopyInputs has room for 2^48, 8.9 years. */
    uint8_t taken;     /**< canopy_bus_state_t.taken */
    uint8_t check;     /**< canopy_bus_state_t.check */
} canopy_trace_tick_t;

/**
 * Sends the trace of a tick, after canopy_tree_tick(); canopy_loop_cycle() does it. O(nodes), at most changes_max + 5 frames.
 *
 * @param self     moves on: what has been sent
 * @param tree     ticked
 * @param tick     its numbers
 * @param counters of the bus, for CanopyHealth
 */
void canopy_trace_send(const canopy_trace_config_t *config, canopy_trace_state_t *self,
                       const canopy_tree_instance_t *tree, const canopy_can_t *can, const canopy_trace_tick_t *tick,
                       const canopy_bus_counters_t *counters);

#endif
