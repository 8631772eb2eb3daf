/* SPDX-License-Identifier: MIT */
/** @file Leaves of the driver, 10 ms: go where the navigator says. The navigator has leaves of the same names. */
#include "driver_leaves.h"

canopy_status_t is_safe_tick(const driver_input_t *in)
{
    return in->wheels.bumper ? CANOPY_FAILURE : CANOPY_SUCCESS;
}

canopy_status_t go_tick(const driver_input_t *in, driver_output_t *out)
{
    driver_set_drive_target(out, in->goal.target);
    driver_set_lamp_on(out, true);
    return CANOPY_SUCCESS;
}
