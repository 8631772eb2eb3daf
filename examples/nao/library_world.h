/* SPDX-License-Identifier: MIT */
/** @file What canopy_sim.small_mission in Python calls, in the shared library of the controller. */
#ifndef NAO_LIBRARY_WORLD_H
#define NAO_LIBRARY_WORLD_H

#include "in_process.h"

const canopy_world_t *nao_library_world(void);
canopy_sim_nao_t *nao_library_robot(void);
int32_t nao_library_least_battery(bool again);

#endif
