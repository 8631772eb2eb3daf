/* SPDX-License-Identifier: MIT */
/** @file Leaves of the application "floating". */
#include "floating_leaves.h"

canopy_status_t measure_tick(const floating_input_t *in, const measure_ports_t *ports)
{
    (void)in;
    measure_set_bar(ports, ports->pressure / 100000.0 + (double)ports->water + ports->whole);
    return CANOPY_SUCCESS;
}
