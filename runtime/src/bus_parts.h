/* SPDX-License-Identifier: MIT */
/** @file Inside of the bus: what bus.c and transport.c share. */
#ifndef CANOPY_BUS_PARTS_H
#define CANOPY_BUS_PARTS_H

#include "canopy/bus.h"

/** What has come of a message: a frame's data, or what several packets make together. */
typedef struct {
    canopy_time_t time; /**< When it arrived on the wire [us]. */
    const uint8_t *data;
    uint32_t id; /**< Arbitration id; of several packets the source alone. */
    uint16_t length;
} canopy_bus_content_t;

/** Takes a content of message `index` into the input image, or refuses and counts it. O(bytes). */
void canopy_bus_take(canopy_bus_state_t *self, uint16_t index, const canopy_bus_content_t *content, canopy_time_t now);

/**
 * Takes a frame that is a part of a broadcast of several packets, where there are such messages. O(number of these).
 * @return false: it is none
 */
bool canopy_transport_take(canopy_bus_state_t *self, const canopy_can_frame_t *frame, canopy_time_t now);

#endif
