/* SPDX-License-Identifier: MIT */
/** @file Leaves of README's first program. */
#include "fan_leaves.h"

canopy_status_t is_warm_tick(const fan_input_t *in, const is_warm_ports_t *ports)
{
    return in->climate.temperature > ports->limit * 10 ? CANOPY_SUCCESS : CANOPY_FAILURE;
}

canopy_status_t run_fan_tick(const fan_input_t *in, fan_output_t *out)
{
    (void)in;
    fan_set_fan_command_speed(out, 80);
    return CANOPY_SUCCESS;
}
