/* SPDX-License-Identifier: MIT */
/** @file State types and port types of the application "language". */
#ifndef LANGUAGE_STATE_H
#define LANGUAGE_STATE_H

#include <stdint.h>

/** Of UseGoal: what its ports held when it was last called. */
typedef struct {
    int32_t goal;
    int16_t temperature;
    const char *label;
} use_goal_state_t;

/** A type of the user's own, for a port. */
typedef struct {
    uint8_t bytes[3];
} float_free_t;

/** Of RoundRobin: the child's place that is next. */
typedef struct {
    uint8_t next;
    uint8_t halts;
} round_robin_state_t;

/** Of Every: ticks since the child was ticked. */
typedef struct {
    uint8_t passed;
} every_state_t;

#endif
