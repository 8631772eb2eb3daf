/* SPDX-License-Identifier: MIT */
/**
 * @file
 * What a monitor sees of each tick, in few CAN frames. docs/trace.md has the layout bit by bit, and what it means.
 *
 * After the commands of each tick: CanopyTick (also the controller's heartbeat), CanopyInputs and CanopyArrivals (what the
 * tick worked with, so that a log of the bus can be replayed), then the nodes and values that have changed; at slow rates
 * snapshots, counters, and which tree this is. Changes that do not fit come with the following ticks, which go on where
 * this one stopped; the receiver is told that some wait.
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

/** Version of the format: in each CanopyTick and CanopyModel. */
#define CANOPY_TRACE_VERSION 2u

/** The messages: their arbitration ids are the first one's plus these. */
typedef enum {
    CANOPY_TRACE_TICK,
    CANOPY_TRACE_INPUTS,
    CANOPY_TRACE_ARRIVALS,
    CANOPY_TRACE_SNAPSHOT,
    CANOPY_TRACE_CHANGE,
    CANOPY_TRACE_VALUE,
    CANOPY_TRACE_HEALTH,
    CANOPY_TRACE_MODEL,
    CANOPY_TRACE_MESSAGES
} canopy_trace_message_t;

/** Periods after which a trace frame that is not out is dropped. */
#define CANOPY_TRACE_PERIODS 4u

/** Most CanopyChange frames of a tick. */
#define CANOPY_TRACE_CHANGES_MAX 32u

/** Most CanopyValue frames of a tick. */
#define CANOPY_TRACE_VALUES_MAX 7u

/** What a traced value is in C. */
typedef enum {
    CANOPY_TRACE_WORD, /**< int32_t or uint32_t. */
    CANOPY_TRACE_U8,   /**< Or bool. */
    CANOPY_TRACE_I8,
    CANOPY_TRACE_U16,
    CANOPY_TRACE_I16,
    CANOPY_TRACE_LOW, /**< Lower half of an int64_t or uint64_t. */
    CANOPY_TRACE_HIGH,
    CANOPY_TRACE_FLOAT,
    CANOPY_TRACE_DOUBLE_LOW,
    CANOPY_TRACE_DOUBLE_HIGH
} canopy_trace_kind_t;

/** Where a traced value of up to 32 bits lies: an entry, a leaf's reason, or half of an entry of 64 bits. Constant. */
typedef struct {
    uint32_t offset; /**< In the application's memory [bytes]. */
    uint8_t kind;    /**< canopy_trace_kind_t. */
} canopy_trace_value_t;

/** Constant: made by the compiler from `--trace`. */
typedef struct {
    uint32_t id;             /**< Arbitration id of CanopyTick. */
    uint8_t flags;           /**< CANOPY_CAN_EXTENDED or 0. */
    uint8_t changes_max;     /**< Most CanopyChange frames in one tick, 1..CANOPY_TRACE_CHANGES_MAX. */
    uint8_t values_max;      /**< Most CanopyValue frames in one tick, 0..CANOPY_TRACE_VALUES_MAX; 0: without values. */
    int32_t data_id;         /**< CanopyTick's E2E data id, or CANOPY_E2E_NONE. */
    uint16_t snapshot_every; /**< CanopySnapshot in every so-many-th tick, >= 1. */
    uint16_t values_every;   /**< The same of a value that has not changed. */
    uint16_t health_every;   /**< The same of a page of CanopyHealth. */
    uint16_t model_every;    /**< The same of CanopyModel. */
    uint16_t value_count;    /**< 0..4096. */
    const canopy_trace_value_t *values; /**< value_count. */
} canopy_trace_config_t;

/** State of the trace of one tree: see canopy_trace_start(). */
typedef struct {
    uint8_t *sent;       /**< node_count: the status told last of each node, as canopy_tree_instance_t.status has it. */
    uint32_t *told;      /**< value_count: the values told last. */
    uint32_t taken;      /**< canopy_bus_state_t.taken after the tick before. */
    uint32_t upper;      /**< Bits 24 to 47 of the time of the tick before. */
    uint16_t next_node;  /**< Where the search for changed nodes begins. */
    uint16_t next_shown; /**< Where the next snapshot begins. */
    uint16_t next_value; /**< Where the search for changed values begins. */
    uint16_t next_refresh; /**< The value that is told next though it has not changed. */
    uint16_t snapshot_in;  /**< Ticks until the next snapshot, and so on. */
    uint16_t value_in;
    uint16_t health_in;
    uint16_t model_in;
    uint8_t health_page;
    uint8_t announcements; /**< Ticks that tell which tree it is though it is not due. */
    uint8_t sequence;
    uint8_t counter; /**< E2E. */
    bool has_begun;
} canopy_trace_state_t;

/** What goes with a tick into the trace. */
typedef struct {
    uint32_t tick;
    canopy_status_t root;
    uint32_t overruns;
    const canopy_cycle_t *cycle;   /**< What the tick was handed. */
    const canopy_bus_state_t *bus; /**< What it has taken. */
    canopy_time_t until;           /**< When the trace frames must be out [us]. */
    bool returning;                /**< Safe values were posted instead of the tree's (canopy_loop_t.returning). */
} canopy_trace_tick_t;

/**
 * Posts the trace of a tick, after canopy_tree_tick(), and marks every node's status as old; canopy_loop_cycle() does it.
 * O(nodes + messages + values). At most changes_max + values_max + 5 + (3 * received messages + 8) / 7 frames, and one of
 * CanopyHealth by the loop.
 *
 * @param self moves on: what has been posted
 * @param tree ticked
 * @param tx   takes the frames
 * @param tick what it was
 */
void canopy_trace_send(const canopy_trace_config_t *config, canopy_trace_state_t *self, canopy_tree_instance_t *tree,
                       canopy_tx_t *tx, const canopy_trace_tick_t *tick);

/** The start: nothing is told yet. `sent` and `told` are set; `nodes`: of the largest tree that will run. O(nodes + values). */
void canopy_trace_start(const canopy_trace_config_t *config, canopy_trace_state_t *self, uint16_t nodes);

/** Another tree runs from now on: tells at once which, and begins with its first nodes. What was told stays true. O(1). */
void canopy_trace_follow_exchange(canopy_trace_state_t *self);

#endif
