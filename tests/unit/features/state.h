/* SPDX-License-Identifier: MIT */
/** @file State types of the leaves of the application "features". */
#ifndef FEATURES_STATE_H
#define FEATURES_STATE_H

#include <stdint.h>

/** Of CoolDown: how often it was started and halted, and how long it has been running. */
typedef struct {
    uint16_t starts;
    uint16_t halts;
    uint16_t ticks;
} cool_down_state_t;

#endif
