/* SPDX-License-Identifier: MIT */
/** @file Leaves of the navigator, 40 ms: sets the goal, and tells what it sees of the driver. */
#include "navigator_leaves.h"

enum { GOAL = 42, NOTHING_SEEN = 255 };

canopy_status_t is_safe_tick(const navigator_input_t *in)
{
    return in->wheels.speed < NAVIGATOR_WHEELS_SPEED(5.0) ? CANOPY_SUCCESS : CANOPY_FAILURE;
}

canopy_status_t go_tick(const navigator_input_t *in, navigator_output_t *out)
{
    navigator_set_goal_target(out, GOAL);
    navigator_set_echo_target(out, in->drive.fresh ? in->drive.target : (uint8_t)NOTHING_SEEN);
    return CANOPY_SUCCESS;
}
