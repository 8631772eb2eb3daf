/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Leaves of Example 4: work, but never run empty (Colledanchise & Oegren, Eqs. 39-47).
 *
 * x1 is the distance to the charger, x2 the charge of the battery. The robot moves; the leaves only say what it shall do.
 */
#include "nao_power_leaves.h"

#define AT_CHARGER NAO_POWER_BATTERY_CHARGER_DISTANCE(0.1)
#define FULL NAO_POWER_BATTERY_LEVEL(100.0)
#define LOW NAO_POWER_BATTERY_LEVEL(20.0)

/* Guarantee Power Supply: S1 = {x2 >= 100, or x1 >= 0.1 and x2 > 20}; else it drives to the charger, or charges there. */
static canopy_status_t guarantee_power_supply(const nao_power_input_t *in, nao_power_output_t *out)
{
    bool at_charger = in->battery.charger_distance < AT_CHARGER;

    if (in->battery.level >= FULL || (!at_charger && in->battery.level > LOW)) {
        return CANOPY_SUCCESS;
    }
    nao_power_set_power_command_mode(out, at_charger ? NAO_POWER_POWER_COMMAND_MODE_CHARGE
                                                     : NAO_POWER_POWER_COMMAND_MODE_DRIVE_TO_CHARGER);
    return CANOPY_RUNNING;
}

/* Do Other Task: always RUNNING. */
static canopy_status_t do_other_task(nao_power_output_t *out)
{
    nao_power_set_power_command_mode(out, NAO_POWER_POWER_COMMAND_MODE_DO_TASK);
    return CANOPY_RUNNING;
}

canopy_status_t guarantee_power_supply_on_start(const nao_power_input_t *in, nao_power_output_t *out)
{
    return guarantee_power_supply(in, out);
}

canopy_status_t guarantee_power_supply_on_running(const nao_power_input_t *in, nao_power_output_t *out)
{
    return guarantee_power_supply(in, out);
}

void guarantee_power_supply_on_halted(const nao_power_input_t *in, nao_power_output_t *out)
{
    (void)in;
    nao_power_set_power_command_mode(out, NAO_POWER_POWER_COMMAND_MODE_STOP);
}

canopy_status_t do_other_task_on_start(const nao_power_input_t *in, nao_power_output_t *out)
{
    (void)in;
    return do_other_task(out);
}

canopy_status_t do_other_task_on_running(const nao_power_input_t *in, nao_power_output_t *out)
{
    (void)in;
    return do_other_task(out);
}

void do_other_task_on_halted(const nao_power_input_t *in, nao_power_output_t *out)
{
    (void)in;
    nao_power_set_power_command_mode(out, NAO_POWER_POWER_COMMAND_MODE_STOP);
}
