/* SPDX-License-Identifier: MIT */
/**
 * @file
 * A controller with a random tree, values and bus: the runtime's engine, trace and transmit side, beside the reference
 * that says what is true. A tick gives the frames that leave in it.
 */
#ifndef CANOPY_TESTS_TRACE_CONTROLLER_H
#define CANOPY_TESTS_TRACE_CONTROLLER_H

#include "canopy/trace.h"
#include "reference.h"

enum {
    SLOTS_MAX = 32,
    MESSAGES_MAX = 24, /**< That it receives. */
    RING = 64,
    OUT_MAX = 128, /**< Frames that leave in one tick at most. */
    HISTORY = 64,  /**< Ticks of which the truth is kept. */
    AGES_MAX = 3 * MESSAGES_MAX + 4
};

#define CONTROLLER_ID 0x600u
#define CONTROLLER_PERIOD_US 10000u

/** What is true after a tick. */
typedef struct {
    uint32_t number;
    canopy_status_t root;
    uint8_t codes[NODES_MAX];
    uint64_t since[NODES_MAX]; /**< The tick since which the node has this code, counted like controller_t.ticks. */
    uint32_t values[SLOTS_MAX];
    uint64_t values_since[SLOTS_MAX];
    uint16_t changed_nodes; /**< Since the tick before. */
    uint16_t changed_slots;
    uint64_t now; /**< [us] */
    uint32_t taken;
    uint8_t check;
    bool overload, returning, many;
    uint8_t can_state;
    uint16_t age_bytes;
    uint8_t ages[AGES_MAX];
} truth_t;

/** How a controller behaves. */
typedef struct {
    uint16_t leaf_flips;  /**< How often a leaf's answer is another one, of 1000. */
    uint16_t value_flips; /**< The same of a value. */
    uint16_t bus_frames;  /**< Trace frames that the bus takes in a tick; 0: all. */
} controller_mood_t;

typedef struct {
    controller_mood_t mood;
    random_t random;
    ref_tree_t ref;
    canopy_node_t nodes[NODES_MAX];
    int32_t parameters[1];
    canopy_tree_t tree;
    canopy_tree_instance_t instance;
    uint8_t status[NODES_MAX];
    uint16_t words[NODES_MAX];
    uint8_t sent[NODES_MAX];
    canopy_trace_value_t values[SLOTS_MAX];
    struct {
        canopy_trace_kind_t kind; /* of its first slot */
        uint64_t value;
    } entries[SLOTS_MAX];
    uint16_t entry_count;
    _Alignas(8) uint8_t memory[8 * SLOTS_MAX];
    uint32_t told[SLOTS_MAX];
    canopy_trace_config_t config;
    canopy_trace_state_t state;
    canopy_rx_message_t rx_messages[MESSAGES_MAX];
    canopy_rx_state_t rx[MESSAGES_MAX];
    canopy_bus_t bus;
    canopy_bus_state_t bus_state;
    canopy_tx_trace_t ring[RING];
    canopy_can_t can;
    canopy_tx_t tx;
    uint32_t number;        /**< Of the next tick. */
    uint64_t ticks;         /**< Of all starts. */
    uint64_t first;         /**< `ticks` at the start. */
    truth_t truth[HISTORY]; /**< Place: `ticks` modulo HISTORY. */
    uint16_t room;          /**< Frames that the bus still takes in this tick. */
    canopy_can_frame_t out[OUT_MAX];
    uint16_t out_count;
} controller_t;

/** A new controller. `flat`: one ParallelAll with so many nodes; 0: a random tree. */
void controller_make(controller_t *self, uint64_t seed, const controller_mood_t *mood, uint16_t flat);

/**
 * Power-on: the next tick has this number (0 but for a test of its wrapping around). A start anew takes as long as frames
 * of the tick before may come: a receiver can be sure of it then only (Limits in docs/trace.md).
 */
void controller_start(controller_t *self, uint32_t number);

/** A tick: then `out` has the frames that have left, the last place of `truth` what is true. */
void controller_tick(controller_t *self);

/** The truth of the tick that was the `tick`-th; NULL when it is forgotten, or of another start. */
const truth_t *controller_truth(const controller_t *self, uint64_t tick);

/** Frames that the transmit side has dropped since the start. */
uint32_t controller_dropped(const controller_t *self);

#endif
