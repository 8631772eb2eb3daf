/* SPDX-License-Identifier: MIT */
/** @file The robot of nao.dbc in the shared library of a controller (cmake/CanopyInProcess.cmake), for Python. */
#include "library_world.h"

static nao_world_t nao;

const canopy_world_t *nao_library_world(void)
{
    return nao_world_init(&nao);
}

canopy_sim_nao_t *nao_library_robot(void)
{
    return &nao.robot;
}

int32_t nao_library_least_battery(bool again)
{
    int32_t least = nao.least_battery;

    if (again) {
        nao.least_battery = nao.robot.power.battery;
    }
    return least;
}
