/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Plant: one NAO, with the power part of Example 4 (10 s a step) and the posture part of Example 5 (1 s a step).
 *
 * The parts do not act on each other, and each has its own step, so a program may step them on their own clocks, or
 * both at once (one step of both per tick of the controller: lock-step).
 *
 * Usage:
 *
 *     static canopy_sim_nao_t nao;
 *     canopy_sim_nao_init(&nao);
 *     canopy_sim_nao_step(&nao, CANOPY_SIM_POWER_DO_TASK, CANOPY_SIM_POSTURE_SIT_UP);
 *
 * Threads: none, no global state; the caller owns the object.
 */
#ifndef CANOPY_SIM_NAO_H
#define CANOPY_SIM_NAO_H

#include "canopy_sim/posture.h"
#include "canopy_sim/power.h"

/** Length of a step in the robot's time [ms]. */
#define CANOPY_SIM_POWER_STEP_MS 10000
#define CANOPY_SIM_POSTURE_STEP_MS 1000

/** State of the robot. */
typedef struct {
    canopy_sim_power_t power;
    canopy_sim_posture_t posture;
} canopy_sim_nao_t;

/** Puts the robot where the paper's examples begin: power (80 m, 50 %), posture (0.5 m, 0 m). */
void canopy_sim_nao_init(canopy_sim_nao_t *nao);

/** One step of each part. */
void canopy_sim_nao_step(canopy_sim_nao_t *nao, canopy_sim_power_mode_t power, canopy_sim_posture_mode_t posture);

#endif
