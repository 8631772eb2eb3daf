/* SPDX-License-Identifier: MIT */
/** @file Leaves of six commands: one notes for the test what leaves see, the other drives while there is a reading. */
#include "six_leaves.h"

#include "six/probe.h"

six_probe_t six_probe;

canopy_status_t look_tick(const six_input_t *in, six_output_t *out)
{
    const uint32_t stamp = (uint32_t)in->now;

    six_probe.now = in->now;
    six_probe.number = in->reading.number;
    six_probe.age_ms = in->reading.age_ms;
    six_probe.fresh = in->reading.fresh;
    six_probe.can_state = in->can_state;
    six_probe.overload = in->overload;
    six_set_command1_stamp(out, (int64_t)stamp);
    six_set_command2_stamp(out, (int64_t)stamp);
    six_set_command3_stamp(out, (int64_t)stamp);
    six_set_command4_stamp(out, (int64_t)stamp);
    six_set_command5_stamp(out, (int64_t)stamp);
    six_set_command6_stamp(out, (int64_t)stamp);
    return CANOPY_SUCCESS;
}

canopy_status_t drive_tick(const six_input_t *in, six_output_t *out)
{
    (void)in;
    six_set_command1_power(out, SIX_DRIVING);
    six_set_command2_power(out, SIX_DRIVING);
    six_set_command3_power(out, SIX_DRIVING);
    six_set_command4_power(out, SIX_DRIVING);
    six_set_command5_power(out, SIX_DRIVING);
    six_set_command6_power(out, SIX_DRIVING);
    return CANOPY_SUCCESS;
}
