/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The controller as a program on a Linux desk: the same application as in the firmware, on SocketCAN or a unixbus,
 * in real time or in lock-step with the simulator. CANOPY_APP names the application; the build sets it.
 */
#include <getopt.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "canopy/can/open.h"
#include "canopy/clock/lockstep.h"
#include "canopy/clock/posix.h"
#include "canopy/loop.h"

#define SIMULATION_STEP_ID 0x700u /* SimulationStep of nao.dbc */

enum { EXIT_USAGE = 2 };

extern const canopy_app_t CANOPY_APP;

typedef struct {
    const char *can;
    uint32_t ticks; /* 0: until a signal comes */
    bool lock_step;
    bool quiet;
} options_t;

static canopy_can_port_t port;
static canopy_posix_clock_t posix_clock;
static canopy_lockstep_t lockstep;
static canopy_loop_t loop;
static options_t options;

static void print_help(FILE *file)
{
    fprintf(file,
            "Usage: %s --can BUS [--lock-step] [--ticks N] [--quiet]\n\n"
            "Runs the controller on a CAN bus until SIGINT or SIGTERM.\n\n"
            "  --can BUS     socketcan:INTERFACE, unixbus:NAME or unixbus:/FOLDER\n"
            "  --lock-step   one tick for each step of canopy-sim --lock-step, instead of one every %" PRIu64 " ms\n"
            "  --ticks N     end after N ticks\n"
            "  --quiet       no summary at the end\n"
            "  --help        this text\n\n"
            "Examples:\n"
            "  %s --can socketcan:vcan0\n"
            "  %s --can unixbus:bus0 --lock-step --ticks 2000\n\n"
            "Exit status: 0 ended as asked, 1 the bus failed, 2 wrong command line.\n",
            CANOPY_APP.name, CANOPY_APP.period / 1000u, CANOPY_APP.name, CANOPY_APP.name);
}

static uint32_t parse_ticks(const char *text)
{
    char *end = NULL;
    unsigned long value = strtoul(text, &end, 10);

    if (text[0] < '0' || text[0] > '9' || *end != '\0' || value == 0u || value > UINT32_MAX) {
        fprintf(stderr, "%s: --ticks takes a whole number from 1 to %" PRIu32 ", not '%s'\n", CANOPY_APP.name,
                UINT32_MAX, text);
        exit(EXIT_USAGE);
    }
    return (uint32_t)value;
}

static options_t parse(int argc, char **argv)
{
    static const struct option known[] = {
        {"can", required_argument, NULL, 'c'},   {"lock-step", no_argument, NULL, 'l'},
        {"ticks", required_argument, NULL, 't'}, {"quiet", no_argument, NULL, 'q'},
        {"help", no_argument, NULL, 'h'},        {NULL, 0, NULL, 0},
    };
    options_t result = {0};
    int option;

    while ((option = getopt_long(argc, argv, "", known, NULL)) != -1) {
        switch (option) {
        case 'c':
            result.can = optarg;
            break;
        case 'l':
            result.lock_step = true;
            break;
        case 't':
            result.ticks = parse_ticks(optarg);
            break;
        case 'q':
            result.quiet = true;
            break;
        case 'h':
            print_help(stdout);
            exit(EXIT_SUCCESS);
        default:
            fprintf(stderr, "See %s --help.\n", CANOPY_APP.name);
            exit(EXIT_USAGE);
        }
    }
    if (result.can == NULL || optind != argc) {
        fprintf(stderr, "%s: %s\nSee %s --help.\n", CANOPY_APP.name,
                result.can == NULL ? "--can is missing" : "an argument too many", CANOPY_APP.name);
        exit(EXIT_USAGE);
    }
    return result;
}

static bool after_cycle(void *context, canopy_status_t root)
{
    (void)context;
    (void)root;
    return options.ticks == 0u || loop.ticks < options.ticks;
}

static void print_summary(const canopy_can_t *can)
{
    const canopy_bus_counters_t *bus = &CANOPY_APP.bus_state->counters;
    canopy_can_stats_t driver;

    can->stats(can->context, &driver);
    printf("%s: %" PRIu32 " ticks, %" PRIu32 " overruns, %" PRIu32 " slips, longest cycle %" PRIu64
           " us, most late %" PRIu64 " us\n",
           CANOPY_APP.name, loop.ticks, loop.overruns, loop.slips, loop.longest_cycle, loop.most_late);
    printf("%s: frames accepted %" PRIu32 ", refused %" PRIu32 ", unknown %" PRIu32 ", lost %" PRIu32 "; sent %" PRIu32
           ", dropped %" PRIu32 "; timeouts %" PRIu32 ", faults %" PRIu32 "\n",
           CANOPY_APP.name, bus->accepted, canopy_bus_rejected(bus), bus->unknown_id, driver.rx_dropped, bus->sent,
           bus->tx_dropped, bus->timeouts, CANOPY_APP.tree_instance->faults);
}

int main(int argc, char **argv)
{
    char message[CANOPY_CAN_OPEN_MESSAGE];
    const atomic_bool *stop = NULL;
    canopy_loop_config_t config = {.app = &CANOPY_APP, .after_cycle = after_cycle};
    canopy_error_t error;

    options = parse(argc, argv);
    if (canopy_can_open(&port, options.can, NULL, message, sizeof message) != CANOPY_OK) {
        fprintf(stderr, "%s: %s\n", CANOPY_APP.name, message);
        return EXIT_FAILURE;
    }
    if (canopy_posix_stop_on_signals(&stop) != CANOPY_OK) {
        perror(CANOPY_APP.name);
        return EXIT_FAILURE;
    }
    canopy_posix_clock_init(&posix_clock, stop);
    config.can = port.can;
    config.clock = &posix_clock.clock;
    if (options.lock_step) {
        error = canopy_lockstep_init(&lockstep, port.can, SIMULATION_STEP_ID, stop);
        if (error != CANOPY_OK) {
            fprintf(stderr, "%s: lock-step: error %d\n", CANOPY_APP.name, (int)error);
            return EXIT_FAILURE;
        }
        config.can = &lockstep.can;
        config.clock = &lockstep.clock;
    }
    error = canopy_loop_init(&loop, &config);
    if (error != CANOPY_OK) {
        fprintf(stderr, "%s: the application's tables are not complete: error %d\n", CANOPY_APP.name, (int)error);
        return EXIT_FAILURE;
    }
    canopy_loop_run(&loop);
    if (!options.quiet) {
        print_summary(config.can);
    }
    error = options.lock_step ? canopy_lockstep_error(&lockstep) : CANOPY_OK;
    if (error != CANOPY_OK) {
        fprintf(stderr, "%s: the bus %s failed: error %d\n", CANOPY_APP.name, options.can, (int)error);
    }
    canopy_can_close(&port);
    return error == CANOPY_OK ? EXIT_SUCCESS : EXIT_FAILURE;
}
