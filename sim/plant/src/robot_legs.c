/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The whole robot's legs: postures and walking. In `paper` a step is Example 5's, and sitting and lying down are its way back
 * (fig34.plant.toml); in `nao` a change of posture takes its time, cannot be interrupted but by a push, and may fail.
 */
#include "canopy_sim/robot.h"

#include "robot_parts.h"

enum { SIT_DOWN_STEP_MM = 50, LIE_DOWN_STEP_MM = 30, PER_CENT = 100, MARGIN_MM = 10 };

bool canopy_sim_stands(const canopy_sim_robot_t *robot)
{
    return robot->nao.posture.head_height_mm >= CANOPY_SIM_STANDING_MM;
}

void canopy_sim_fall(canopy_sim_robot_t *robot)
{
    bool on_back = canopy_sim_random_below(robot, 2) == 0u;

    robot->pose = on_back ? CANOPY_SIM_IS_ON_BACK : CANOPY_SIM_IS_ON_BELLY;
    robot->transition_ms = 0;
    robot->falls++;
    robot->nao.posture.head_height_mm = robot->profile == CANOPY_SIM_PROFILE_NAO ? robot->figures->lie_mm : 0;
    canopy_sim_robot_drop_ball(robot);
}

/** Walks one step; forwards, backwards, or towards the charger, which the odometer does not tell apart. */
static void walk(canopy_sim_robot_t *robot, int32_t charger_um)
{
    int64_t distance_nm = robot->nao.power.distance_nm + (int64_t)charger_um * NM_PER_UM;

    robot->odometer_um += robot->figures->walk_um;
    if (charger_um != 0 && distance_nm >= CANOPY_SIM_DISTANCE_MIN_NM && distance_nm <= CANOPY_SIM_DISTANCE_MAX_NM) {
        robot->nao.power.distance_nm = distance_nm;
    }
}

/** @return true: the robot has walked. */
static bool step_walk(canopy_sim_robot_t *robot, const canopy_sim_command_t *command)
{
    int32_t step_um = robot->figures->walk_um;
    bool is_nao = robot->profile == CANOPY_SIM_PROFILE_NAO;

    if (!canopy_sim_stands(robot) || robot->transition_ms != 0u) {
        return false;
    }
    if (command->legs == CANOPY_SIM_LEGS_BACK_OFF) {
        walk(robot, step_um);
        return true;
    }
    if (command->legs == CANOPY_SIM_LEGS_APPROACH_BALL && robot->tracked && robot->hand == CANOPY_SIM_HAND_EMPTY) {
        robot->ball_um = robot->ball_um > step_um ? robot->ball_um - step_um : 0;
        walk(robot, 0);
        return true;
    }
    if (is_nao && command->legs == CANOPY_SIM_LEGS_WALK_HOME) {
        walk(robot, 0);
        if (robot->nao.posture.head_x_mm > 0 &&
            robot->odometer_um / UM_PER_MM != (robot->odometer_um - step_um) / UM_PER_MM) {
            robot->nao.posture.head_x_mm--;
        }
        return true;
    }
    if (is_nao && command->power == CANOPY_SIM_POWER_DRIVE_TO_CHARGER) {
        walk(robot, -step_um);
        return true;
    }
    return false;
}

/* --- paper ----------------------------------------------------------------------------------------------------------- */

static void step_paper(canopy_sim_robot_t *robot, canopy_sim_legs_t legs)
{
    canopy_sim_posture_t *posture = &robot->nao.posture;

    if (legs == CANOPY_SIM_LEGS_SIT_DOWN) {
        if (canopy_sim_stands(robot)) {
            posture->head_height_mm -= SIT_DOWN_STEP_MM;
        }
    } else if (legs == CANOPY_SIM_LEGS_LIE_DOWN) {
        if (!canopy_sim_stands(robot)) {
            posture->head_height_mm -= LIE_DOWN_STEP_MM;
            posture->head_height_mm = posture->head_height_mm > 0 ? posture->head_height_mm : 0;
        }
    } else if ((unsigned)legs <= (unsigned)CANOPY_SIM_POSTURE_WALK_HOME) {
        canopy_sim_posture_step(posture, (canopy_sim_posture_mode_t)legs);
    }
    if (posture->head_height_mm >= CANOPY_SIM_STANDING_MM) {
        robot->pose = CANOPY_SIM_IS_STANDING;
    } else if (posture->head_height_mm >= CANOPY_SIM_SITTING_MM) {
        robot->pose = CANOPY_SIM_IS_SITTING;
    } else if (robot->pose != CANOPY_SIM_IS_ON_BELLY) {
        robot->pose = CANOPY_SIM_IS_ON_BACK;
    }
}

