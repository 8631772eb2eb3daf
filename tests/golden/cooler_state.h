/* SPDX-License-Identifier: MIT */
/** @file What a leaf of the golden application "cooler" remembers. */
#ifndef COOLER_STATE_H
#define COOLER_STATE_H

#include <stdint.h>

typedef struct {
    uint32_t beeps;
} beep_state_t;

#endif
