/* SPDX-License-Identifier: MIT */
/**
 * @file
 * A small application by hand for tests of the loop: one leaf, which writes WANTED where SAFE is the safe value, five
 * messages to receive and two to send, the second in every fourth tick.
 */
#ifndef CANOPY_TESTS_SMALL_APP_H
#define CANOPY_TESTS_SMALL_APP_H

#include "canopy/loop.h"

enum {
    PERIOD_US = 1000,
    FRAME_US = 220,
    RX = 5,
    RX_ID = 0x100,
    TX = 2,
    TX_ID = 0x200,
    TRACE_PLACES = 16,
    TRACE_ID = 0x600,
    RX_MAX = 4,
    TIMEOUT_US = 10000,
    SAFE = 7,
    WANTED = 42
};

static canopy_cycle_t seen; /* what the leaves see of the cycle */
static uint8_t output;
static int input;
static void (*while_ticking)(void); /* what the leaf does besides */

static canopy_status_t leaf_tick(void *application, uint16_t parameter)
{
    (void)application;
    (void)parameter;
    output = WANTED;
    if (while_ticking != NULL) {
        while_ticking();
    }
    return CANOPY_SUCCESS;
}

static bool decode(void *image, const uint8_t *data)
{
    (void)image;
    (void)data;
    return true;
}

static void set_age(void *image, bool fresh, uint16_t age_ms)
{
    (void)image;
    (void)fresh;
    (void)age_ms;
}

static void encode(const void *image, uint8_t *data)
{
    data[0] = *(const uint8_t *)image;
}

static void reset_output(void *image)
{
    *(uint8_t *)image = SAFE;
}

static void set_cycle(void *image, const canopy_cycle_t *cycle)
{
    (void)image;
    seen = *cycle;
}

#define RECEIVED(number)         \
    {.id = RX_ID + (number),     \
     .length = 1,                \
     .data_id = CANOPY_E2E_NONE, \
     .timeout = TIMEOUT_US,      \
     .decode = decode,           \
     .set_age = set_age}
static const canopy_rx_message_t rx[RX] = {RECEIVED(0), RECEIVED(1), RECEIVED(2), RECEIVED(3), RECEIVED(4)};
static const canopy_tx_message_t tx[TX] = {
    {.id = TX_ID, .length = 1, .data_id = CANOPY_E2E_NONE, .every = 1, .deadline = PERIOD_US, .encode = encode},
    {.id = TX_ID + 1,
     .length = 1,
     .data_id = CANOPY_E2E_NONE,
     .every = 4,
     .place = 2,
     .deadline = 4u * (canopy_time_t)PERIOD_US,
     .encode = encode}};
static const canopy_bus_t tables = {
    .rx = rx, .tx = tx, .rx_count = RX, .tx_count = TX, .reset_output = reset_output, .set_cycle = set_cycle};
static const canopy_node_t nodes[] = {{.type = CANOPY_NODE_SYNC_ACTION, .end = 1}};
static const canopy_leaf_t leaves[] = {{.tick = leaf_tick}};
static const canopy_tree_t tree = {.nodes = nodes, .leaves = leaves, .node_count = 1, .leaf_count = 1};
/* What a traced one has: `.trace` of the application. */
static const canopy_trace_config_t trace = {.id = TRACE_ID,
                                            .data_id = CANOPY_E2E_NONE,
                                            .changes_max = 1,
                                            .snapshot_every = 1000,
                                            .health_every = 1,
                                            .model_every = 1000};

/** The memory of one application. */
typedef struct {
    canopy_tree_instance_t instance;
    uint8_t status;
    uint8_t sent;
    canopy_bus_state_t bus_state;
    canopy_rx_state_t rx[RX];
    canopy_tx_t tx;
    canopy_tx_slot_t slots[TX];
    canopy_tx_trace_t places[TRACE_PLACES];
    uint8_t data[2 * TX];
    canopy_trace_state_t trace_state;
} small_memory_t;

static inline canopy_app_t small_app(small_memory_t *memory)
{
    while_ticking = NULL;
    return (canopy_app_t){.name = "small",
                          .period = PERIOD_US,
                          .tree = &tree,
                          .bus = &tables,
                          .rx_max = RX_MAX,
                          .frame_us = FRAME_US,
                          .tree_instance = &memory->instance,
                          .status = &memory->status,
                          .bus_state = &memory->bus_state,
                          .input = &input,
                          .output = &output,
                          .rx = memory->rx,
                          .tx = &memory->tx,
                          .tx_memory = {.slots = memory->slots,
                                        .data = memory->data,
                                        .trace = memory->places,
                                        .trace_capacity = TRACE_PLACES},
                          .trace_state = &memory->trace_state,
                          .sent = &memory->sent,
                          .nodes_max = 1};
}

#endif
