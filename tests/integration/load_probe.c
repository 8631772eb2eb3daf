/* SPDX-License-Identifier: MIT */
/**
 * @file
 * load_probe BUS: nao_power on a bus, until SIGTERM; then what its leaves saw in each tick, a line each:
 *
 *   tick NOW LEVEL AGE_MS FRESH    times are CLOCK_MONOTONIC [us]
 *   loop MOST_LATE LONGEST_CYCLE   [us], as the loop itself has counted
 */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include "canopy/can/open.h"
#include "canopy/clock/posix.h"
#include "nao_power_app.h"

enum { TICKS_MAX = 2000 };

typedef struct {
    canopy_time_t now;
    unsigned level;
    unsigned age_ms;
    bool fresh;
} tick_t;

static canopy_can_port_t port;
static canopy_posix_clock_t posix_clock;
static canopy_loop_t loop;
static tick_t ticks[TICKS_MAX];
static unsigned tick_count;

static bool after_cycle(void *context, canopy_status_t root)
{
    const nao_power_input_t *in = nao_power_app.input;

    (void)context;
    (void)root;
    ticks[tick_count++] = (tick_t){
        .now = in->now, .level = (unsigned)in->battery.level, .age_ms = in->battery.age_ms, .fresh = in->battery.fresh};
    return tick_count < (unsigned)TICKS_MAX;
}

int main(int argc, char **argv)
{
    char message[CANOPY_CAN_OPEN_MESSAGE] = "load_probe BUS";
    const atomic_bool *stop = NULL;
    canopy_loop_config_t config = {.app = &nao_power_app, .clock = &posix_clock.clock, .after_cycle = after_cycle};

    if (argc != 2 || canopy_posix_stop_on_signals(&stop) != CANOPY_OK ||
        canopy_can_open(&port, argv[1], nao_power_app.acceptance, message, sizeof message) != CANOPY_OK) {
        fprintf(stderr, "%s\n", message);
        return EXIT_FAILURE;
    }
    canopy_posix_clock_init(&posix_clock, stop);
    config.can = port.can;
    if (canopy_loop_init(&loop, &config) != CANOPY_OK) {
        fprintf(stderr, "load_probe: nao_power cannot be set up\n");
        return EXIT_FAILURE;
    }
    printf("ready\n");
    (void)fflush(stdout);
    (void)canopy_loop_run(&loop);
    canopy_can_close(&port);
    for (unsigned tick = 0; tick < tick_count; tick++) {
        printf("tick %" PRIu64 " %u %u %d\n", ticks[tick].now, ticks[tick].level, ticks[tick].age_ms,
               (int)ticks[tick].fresh);
    }
    printf("loop %" PRIu64 " %" PRIu64 "\n", loop.most_late, loop.longest_cycle);
    return EXIT_SUCCESS;
}
