/* SPDX-License-Identifier: MIT */
/** @file The courier's controller as a program: on SocketCAN, or on a unixbus. */
#include <stdio.h>
#include <stdlib.h>

#include "canopy/can/open.h"
#include "canopy/clock/posix.h"
#include "courier_app.h"

enum { EXIT_USAGE = 2 };

static canopy_can_port_t port;
static canopy_posix_clock_t posix_clock;
static canopy_loop_t loop;

int main(int argc, char **argv)
{
    char message[CANOPY_CAN_OPEN_MESSAGE];
    const atomic_bool *stop = NULL;
    const char *advice;
    canopy_error_t error;
    canopy_loop_config_t config = {.app = &courier_app, .clock = &posix_clock.clock};

    if (argc != 2) {
        fprintf(stderr, "Usage: %s BUS, for example socketcan:can0 or unixbus:bus0\n", courier_app.name);
        return EXIT_USAGE;
    }
    if (canopy_can_open(&port, argv[1], courier_app.acceptance, message, sizeof message) != CANOPY_OK) {
        fprintf(stderr, "%s: %s\n", courier_app.name, message);
        return EXIT_FAILURE;
    }
    if (canopy_posix_stop_on_signals(&stop) != CANOPY_OK) {
        perror(courier_app.name);
        return EXIT_FAILURE;
    }
    for (unsigned number = 0; (advice = canopy_can_advice(&port, number)) != NULL; number++) {
        fprintf(stderr, "%s: %s: %s\n", courier_app.name, argv[1], advice);
    }
    canopy_posix_clock_init(&posix_clock, stop);
    config.can = port.can;
    if (canopy_loop_init(&loop, &config) != CANOPY_OK) {
        fprintf(stderr, "%s: the application's tables are not complete\n", courier_app.name);
        return EXIT_FAILURE;
    }
    error = canopy_loop_run(&loop); /* until SIGINT or SIGTERM; then the robot gets its safe values */
    canopy_can_close(&port);
    if (error != CANOPY_OK) {
        fprintf(stderr, "%s: the safe values are not known to be out: the robot must stop by its own timeouts\n",
                courier_app.name);
    }
    return error == CANOPY_OK ? EXIT_SUCCESS : EXIT_FAILURE;
}
