/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Plant, posture part: where the robot's head is, after Example 5 of Colledanchise & Ögren, "How Behavior Trees
 * Modularize Hybrid Control Systems…" (Eqs. 48-59). One step is 1 s of the robot's time.
 *
 * State: x1 = distance of the head from home [m], x2 = height of the head [m]. What a step does; where the condition
 * does not hold, nothing changes:
 *
 *     mode        when                x1'         x2'          in the paper
 *     SIT_UP      x2 < 0.3            x1          x2 + 0.03    Lie down to Sit up
 *     STAND_UP    0.3 <= x2 < 0.48    x1          x2 + 0.05    Sit to Stand
 *     WALK_HOME   0.48 <= x2          x1 - 0.1    x2           Walk Home
 *     STOP        never                                        (the paper has no such mode)
 *
 * Which mode is right in a state is the controller's business; the conditions only say what the body can do: a robot
 * that lies on the floor does not walk.
 *
 * The last 0.1 m step can end up to 0.1 m behind home (x1 negative), as in the paper's recursion. Only this is added:
 * x1 stops at -CANOPY_SIM_HEAD_X_LIMIT_MM. x2 needs no limit: sitting up ends below 0.33 m, standing up below 0.53 m.
 *
 * Numbers are whole millimetres and exact: every constant of the example is one. (In binary floating point 0.03 ten
 * times is not 0.3, and 0.5 - 5 * 0.1 is not 0.)
 *
 * Threads: none, no global state; the caller owns the object. Every function runs in constant time and may be used from
 * firmware.
 */
#ifndef CANOPY_SIM_POSTURE_H
#define CANOPY_SIM_POSTURE_H

#include <stdbool.h>
#include <stdint.h>

/** From this height on the robot sits [mm]: the paper's 0.3 m. */
#define CANOPY_SIM_SITTING_MM 300
/** From this height on the robot stands [mm]: the paper's 0.48 m. */
#define CANOPY_SIM_STANDING_MM 480
/** Range of x1 [mm], both ways, and of x2 [mm] from 0 on: those of the CAN signals HeadX and HeadHeight. */
#define CANOPY_SIM_HEAD_X_LIMIT_MM 10000
#define CANOPY_SIM_HEAD_HEIGHT_MAX_MM 2000

/** What the robot is told to do; the numbers are those of the CAN signal PostureCommand.Mode. */
typedef enum {
    CANOPY_SIM_POSTURE_STOP = 0,
    CANOPY_SIM_POSTURE_SIT_UP = 1,
    CANOPY_SIM_POSTURE_STAND_UP = 2,
    CANOPY_SIM_POSTURE_WALK_HOME = 3
} canopy_sim_posture_mode_t;

/** State of the posture part; its sensors show just this. Read it freely, write it through the functions below. */
typedef struct {
    int32_t head_x_mm;      /**< x1 [mm]. */
    int32_t head_height_mm; /**< x2 [mm]. */
} canopy_sim_posture_t;

/**
 * Puts the robot into a state; also the way to initialise the object.
 * @param head_x_mm      x1 [mm], -CANOPY_SIM_HEAD_X_LIMIT_MM..CANOPY_SIM_HEAD_X_LIMIT_MM
 * @param head_height_mm x2 [mm], 0..CANOPY_SIM_HEAD_HEIGHT_MAX_MM
 * @return true done; false a value is out of range, *posture is unchanged
 */
bool canopy_sim_posture_set(canopy_sim_posture_t *posture, int32_t head_x_mm, int32_t head_height_mm);

/** One step of 1 s. A mode that is none of the four does what STOP does. */
void canopy_sim_posture_step(canopy_sim_posture_t *posture, canopy_sim_posture_mode_t mode);

/** Somebody pushes the robot over: its head is on the floor (x2 = 0), where it stood. */
void canopy_sim_posture_push_over(canopy_sim_posture_t *posture);

#endif
