/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Plant, power part: the robot's distance to its charger and its battery, after Example 4 of Colledanchise & Ögren,
 * "How Behavior Trees Modularize Hybrid Control Systems…" (Eqs. 39-47). One step is 10 s of the robot's time.
 *
 * State: x1 = distance to the charger [m], x2 = charge of the battery [%]. What a step does:
 *
 *     mode               when                       x1'                  x2'          in the paper
 *     DO_TASK            always                     x1 + (50 - x1)/50    x2 - 0.1     Do Other Task
 *     DRIVE_TO_CHARGER   always                     x1 - 1               x2 - 0.1     Guarantee Power Supply, driving
 *     CHARGE             x1 < 0.1 and x2 < 100      x1                   x2 + 1       Guarantee Power Supply, charging
 *     CHARGE             else                       x1                   x2           (the paper has no such case)
 *     STOP               always                     x1                   x2           (the paper has no such mode)
 *
 * Which mode is right in a state is the controller's business; the plant only obeys.
 *
 * Where the paper's recursion leaves its own state space [0, 100] x [0, 100], the plant follows the recursion:
 *  - x1 gets negative: the last 1 m step starts anywhere in [0.1, 1.1) m and ends in [-0.9, 0.1) m.
 *  - x2 gets above 100: the last 1 % step of a charge starts anywhere below 100 % and ends at up to 100.9 %.
 * Only this is added, none of it met by the paper's controller: x2 stays at 0 when the battery is empty (the robot
 * still moves), and x1 stops at CANOPY_SIM_DISTANCE_MIN_NM.
 *
 * Numbers are scaled integers, because binary floating point does not hit the thresholds: x2 counts tenths of a per
 * cent and is exact. x1 counts nanometres; only DO_TASK rounds it, to the nearest, once a step. That does not change
 * the number of ticks in any phase: a step multiplies an error by at most 49/50 and adds at most 0.5 nm, so x1 is never
 * further than 0.5 / (1 - 49/50) = 25 nm from the exact value, and x1 is compared with one number only, 0.1 m. As long
 * as no exact value that is not itself a whole number of nanometres comes within 25 nm of 0.1 m, every comparison gives
 * the same answer. tests/integration/test_plant_exact.py walks the recursion in exact fractions beside the plant and
 * checks both.
 *
 * Threads: none, no global state; the caller owns the object. Every function runs in constant time, calls nothing but
 * the compiler's 64-bit division, and may be used from firmware.
 */
#ifndef CANOPY_SIM_POWER_H
#define CANOPY_SIM_POWER_H

#include <stdbool.h>
#include <stdint.h>

#define CANOPY_SIM_NM_PER_MM INT64_C(1000000)
#define CANOPY_SIM_NM_PER_M INT64_C(1000000000)

/** The robot charges below this distance [nm]: the paper's 0.1 m. */
#define CANOPY_SIM_CHARGER_REACH_NM (CANOPY_SIM_NM_PER_M / 10)
/** Range of x1 [nm]: that of the CAN signal ChargerDistance. */
#define CANOPY_SIM_DISTANCE_MIN_NM (-10 * CANOPY_SIM_NM_PER_M)
#define CANOPY_SIM_DISTANCE_MAX_NM (200 * CANOPY_SIM_NM_PER_M)
/** A full battery [0.1 %]. */
#define CANOPY_SIM_BATTERY_FULL 1000
/** Greatest x2 [0.1 %]: that of the CAN signal Level. A charge ends at most at 1009. */
#define CANOPY_SIM_BATTERY_MAX 1100

/** What the robot is told to do; the numbers are those of the CAN signal PowerCommand.Mode. */
typedef enum {
    CANOPY_SIM_POWER_STOP = 0,
    CANOPY_SIM_POWER_DO_TASK = 1,
    CANOPY_SIM_POWER_DRIVE_TO_CHARGER = 2,
    CANOPY_SIM_POWER_CHARGE = 3
} canopy_sim_power_mode_t;

/** State of the power part. Read it freely, write it through the functions below. */
typedef struct {
    int64_t distance_nm; /**< x1 [nm]. */
    int32_t battery;     /**< x2 [0.1 %]. */
    bool charging;       /**< The last step has charged the battery. */
} canopy_sim_power_t;

/**
 * Puts the robot into a state; also the way to initialise the object.
 * @param distance_nm x1 [nm], CANOPY_SIM_DISTANCE_MIN_NM..MAX_NM
 * @param battery     x2 [0.1 %], 0..CANOPY_SIM_BATTERY_MAX
 * @return true done; false a value is out of range, *power is unchanged
 */
bool canopy_sim_power_set(canopy_sim_power_t *power, int64_t distance_nm, int32_t battery);

/** One step of 10 s. A mode that is none of the four does what STOP does. */
void canopy_sim_power_step(canopy_sim_power_t *power, canopy_sim_power_mode_t mode);

/**
 * What the distance sensor shows [mm]: x1 rounded down, for negative values too, so that "shown < 100 mm" is true
 * exactly when "x1 < 0.1 m" is.
 */
int32_t canopy_sim_power_distance_mm(const canopy_sim_power_t *power);

#endif
