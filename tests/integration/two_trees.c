/* SPDX-License-Identifier: MIT */
/**
 * @file
 * two_trees BUS: the driver (10 ms) and the navigator (40 ms) of tests/unit/several in one thread of one program, each
 * with a port of its own to the bus, until SIGTERM. Prints the ticks of both.
 */
#include <inttypes.h>
#include <stdio.h>

#include "canopy/can/open.h"
#include "canopy/clock/posix.h"
#include "driver_app.h"
#include "navigator_app.h"

static canopy_can_port_t ports[2];
static canopy_posix_clock_t posix_clock;
static canopy_loop_t driver, navigator;

int main(int argc, char **argv)
{
    static canopy_loop_t *const loops[] = {&driver, &navigator};
    char message[CANOPY_CAN_OPEN_MESSAGE] = "give a bus";
    const atomic_bool *stop = NULL;
    canopy_loop_config_t driver_config = {.app = &driver_app, .clock = &posix_clock.clock};
    canopy_loop_config_t navigator_config = {.app = &navigator_app, .clock = &posix_clock.clock};

    if (argc != 2 || canopy_posix_stop_on_signals(&stop) != CANOPY_OK ||
        canopy_can_open(&ports[0], argv[1], driver_app.acceptance, message, sizeof message) != CANOPY_OK ||
        canopy_can_open(&ports[1], argv[1], navigator_app.acceptance, message, sizeof message) != CANOPY_OK) {
        fprintf(stderr, "%s\n", message);
        return 1;
    }
    canopy_posix_clock_init(&posix_clock, stop);
    driver_config.can = ports[0].can;
    navigator_config.can = ports[1].can;
    if (canopy_loop_init(&driver, &driver_config) != CANOPY_OK ||
        canopy_loop_init(&navigator, &navigator_config) != CANOPY_OK) {
        return 1;
    }
    canopy_loop_run_all(loops, 2);
    printf("driver %" PRIu32 " navigator %" PRIu32 "\n", driver.ticks, navigator.ticks);
    canopy_can_close(&ports[0]);
    canopy_can_close(&ports[1]);
    return 0;
}
