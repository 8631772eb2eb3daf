/* SPDX-License-Identifier: MIT */
/** @file Types of the application "exchange", and what its leaves have seen. */
#ifndef EXCHANGE_STATE_H
#define EXCHANGE_STATE_H

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    int32_t x;
    int32_t y;
} pose_t;

typedef enum { GEAR_OFF, GEAR_LOW } gear_t;

typedef struct {
    uint16_t ticks;
} drive_state_t;

typedef struct {
    bool was_open;
} gate_state_t;

enum { EXCHANGE_COMPARES = 8 };

/** One call of Compare, as its ports were. */
typedef struct {
    bool exact;
    int8_t small;
    uint16_t count;
    uint32_t after;
    int64_t wide;
    char label[12];
} compare_seen_t;

/** What the leaves have seen since the test cleared it. */
typedef struct {
    compare_seen_t compares[EXCHANGE_COMPARES];
    unsigned compare_count;
    unsigned notes;
    unsigned starts;
    unsigned halts;
    uint16_t speed;
    bool fast;
    gear_t gear;
    pose_t pose;
    char label[12];
    int16_t temperature;
} exchange_seen_t;

extern exchange_seen_t exchange_seen;

#endif
