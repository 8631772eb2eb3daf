/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Plant, power part (Example 4).
 */
#include "canopy_sim/power.h"

/* Do Other Task: x1' = x1 + (50 - x1) / 50. */
#define TASK_PLACE_NM (50 * CANOPY_SIM_NM_PER_M)
#define TASK_DIVISOR 50
#define DRIVE_STEP_NM CANOPY_SIM_NM_PER_M
#define MOVING_COSTS 1    /* 0.1 % */
#define CHARGING_GIVES 10 /* 1 % */

/** n / divisor, rounded to the nearest, ties away from zero; divisor even and positive. */
static int64_t divide_rounded(int64_t n, int64_t divisor)
{
    const int64_t half = divisor / 2;
    return (n < 0 ? n - half : n + half) / divisor;
}

static void use_battery(canopy_sim_power_t *power)
{
    if (power->battery >= MOVING_COSTS) {
        power->battery -= MOVING_COSTS;
    }
}

bool canopy_sim_power_set(canopy_sim_power_t *power, int64_t distance_nm, int32_t battery)
{
    if (distance_nm < CANOPY_SIM_DISTANCE_MIN_NM || distance_nm > CANOPY_SIM_DISTANCE_MAX_NM) {
        return false;
    }
    if (battery < 0 || battery > CANOPY_SIM_BATTERY_MAX) {
        return false;
    }
    power->distance_nm = distance_nm;
    power->battery = battery;
    power->charging = false;
    return true;
}

void canopy_sim_power_step(canopy_sim_power_t *power, canopy_sim_power_mode_t mode)
{
    power->charging = false;
    switch (mode) {
    case CANOPY_SIM_POWER_DO_TASK:
        power->distance_nm += divide_rounded(TASK_PLACE_NM - power->distance_nm, TASK_DIVISOR);
        use_battery(power);
        break;
    case CANOPY_SIM_POWER_DRIVE_TO_CHARGER:
        power->distance_nm -= DRIVE_STEP_NM;
        if (power->distance_nm < CANOPY_SIM_DISTANCE_MIN_NM) {
            power->distance_nm = CANOPY_SIM_DISTANCE_MIN_NM;
        }
        use_battery(power);
        break;
    case CANOPY_SIM_POWER_CHARGE:
        if (power->distance_nm < CANOPY_SIM_CHARGER_REACH_NM && power->battery < CANOPY_SIM_BATTERY_FULL) {
            power->battery += CHARGING_GIVES;
            power->charging = true;
        }
        break;
    case CANOPY_SIM_POWER_STOP:
        break;
    }
}

int32_t canopy_sim_power_distance_mm(const canopy_sim_power_t *power)
{
    int64_t mm = power->distance_nm / CANOPY_SIM_NM_PER_MM;
    /* C divides towards zero; the sensor rounds down. */
    if (power->distance_nm % CANOPY_SIM_NM_PER_MM < 0) {
        mm--;
    }
    return (int32_t)mm;
}
