/* SPDX-License-Identifier: MIT */
/** @file What a leaf of the application with six commands saw in the last tick. */
#ifndef CANOPY_TESTS_SIX_PROBE_H
#define CANOPY_TESTS_SIX_PROBE_H

#include <stdbool.h>
#include <stdint.h>

#include "canopy/can_state.h"
#include "canopy/clock.h"

/** The value of a command while there is a reading; its safe value is 0. */
#define SIX_DRIVING 7

typedef struct {
    canopy_time_t now;
    uint16_t number; /* of the reading: peer.h */
    uint16_t age_ms;
    bool fresh;
    canopy_can_state_t can_state;
    bool overload;
} six_probe_t;

extern six_probe_t six_probe;

#endif
