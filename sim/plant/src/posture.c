/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Plant, posture part (Example 5).
 */
#include "canopy_sim/posture.h"

#define SIT_UP_STEP_MM 30
#define STAND_UP_STEP_MM 50
#define WALK_STEP_MM 100

bool canopy_sim_posture_set(canopy_sim_posture_t *posture, int32_t head_x_mm, int32_t head_height_mm)
{
    if (head_x_mm < -CANOPY_SIM_HEAD_X_LIMIT_MM || head_x_mm > CANOPY_SIM_HEAD_X_LIMIT_MM) {
        return false;
    }
    if (head_height_mm < 0 || head_height_mm > CANOPY_SIM_HEAD_HEIGHT_MAX_MM) {
        return false;
    }
    posture->head_x_mm = head_x_mm;
    posture->head_height_mm = head_height_mm;
    return true;
}

void canopy_sim_posture_step(canopy_sim_posture_t *posture, canopy_sim_posture_mode_t mode)
{
    const bool sitting = posture->head_height_mm >= CANOPY_SIM_SITTING_MM;
    const bool standing = posture->head_height_mm >= CANOPY_SIM_STANDING_MM;

    switch (mode) {
    case CANOPY_SIM_POSTURE_SIT_UP:
        if (!sitting) {
            posture->head_height_mm += SIT_UP_STEP_MM;
        }
        break;
    case CANOPY_SIM_POSTURE_STAND_UP:
        if (sitting && !standing) {
            posture->head_height_mm += STAND_UP_STEP_MM;
        }
        break;
    case CANOPY_SIM_POSTURE_WALK_HOME:
        if (standing) {
            posture->head_x_mm -= WALK_STEP_MM;
            if (posture->head_x_mm < -CANOPY_SIM_HEAD_X_LIMIT_MM) {
                posture->head_x_mm = -CANOPY_SIM_HEAD_X_LIMIT_MM;
            }
        }
        break;
    case CANOPY_SIM_POSTURE_STOP:
        break;
    }
}

void canopy_sim_posture_push_over(canopy_sim_posture_t *posture)
{
    posture->head_height_mm = 0;
}
