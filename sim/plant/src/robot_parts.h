/* SPDX-License-Identifier: MIT */
/** @file What the parts of the whole robot share among themselves. */
#ifndef CANOPY_SIM_ROBOT_PARTS_H
#define CANOPY_SIM_ROBOT_PARTS_H

#include "canopy_sim/robot.h"

enum { UM_PER_MM = 1000, NM_PER_UM = 1000 };

/** The next random number (xorshift32), and one within 0..below-1. */
uint32_t canopy_sim_random(canopy_sim_robot_t *robot);
uint32_t canopy_sim_random_below(canopy_sim_robot_t *robot, uint32_t below);

/** Does the robot stand, so that it can walk? In both profiles a matter of the head's height. */
bool canopy_sim_stands(const canopy_sim_robot_t *robot);

/** Postures and walking. @return true: the legs have moved. */
bool canopy_sim_step_legs(canopy_sim_robot_t *robot, const canopy_sim_command_t *command);

/** Speech, arms, and the ball. @return true: something is under way. */
bool canopy_sim_step_upper(canopy_sim_robot_t *robot, const canopy_sim_command_t *command);

/** Battery and temperatures, at the end of a step. */
void canopy_sim_step_energy(canopy_sim_robot_t *robot, const canopy_sim_command_t *command, bool is_active);

/** It lies, whatever it was. */
void canopy_sim_fall(canopy_sim_robot_t *robot);

#endif
