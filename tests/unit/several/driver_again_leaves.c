/* SPDX-License-Identifier: MIT */
/** @file The driver's tree as a second application for the same node, which must not link with the first one. */
#include "driver_again_leaves.h"

canopy_status_t is_safe_tick(const driver_again_input_t *in)
{
    return in->wheels.bumper ? CANOPY_FAILURE : CANOPY_SUCCESS;
}

canopy_status_t go_tick(const driver_again_input_t *in, driver_again_output_t *out)
{
    driver_again_set_drive_target(out, in->goal.target);
    return CANOPY_SUCCESS;
}
