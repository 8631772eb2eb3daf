/* SPDX-License-Identifier: MIT */
/** @file Two applications for one node of the bus: must not link. */
#include "driver_again_app.h"
#include "driver_app.h"

int main(void)
{
    return driver_app.period == driver_again_app.period ? 1 : 0;
}
