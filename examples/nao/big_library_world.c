/* SPDX-License-Identifier: MIT */
/** @file The whole robot in the shared library of the Big BT (cmake/CanopyInProcess.cmake), for Python. */
#include "big_library_world.h"

static big_world_t big;

const canopy_world_t *big_library_world(void)
{
    return big_world_init(&big, CANOPY_SIM_PROFILE_NAO, 1);
}

void big_library_begin(int profile, uint32_t seed)
{
    (void)big_world_init(&big, profile == 0 ? CANOPY_SIM_PROFILE_PAPER : CANOPY_SIM_PROFILE_NAO, seed);
}

canopy_sim_robot_t *big_library_robot(void)
{
    return &big.robot;
}

void big_library_people(uint32_t deeds, uint32_t every)
{
    big.people = deeds;
    big.people_every = every;
}

int32_t big_library_least_battery(bool again)
{
    int32_t least = big.least_battery;

    if (again) {
        big.least_battery = big.robot.nao.power.battery;
    }
    return least;
}
