/* SPDX-License-Identifier: MIT */
/** @file The whole robot: its start, its step, and what people do to it. */
#include "canopy_sim/robot.h"

#include "robot_parts.h"

enum { AMBIENT_MDEG = 25000, WARM_MDEG = 35000, HOT_MDEG = 85000, BALL_MOST_MM = 5000, BALL_START_MM = 1500 };
enum { DROPPED_MM = 500, OBSTACLE_UM = 250000, NAO_START_M = 3, NAO_START_BATTERY = 800, ALL_TOES = 0xF };

uint32_t canopy_sim_random(canopy_sim_robot_t *robot)
{
    uint32_t value = robot->random;

    value ^= value << 13;
    value ^= value >> 17;
    value ^= value << 5;
    robot->random = value;
    return value;
}

uint32_t canopy_sim_random_below(canopy_sim_robot_t *robot, uint32_t below)
{
    return (uint32_t)(((uint64_t)canopy_sim_random(robot) * below) >> 32);
}

void canopy_sim_robot_init(canopy_sim_robot_t *robot, canopy_sim_profile_t profile, uint32_t seed)
{
    const canopy_sim_figures_t *figures = canopy_sim_figures(profile);

    *robot = (canopy_sim_robot_t){
        .figures = figures,
        .profile = profile,
        .random = seed != 0u ? seed : 1u,
        .battery_mdeg = AMBIENT_MDEG,
        .ball_um = BALL_START_MM * UM_PER_MM,
        .pose = CANOPY_SIM_IS_ON_BACK,
    };
    for (unsigned joint = 0; joint < (unsigned)CANOPY_SIM_JOINTS; joint++) {
        robot->joint_mdeg[joint] = WARM_MDEG;
    }
    canopy_sim_nao_init(&robot->nao);
    if (profile == CANOPY_SIM_PROFILE_NAO) {
        (void)canopy_sim_robot_set_power(robot, NAO_START_M * CANOPY_SIM_NM_PER_M, NAO_START_BATTERY);
        (void)canopy_sim_robot_set_posture(robot, robot->nao.posture.head_x_mm, figures->stand_mm);
    }
}

/** What is pressed is let go: after its time, or when the robot has backed off. */
static void step_touch(canopy_sim_robot_t *robot)
{
    uint32_t step_ms = robot->figures->step_ms;

    robot->chest_button = false;
    if (robot->press_ms > 0u) {
        robot->press_ms = robot->press_ms > step_ms ? robot->press_ms - step_ms : 0u;
        if (robot->press_ms == 0u) {
            robot->toes = 0;
        }
    }
    if (robot->obstacle_um != 0 && robot->odometer_um >= robot->obstacle_um) {
        robot->obstacle_um = 0;
        robot->toes = 0;
    }
}

void canopy_sim_robot_step(canopy_sim_robot_t *robot, const canopy_sim_command_t *command)
{
    bool legs = canopy_sim_step_legs(robot, command);
    bool upper = canopy_sim_step_upper(robot, command);

    canopy_sim_step_energy(robot, command, legs || upper);
    step_touch(robot);
    robot->time_ms += robot->figures->step_ms;
    robot->steps++;
}

bool canopy_sim_robot_set_power(canopy_sim_robot_t *robot, int64_t distance_nm, int32_t battery)
{
    if (!canopy_sim_power_set(&robot->nao.power, distance_nm, battery)) {
        return false;
    }
    robot->energy_uj = robot->figures->capacity_uj / CANOPY_SIM_BATTERY_FULL * battery;
    return true;
}

static canopy_sim_pose_t pose_of(int32_t head_height_mm)
{
    if (head_height_mm >= CANOPY_SIM_STANDING_MM) {
        return CANOPY_SIM_IS_STANDING;
    }
    return head_height_mm >= CANOPY_SIM_SITTING_MM ? CANOPY_SIM_IS_SITTING : CANOPY_SIM_IS_ON_BACK;
}

bool canopy_sim_robot_set_posture(canopy_sim_robot_t *robot, int32_t head_x_mm, int32_t head_height_mm)
{
    if (!canopy_sim_posture_set(&robot->nao.posture, head_x_mm, head_height_mm)) {
        return false;
    }
    robot->pose = pose_of(head_height_mm);
    robot->transition_ms = 0;
    return true;
}

bool canopy_sim_robot_set_ball(canopy_sim_robot_t *robot, int32_t distance_mm)
{
    if (distance_mm < 0 || distance_mm > BALL_MOST_MM) {
        return false;
    }
    robot->ball_um = distance_mm * UM_PER_MM;
    robot->hand = CANOPY_SIM_HAND_EMPTY;
    robot->flight_ms = 0;
    return true;
}

bool canopy_sim_robot_say(canopy_sim_robot_t *robot, canopy_sim_wish_t wish)
{
    if ((unsigned)wish == (unsigned)CANOPY_SIM_WISH_NOTHING || (unsigned)wish >= (unsigned)CANOPY_SIM_WISHES) {
        return false;
    }
    robot->wish = wish;
    robot->wishes++;
    return true;
}

void canopy_sim_robot_press_chest(canopy_sim_robot_t *robot)
{
    unsigned next = (unsigned)robot->wish + 1u;

    robot->chest_button = true;
    (void)canopy_sim_robot_say(robot,
                               next < (unsigned)CANOPY_SIM_WISHES ? (canopy_sim_wish_t)next : CANOPY_SIM_WISH_SIT);
}

void canopy_sim_robot_press_toes(canopy_sim_robot_t *robot, uint8_t toes, uint32_t ms)
{
    robot->toes = (uint8_t)(toes & (unsigned)ALL_TOES);
    robot->press_ms = ms;
    robot->obstacle_um = ms == 0u && robot->toes != 0u ? robot->odometer_um + OBSTACLE_UM : 0;
}

void canopy_sim_robot_push_over(canopy_sim_robot_t *robot)
{
    canopy_sim_fall(robot);
}

bool canopy_sim_robot_drain(canopy_sim_robot_t *robot, int32_t battery)
{
    return battery <= CANOPY_SIM_BATTERY_FULL &&
           canopy_sim_robot_set_power(robot, robot->nao.power.distance_nm, battery);
}

void canopy_sim_robot_plug(canopy_sim_robot_t *robot, bool is_plugged)
{
    robot->unplugged = !is_plugged;
}

void canopy_sim_robot_overheat(canopy_sim_robot_t *robot)
{
    robot->joint_mdeg[CANOPY_SIM_JOINT_LEFT_LEG] = HOT_MDEG;
    robot->joint_mdeg[CANOPY_SIM_JOINT_RIGHT_LEG] = HOT_MDEG;
}

void canopy_sim_robot_drop_ball(canopy_sim_robot_t *robot)
{
    if (robot->hand != CANOPY_SIM_HAND_EMPTY) {
        (void)canopy_sim_robot_set_ball(robot, DROPPED_MM);
    }
}

bool canopy_sim_robot_is_plugged(const canopy_sim_robot_t *robot)
{
    return !robot->unplugged && robot->nao.power.distance_nm < CANOPY_SIM_CHARGER_REACH_NM;
}
