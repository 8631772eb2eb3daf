/* SPDX-License-Identifier: MIT */
/** @file The whole robot's upper half: what it says, what its arms do, and the ball. */
#include "canopy_sim/robot.h"

#include "robot_parts.h"

enum { PER_CENT = 100 };

/** One step of a timed act. @return true in the step in which it is done. */
static bool step_act(canopy_sim_act_t *act, uint8_t what, uint8_t number, uint32_t all_ms, uint32_t step_ms)
{
    if (what == 0u) {
        act->state = CANOPY_SIM_ACT_IDLE;
        act->what = 0;
        act->left_ms = 0;
        return false;
    }
    if (act->state == CANOPY_SIM_ACT_IDLE || act->what != what || act->number != number) {
        act->state = CANOPY_SIM_ACT_BUSY;
        act->what = what;
        act->number = number;
        act->left_ms = all_ms;
    }
    if (act->state != CANOPY_SIM_ACT_BUSY) {
        return false;
    }
    act->left_ms = act->left_ms > step_ms ? act->left_ms - step_ms : 0u;
    if (act->left_ms == 0u) {
        act->state = CANOPY_SIM_ACT_DONE;
        return true;
    }
    return false;
}

static bool can_reach_ball(const canopy_sim_robot_t *robot)
{
    return canopy_sim_stands(robot) && robot->hand == CANOPY_SIM_HAND_EMPTY &&
           robot->ball_um <= robot->figures->reach_mm * UM_PER_MM;
}

/** What an arm's act comes to when its time is over; a grasp that has failed begins again. */
static void finish_arms(canopy_sim_robot_t *robot, canopy_sim_arms_t arms)
{
    const canopy_sim_figures_t *figures = robot->figures;

    if (arms == CANOPY_SIM_ARMS_GRASP && can_reach_ball(robot)) {
        if (canopy_sim_random_below(robot, PER_CENT) < figures->grasp_percent) {
            robot->hand = CANOPY_SIM_HAND_HOLDS;
        } else {
            robot->arms.state = CANOPY_SIM_ACT_BUSY;
            robot->arms.left_ms = figures->grasp_ms;
        }
    } else if (arms == CANOPY_SIM_ARMS_THROW && robot->hand == CANOPY_SIM_HAND_HOLDS && canopy_sim_stands(robot)) {
        robot->hand = CANOPY_SIM_HAND_THREW;
        robot->flight_ms = figures->flight_ms;
    }
}

static void step_arms(canopy_sim_robot_t *robot, const canopy_sim_command_t *command)
{
    const canopy_sim_figures_t *figures = robot->figures;
    uint32_t all_ms = figures->wave_ms;

    if (command->arms == CANOPY_SIM_ARMS_GRASP) {
        all_ms = figures->grasp_ms;
    } else if (command->arms == CANOPY_SIM_ARMS_THROW) {
        all_ms = figures->throw_ms;
    }
    if (step_act(&robot->arms, (uint8_t)command->arms, command->arms_number, all_ms, figures->step_ms)) {
        finish_arms(robot, command->arms);
    }
}

static void step_ball(canopy_sim_robot_t *robot, bool is_looking)
{
    const canopy_sim_figures_t *figures = robot->figures;

    if (robot->hand == CANOPY_SIM_HAND_THREW) {
        robot->flight_ms = robot->flight_ms > figures->step_ms ? robot->flight_ms - figures->step_ms : 0u;
        if (robot->flight_ms == 0u) {
            uint32_t spread = (uint32_t)(figures->throw_most_mm - figures->throw_least_mm) + 1u;

            robot->ball_um = (figures->throw_least_mm + (int32_t)canopy_sim_random_below(robot, spread)) * UM_PER_MM;
            robot->hand = CANOPY_SIM_HAND_EMPTY;
        }
    }
    if (!is_looking || !canopy_sim_stands(robot)) {
        robot->found_ms = 0;
        robot->tracked = false;
        return;
    }
    robot->found_ms = robot->found_ms < figures->find_ms ? robot->found_ms + figures->step_ms : robot->found_ms;
    robot->tracked = robot->found_ms >= figures->find_ms;
}

bool canopy_sim_step_upper(canopy_sim_robot_t *robot, const canopy_sim_command_t *command)
{
    step_ball(robot,
              command->track_ball); /* before the arms: a ball that they throw in this step is in the air after it */
    step_arms(robot, command);
    (void)step_act(&robot->speech, (uint8_t)command->say, command->say_number, robot->figures->say_ms,
                   robot->figures->step_ms);
    return command->arms != CANOPY_SIM_ARMS_STOP || command->say != CANOPY_SIM_SAY_NOTHING || command->track_ball;
}
