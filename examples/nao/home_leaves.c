/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Leaves of Example 5: get home from any posture. Each reads like its definition in the paper (Colledanchise & Oegren,
 * Eqs. 48-59): S, where it succeeds; F, where it fails; elsewhere it commands the robot and is RUNNING.
 *
 * x1 is the position of the head, x2 its height. The robot moves; the leaves only say what it shall do.
 */
#include "nao_home_leaves.h"

#define STANDING NAO_HOME_POSTURE_HEAD_HEIGHT(0.48)
#define SITTING NAO_HOME_POSTURE_HEAD_HEIGHT(0.30)

/* Walk Home: S = {x1 <= 0}, F = {x1 > 0, x2 < 0.48}. */
static canopy_status_t walk_home(const nao_home_input_t *in, nao_home_output_t *out)
{
    if (in->posture.head_x <= 0) {
        return CANOPY_SUCCESS;
    }
    if (in->posture.head_height < STANDING) {
        return CANOPY_FAILURE;
    }
    nao_home_set_posture_command_mode(out, NAO_HOME_POSTURE_COMMAND_MODE_WALK_HOME);
    return CANOPY_RUNNING;
}

/* Sit to Stand: S = {x2 >= 0.48}, F = {x2 < 0.3}. */
static canopy_status_t sit_to_stand(const nao_home_input_t *in, nao_home_output_t *out)
{
    if (in->posture.head_height >= STANDING) {
        return CANOPY_SUCCESS;
    }
    if (in->posture.head_height < SITTING) {
        return CANOPY_FAILURE;
    }
    nao_home_set_posture_command_mode(out, NAO_HOME_POSTURE_COMMAND_MODE_STAND_UP);
    return CANOPY_RUNNING;
}

/* Lie down to Sit up: S = {x2 >= 0.3}; it never fails. */
static canopy_status_t lie_down_to_sit_up(const nao_home_input_t *in, nao_home_output_t *out)
{
    if (in->posture.head_height >= SITTING) {
        return CANOPY_SUCCESS;
    }
    nao_home_set_posture_command_mode(out, NAO_HOME_POSTURE_COMMAND_MODE_SIT_UP);
    return CANOPY_RUNNING;
}

/* None of them has a memory: the first tick is like any other, and Stop is the command's safe value already. */

canopy_status_t walk_home_on_start(const nao_home_input_t *in, nao_home_output_t *out)
{
    return walk_home(in, out);
}

canopy_status_t walk_home_on_running(const nao_home_input_t *in, nao_home_output_t *out)
{
    return walk_home(in, out);
}

void walk_home_on_halted(const nao_home_input_t *in, nao_home_output_t *out)
{
    (void)in;
    nao_home_set_posture_command_mode(out, NAO_HOME_POSTURE_COMMAND_MODE_STOP);
}

canopy_status_t sit_to_stand_on_start(const nao_home_input_t *in, nao_home_output_t *out)
{
    return sit_to_stand(in, out);
}

canopy_status_t sit_to_stand_on_running(const nao_home_input_t *in, nao_home_output_t *out)
{
    return sit_to_stand(in, out);
}

void sit_to_stand_on_halted(const nao_home_input_t *in, nao_home_output_t *out)
{
    (void)in;
    nao_home_set_posture_command_mode(out, NAO_HOME_POSTURE_COMMAND_MODE_STOP);
}

canopy_status_t lie_down_to_sit_up_on_start(const nao_home_input_t *in, nao_home_output_t *out)
{
    return lie_down_to_sit_up(in, out);
}

canopy_status_t lie_down_to_sit_up_on_running(const nao_home_input_t *in, nao_home_output_t *out)
{
    return lie_down_to_sit_up(in, out);
}

void lie_down_to_sit_up_on_halted(const nao_home_input_t *in, nao_home_output_t *out)
{
    (void)in;
    nao_home_set_posture_command_mode(out, NAO_HOME_POSTURE_COMMAND_MODE_STOP);
}
