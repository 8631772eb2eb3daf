/* SPDX-License-Identifier: MIT */
/** @file What canopy_sim.mission in Python calls, in the shared library of the controller. */
#ifndef NAO_BIG_LIBRARY_WORLD_H
#define NAO_BIG_LIBRARY_WORLD_H

#include "big_world.h"

const canopy_world_t *big_library_world(void);
void big_library_begin(int profile, uint32_t seed);
canopy_sim_robot_t *big_library_robot(void);
void big_library_people(uint32_t deeds, uint32_t every);
int32_t big_library_least_battery(bool again);

#endif
