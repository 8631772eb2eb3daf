/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The whole robot's battery and temperatures.
 *
 * In `paper` a step of 10 s is Example 4's: what Guarantee Power Supply commands, and where it commands nothing while the robot
 * does anything else, Do Other Task, for that is what the rest of the Big BT is (Example 6).
 */
#include "canopy_sim/robot.h"

#include "robot_parts.h"

enum { AMBIENT_MDEG = 25000, WARM_MDEG = 35000, BUSY_MDEG = 65000, BATTERY_BUSY_MDEG = 40000, RESPONSE_MS = 600000 };
enum { CELLS_MV = 21600 }; /* figures.h, [a] */

static void step_paper(canopy_sim_robot_t *robot, const canopy_sim_command_t *command, bool is_active)
{
    canopy_sim_power_mode_t mode = command->power;

    if (mode == CANOPY_SIM_POWER_STOP && is_active) {
        mode = CANOPY_SIM_POWER_DO_TASK;
    }
    if (mode == CANOPY_SIM_POWER_CHARGE && robot->unplugged) {
        mode = CANOPY_SIM_POWER_STOP;
    }
    if ((robot->time_ms + robot->figures->step_ms) % (uint64_t)CANOPY_SIM_POWER_STEP_MS == 0u) {
        canopy_sim_power_step(&robot->nao.power, mode);
    }
}

static void step_nao(canopy_sim_robot_t *robot, const canopy_sim_command_t *command, bool is_active)
{
    const canopy_sim_figures_t *figures = robot->figures;
    int64_t full_uj = figures->capacity_uj;
    int64_t power_mw = is_active ? -figures->active_mw : -figures->normal_mw;
    int64_t energy_uj;

    robot->nao.power.charging =
        command->power == CANOPY_SIM_POWER_CHARGE && canopy_sim_robot_is_plugged(robot) && robot->energy_uj < full_uj;
    if (robot->nao.power.charging) {
        power_mw = figures->charge_mw;
    } else if (canopy_sim_robot_is_plugged(robot) && command->power == CANOPY_SIM_POWER_CHARGE) {
        power_mw = 0; /* the mains carry it */
    }
    energy_uj = robot->energy_uj + power_mw * (int64_t)figures->step_ms;
    energy_uj = energy_uj > 0 ? energy_uj : 0;
    robot->energy_uj = energy_uj < full_uj ? energy_uj : full_uj;
    robot->nao.power.battery = (int32_t)(robot->energy_uj / (full_uj / CANOPY_SIM_BATTERY_FULL));
    robot->current_ma = (int32_t)(power_mw * 1000 / CELLS_MV);
}

/** A temperature on its way to where it would stay, within minutes; whole steps, so that it gets there. */
static int32_t approach(int32_t now_mdeg, int32_t goal_mdeg, uint32_t step_ms)
{
    int32_t way = goal_mdeg - now_mdeg;
    int32_t step = (int32_t)((int64_t)way * (int64_t)step_ms / RESPONSE_MS);

    if (step == 0 && way != 0) {
        step = way > 0 ? 1 : -1;
    }
    return now_mdeg + step;
}

/** Once a second: in between nothing that a thermometer shows would change. */
static void step_temperatures(canopy_sim_robot_t *robot, const canopy_sim_command_t *command, bool is_active)
{
    bool arms = command->arms != CANOPY_SIM_ARMS_STOP;
    bool legs = command->legs != CANOPY_SIM_LEGS_STOP || command->power == CANOPY_SIM_POWER_DRIVE_TO_CHARGER;
    const int32_t goals[CANOPY_SIM_JOINTS] = {
        [CANOPY_SIM_JOINT_HEAD] = command->track_ball ? BUSY_MDEG : WARM_MDEG,
        [CANOPY_SIM_JOINT_LEFT_ARM] = arms ? BUSY_MDEG : WARM_MDEG,
        [CANOPY_SIM_JOINT_RIGHT_ARM] = arms ? BUSY_MDEG : WARM_MDEG,
        [CANOPY_SIM_JOINT_LEFT_LEG] = legs ? BUSY_MDEG : WARM_MDEG,
        [CANOPY_SIM_JOINT_RIGHT_LEG] = legs ? BUSY_MDEG : WARM_MDEG,
    };

    if ((robot->time_ms + robot->figures->step_ms) % 1000u != 0u) {
        return;
    }
    for (unsigned joint = 0; joint < (unsigned)CANOPY_SIM_JOINTS; joint++) {
        robot->joint_mdeg[joint] = approach(robot->joint_mdeg[joint], goals[joint], 1000);
    }
    robot->battery_mdeg = approach(robot->battery_mdeg, is_active ? BATTERY_BUSY_MDEG : AMBIENT_MDEG, 1000);
}

void canopy_sim_step_energy(canopy_sim_robot_t *robot, const canopy_sim_command_t *command, bool is_active)
{
    if (robot->profile == CANOPY_SIM_PROFILE_NAO) {
        step_nao(robot, command, is_active);
    } else {
        step_paper(robot, command, is_active);
    }
    step_temperatures(robot, command, is_active);
}
