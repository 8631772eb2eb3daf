/* SPDX-License-Identifier: MIT */
/**
 * @file
 * What others send: traffic of a given share of the bus with a given longest burst, or at a given rate. The same from the
 * same seed.
 *
 * The share and the burst are a bound, and are used up: in any time t the traffic asks for at most `burst` frames of the
 * longest kind plus `share` * t of the bus. It saves up for a random part of the burst, and lets go of it at once.
 */
#ifndef CANOPY_TESTS_TRAFFIC_H
#define CANOPY_TESTS_TRAFFIC_H

#include <stdint.h>

#include "controller.h"
#include "wire.h"

enum { TRAFFIC_BACKLOG = 4096 };

typedef struct {
    uint32_t seed;       /**< Not 0. */
    uint32_t per_mille;  /**< Share of the bus. */
    uint32_t burst;      /**< Frames, at most, that come at once; >= 1. */
    uint32_t per_second; /**< Instead of share and burst: so many frames, evenly. */
    uint32_t lowest_id;
    uint32_t highest_id; /**< 11 bits. */
    bool mixed;          /**< Half of them have an id of 0x700 or more instead: the least urgent ones. */
    uint8_t shortest;    /**< Bytes of data; up to 8. */
} traffic_config_t;

typedef struct {
    traffic_config_t config;
    controller_t controller;
    actor_t actor;
    uint32_t random;
    uint64_t saved_ns; /* of the bus, times 1000 */
    nanoseconds_t saved_at;
    canopy_can_frame_t backlog[TRAFFIC_BACKLOG];
    uint32_t first;
    uint32_t waiting;
    uint32_t lost; /* no room in the backlog: asked for more than the bus can carry */
} traffic_t;

/** Frames of the longest kind: 8 bytes, 11-bit id, most stuff bits, intermission included (Davis et al., 2007). */
#define TRAFFIC_FRAME_BITS 135u

/** Starts traffic on a wire; a share and a rate of 0 are none. */
void traffic_init(traffic_t *self, wire_t *wire, const traffic_config_t *config);

#endif
