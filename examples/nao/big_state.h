/* SPDX-License-Identifier: MIT */
/** @file What leaves of the Big BT remember. */
#ifndef NAO_BIG_STATE_H
#define NAO_BIG_STATE_H

#include <stdint.h>

/** An order to the arms or the voice: the robot's answer carries the same number. */
typedef struct {
    uint8_t number;
} big_order_t;

/** A walk of a certain length. */
typedef struct {
    uint16_t start; /**< Touch.Odometer when it began, raw; it wraps around. */
} big_walk_t;

#endif
