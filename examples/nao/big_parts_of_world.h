/* SPDX-License-Identifier: MIT */
/** @file What the files of the Big BT's world share. */
#ifndef NAO_BIG_PARTS_OF_WORLD_H
#define NAO_BIG_PARTS_OF_WORLD_H

#include "big_world.h"

/** Puts the sensors that are due in this tick, or all of them. */
void big_sense(big_world_t *self, canopy_in_process_t *host);

/** What people do in this step, if anything. */
void big_let_people_act(big_world_t *self);

#endif