/* --- nao ------------------------------------------------------------------------------------------------------------- */

static int32_t height_of(const canopy_sim_robot_t *robot, canopy_sim_pose_t pose)
{
    const canopy_sim_figures_t *figures = robot->figures;

    if (pose == CANOPY_SIM_IS_STANDING) {
        return figures->stand_mm;
    }
    return pose == CANOPY_SIM_IS_SITTING ? figures->sit_mm : figures->lie_mm;
}

/**
 * Height of the head on the way: a posture is not shown before it is reached, so going up it stays below the threshold of the
 * next one, and going down above that of this one.
 */
static int32_t height_on_the_way(const canopy_sim_robot_t *robot)
{
    int32_t from = height_of(robot, robot->from_pose);
    int32_t to = height_of(robot, robot->next_pose);
    bool is_up = to > from;
    bool at_standing = robot->from_pose == CANOPY_SIM_IS_STANDING || robot->next_pose == CANOPY_SIM_IS_STANDING;
    int32_t threshold = at_standing ? CANOPY_SIM_STANDING_MM : CANOPY_SIM_SITTING_MM;
    int32_t limit = is_up ? threshold - MARGIN_MM : threshold;
    int32_t all = (int32_t)robot->transition_all_ms;

    return from + (limit - from) * (all - (int32_t)robot->transition_ms) / all;
}

static void begin(canopy_sim_robot_t *robot, canopy_sim_pose_t next, uint32_t ms)
{
    robot->from_pose = robot->pose;
    robot->next_pose = next;
    robot->pose = CANOPY_SIM_IS_MOVING;
    robot->transition_ms = ms;
    robot->transition_all_ms = ms;
}

/** It has arrived; or, on the way up, not: then it is where it began, and who wanted to stand may lie. */
static void arrive(canopy_sim_robot_t *robot)
{
    bool is_up = height_of(robot, robot->next_pose) > height_of(robot, robot->from_pose);

    if (is_up && canopy_sim_random_below(robot, PER_CENT) < robot->figures->fall_percent) {
        if (robot->next_pose == CANOPY_SIM_IS_STANDING) {
            canopy_sim_fall(robot);
            return;
        }
        robot->pose = robot->from_pose;
    } else {
        robot->pose = robot->next_pose;
    }
    robot->nao.posture.head_height_mm = height_of(robot, robot->pose);
}

static bool lies(const canopy_sim_robot_t *robot)
{
    return robot->pose == CANOPY_SIM_IS_ON_BACK || robot->pose == CANOPY_SIM_IS_ON_BELLY;
}

static void step_nao(canopy_sim_robot_t *robot, canopy_sim_legs_t legs)
{
    const canopy_sim_figures_t *figures = robot->figures;

    if (robot->transition_ms != 0u) {
        robot->transition_ms = robot->transition_ms > figures->step_ms ? robot->transition_ms - figures->step_ms : 0u;
        if (robot->transition_ms == 0u) {
            arrive(robot);
        } else {
            robot->nao.posture.head_height_mm = height_on_the_way(robot);
        }
    } else if (legs == CANOPY_SIM_LEGS_SIT_UP && lies(robot)) {
        begin(robot, CANOPY_SIM_IS_SITTING, figures->sit_up_ms);
    } else if (legs == CANOPY_SIM_LEGS_STAND_UP && robot->pose == CANOPY_SIM_IS_SITTING) {
        uint32_t spread = figures->stand_up_most_ms - figures->stand_up_least_ms;

        begin(robot, CANOPY_SIM_IS_STANDING, figures->stand_up_least_ms + canopy_sim_random_below(robot, spread + 1u));
    } else if (legs == CANOPY_SIM_LEGS_SIT_DOWN && robot->pose == CANOPY_SIM_IS_STANDING) {
        begin(robot, CANOPY_SIM_IS_SITTING, figures->sit_down_ms);
    } else if (legs == CANOPY_SIM_LEGS_LIE_DOWN && robot->pose == CANOPY_SIM_IS_SITTING) {
        begin(robot, CANOPY_SIM_IS_ON_BACK, figures->lie_down_ms);
    }
}

bool canopy_sim_step_legs(canopy_sim_robot_t *robot, const canopy_sim_command_t *command)
{
    bool has_walked = step_walk(robot, command);

    if (robot->profile == CANOPY_SIM_PROFILE_NAO) {
        step_nao(robot, command->legs);
        return has_walked || robot->transition_ms != 0u;
    }
    step_paper(robot, command->legs);
    return has_walked || command->legs != CANOPY_SIM_LEGS_STOP;
}
