/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The controller as a program on a Linux desk: the same application as in the firmware, on SocketCAN or a unixbus,
 * in real time, in lock-step with the simulator, or as the replay of a record. CANOPY_APP names the application; the build sets it.
 */
#include <getopt.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "canopy/can/open.h"
#include "canopy/clock/lockstep.h"
#include "canopy/clock/posix.h"
#include "canopy/clock/replay_files.h"
#include "canopy/loop.h"
#ifdef CANOPY_IMAGE
#include "canopy/image.h"

extern const canopy_image_app_t CANOPY_IMAGE;
enum { IMAGE_MAX = 65536 };
#endif

#define SIMULATION_STEP_ID 0x700u /* SimulationStep of nao.dbc */

enum { EXIT_USAGE = 2 };

extern const canopy_app_t CANOPY_APP;

typedef struct {
    const char *can;
    const char *replay;
    const char *sent;
    const char *image;
    uint32_t ticks; /* 0: until a signal comes */
    bool lock_step;
    bool quiet;
} options_t;

static canopy_can_port_t port;
static canopy_posix_clock_t posix_clock;
static canopy_lockstep_t lockstep;
static canopy_replay_files_t replay;
static canopy_loop_t loop;
static options_t options;

#ifdef CANOPY_IMAGE
#define IMAGE_USAGE " [--image FILE]"
#define IMAGE_HELP "  --image FILE  another tree for this program, which `canopy image build` makes\n"
#else
#define IMAGE_USAGE ""
#define IMAGE_HELP ""
#endif

static void print_help(FILE *file)
{
    fprintf(
        file,
        "Usage: %s --can BUS [--lock-step] [--ticks N] [--quiet]" IMAGE_USAGE "\n"
        "       %s --replay FILE [--sent FILE] [--quiet]" IMAGE_USAGE "\n\n"
        "Runs the controller on a CAN bus until SIGINT or SIGTERM, or replays a record of an earlier run.\n\n"
        "  --can BUS     socketcan:INTERFACE, unixbus:NAME or unixbus:/FOLDER\n"
        "  --lock-step   one tick for each step of canopy-sim --lock-step, instead of one every %" PRIu64 " ms\n"
        "  --ticks N     end after N ticks\n"
        "  --replay FILE the record of an earlier run, which `canopy replay --keep` makes of a log of the bus\n"
        "  --sent FILE   with --replay: write the frames that the controller sends to a file, for `canopy replay`\n"
        "  --quiet       no summary at the end\n" IMAGE_HELP "  --help        this text\n\n"
        "Examples:\n"
        "  %s --can socketcan:vcan0\n"
        "  %s --can unixbus:bus0 --lock-step --ticks 2000\n"
        "  gdb --args %s --replay run.replay\n\n"
        "Exit status: 0 ended as asked, the safe values are out; 1 the bus or a file failed; 2 wrong command line.\n",
        CANOPY_APP.name, CANOPY_APP.name, CANOPY_APP.period / 1000u, CANOPY_APP.name, CANOPY_APP.name, CANOPY_APP.name);
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

static void check(const options_t *given, bool more)
{
    const char *wrong = NULL;

    if (more) {
        wrong = "unexpected argument";
    } else if (given->replay == NULL && given->can == NULL) {
        wrong = "--can is missing";
    } else if (given->replay != NULL && (given->can != NULL || given->lock_step || given->ticks != 0u)) {
        wrong = "--replay takes bus, time and length from the record: leave out --can, --lock-step and --ticks";
    } else if (given->replay == NULL && given->sent != NULL) {
        wrong = "--sent goes with --replay";
    }
    if (wrong != NULL) {
        fprintf(stderr, "%s: %s\nSee %s --help.\n", CANOPY_APP.name, wrong, CANOPY_APP.name);
        exit(EXIT_USAGE);
    }
}

static options_t parse(int argc, char **argv)
{
    static const struct option known[] = {
        {"can", required_argument, NULL, 'c'},
        {"lock-step", no_argument, NULL, 'l'},
        {"ticks", required_argument, NULL, 't'},
        {"replay", required_argument, NULL, 'r'},
        {"sent", required_argument, NULL, 's'},
        {"quiet", no_argument, NULL, 'q'},
        {"help", no_argument, NULL, 'h'},
#ifdef CANOPY_IMAGE
        {"image", required_argument, NULL, 'i'},
#endif
        {NULL, 0, NULL, 0},
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
        case 'r':
            result.replay = optarg;
            break;
        case 's':
            result.sent = optarg;
            break;
        case 'q':
            result.quiet = true;
            break;
        case 'i':
            result.image = optarg;
            break;
        case 'h':
            print_help(stdout);
            exit(EXIT_SUCCESS);
        default:
            fprintf(stderr, "See %s --help.\n", CANOPY_APP.name);
            exit(EXIT_USAGE);
        }
    }
    check(&result, optind != argc);
    return result;
}

static bool after_cycle(void *context, canopy_status_t root)
{
    (void)context;
    (void)root;
    return options.ticks == 0u || loop.ticks < options.ticks;
}

/** What the driver cannot promise on this bus, and what to do about it. */
static void print_advice(void)
{
    const char *advice;

    for (unsigned number = 0; (advice = canopy_can_advice(&port, number)) != NULL; number++) {
        fprintf(stderr, "%s: %s: %s\n", CANOPY_APP.name, options.can, advice);
    }
}

/** Tells people when the bus fails and when it is back; everything else is in the summary. */
static void on_fault(void *context, canopy_fault_t fault, uint32_t detail)
{
    static const char *const states[] = {[CANOPY_CAN_ERROR_ACTIVE] = "error-active",
                                         [CANOPY_CAN_ERROR_WARNING] = "error-warning",
                                         [CANOPY_CAN_ERROR_PASSIVE] = "error-passive",
                                         [CANOPY_CAN_BLOCKED] = "blocked: no frame gets out",
                                         [CANOPY_CAN_BUS_OFF] = "bus-off",
                                         [CANOPY_CAN_DOWN] = "down",
                                         [CANOPY_CAN_GONE] = "gone"};

    static bool was_unusable;
    bool is_unusable = canopy_can_is_unusable((canopy_can_state_t)detail);

    (void)context;
    if (fault != CANOPY_FAULT_CAN_STATE || options.replay != NULL) {
        return;
    }
    fprintf(stderr, "%s: %s: the bus is %s\n", CANOPY_APP.name, options.can, states[detail]);
    if (is_unusable != was_unusable) { /* what it can promise may be something else now */
        print_advice();
    }
    was_unusable = is_unusable;
}

static void print_summary(const canopy_can_t *can)
{
    const canopy_bus_counters_t *bus = &CANOPY_APP.bus_state->counters;
    canopy_tx_counters_t tx;
    canopy_can_stats_t driver;

    canopy_tx_count(CANOPY_APP.tx, &tx);
    can->stats(can->context, &driver);
    if (options.replay != NULL) { /* its clock measures nothing */
        printf("%s: %" PRIu32 " ticks replayed\n", CANOPY_APP.name, loop.ticks);
    } else {
        printf("%s: %" PRIu32 " ticks, %" PRIu32 " overruns, %" PRIu32 " slips, longest cycle %" PRIu64
               " us, most late %" PRIu64 " us\n",
               CANOPY_APP.name, loop.ticks, loop.overruns, loop.slips, loop.longest_cycle, loop.most_late);
    }
    printf("%s: frames accepted %" PRIu32 ", refused %" PRIu32 ", unknown %" PRIu32 ", lost %" PRIu32 "; sent %" PRIu32
           ", replaced %" PRIu32 ", expired %" PRIu32 "; timeouts %" PRIu32 ", faults %" PRIu32 "\n",
           CANOPY_APP.name, bus->accepted, canopy_bus_rejected(bus), bus->unknown_id, driver.rx_dropped, tx.sent,
           tx.replaced, tx.expired, bus->timeouts, CANOPY_APP.tree_instance->faults);
}

/** A bus with the clock that goes with it, as the options say. @return false: the message says why. */
static bool open_bus(canopy_loop_config_t *config, char *message, size_t size)
{
    static const uint32_t step = SIMULATION_STEP_ID;
    static canopy_can_acceptance_t with_step = {.ids = &step, .count = 1};
    const canopy_can_acceptance_t *acceptance = CANOPY_APP.acceptance;
    const atomic_bool *stop = NULL;

    if (options.replay != NULL) {
        config->can = &replay.replay.can;
        config->clock = &replay.replay.clock;
        return canopy_replay_open(&replay, options.replay, options.sent, message, size) == CANOPY_OK;
    }
    if (options.lock_step) {
        with_step.next = acceptance;
        acceptance = &with_step;
    }
    if (canopy_can_open(&port, options.can, acceptance, message, size) != CANOPY_OK) {
        return false;
    }
    if (canopy_posix_stop_on_signals(&stop) != CANOPY_OK) {
        (void)snprintf(message, size, "signals cannot be caught");
        return false;
    }
    print_advice();
    canopy_posix_clock_init(&posix_clock, stop);
    config->can = port.can;
    config->clock = &posix_clock.clock;
    if (options.lock_step) {
        canopy_error_t error = canopy_lockstep_init(&lockstep, port.can, SIMULATION_STEP_ID, stop);

        if (error != CANOPY_OK) {
            (void)snprintf(message, size, "lock-step: error %d", (int)error);
            return false;
        }
        config->can = &lockstep.can;
        config->clock = &lockstep.clock;
    }
    return true;
}

/** @return what has gone wrong meanwhile. */
static canopy_error_t close_bus(void)
{
    canopy_error_t error = CANOPY_OK;

    if (options.replay != NULL) {
        return canopy_replay_close(&replay);
    }
    if (options.lock_step) {
        error = canopy_lockstep_error(&lockstep);
    }
    canopy_can_close(&port);
    return error;
}

#ifdef CANOPY_IMAGE
/** Lets the tree of an image begin, if one was asked for. @return false: the message says why. */
static bool run_image(char *message, size_t size)
{
    static uint8_t bytes[IMAGE_MAX];
    const canopy_clock_t *clock = loop.config->clock;
    uint16_t where = 0;
    FILE *file = options.image != NULL ? fopen(options.image, "rb") : NULL;
    size_t length;
    canopy_image_error_t error;

    if (options.image == NULL) {
        return true;
    }
    if (file == NULL) {
        (void)snprintf(message, size, "%s: cannot be read", options.image);
        return false;
    }
    length = fread(bytes, 1, sizeof bytes, file);
    (void)fclose(file);
    error = canopy_image_load(&CANOPY_IMAGE, bytes, length, &where);
    if (error != CANOPY_IMAGE_OK) {
        (void)snprintf(message, size, "%s: is not a tree image for this program: error %d at %u; build it again",
                       options.image, (int)error, (unsigned)where);
        return false;
    }
    (void)canopy_image_run(&CANOPY_IMAGE, &loop, clock->now(clock->context));
    return true;
}
#endif

int main(int argc, char **argv)
{
    char message[CANOPY_CAN_OPEN_MESSAGE > CANOPY_REPLAY_MESSAGE ? CANOPY_CAN_OPEN_MESSAGE : CANOPY_REPLAY_MESSAGE];
    canopy_loop_config_t config = {.app = &CANOPY_APP, .on_fault = on_fault, .after_cycle = after_cycle};
    canopy_error_t stopped;
    canopy_error_t error;

    options = parse(argc, argv);
    if (!open_bus(&config, message, sizeof message)) {
        fprintf(stderr, "%s: %s\n", CANOPY_APP.name, message);
        return EXIT_FAILURE;
    }
    error = canopy_loop_init(&loop, &config);
    if (error != CANOPY_OK) {
        fprintf(stderr, "%s: the application's tables are not complete: error %d\n", CANOPY_APP.name, (int)error);
        return EXIT_FAILURE;
    }
#ifdef CANOPY_IMAGE
    if (!run_image(message, sizeof message)) {
        fprintf(stderr, "%s: %s\n", CANOPY_APP.name, message);
        return EXIT_FAILURE;
    }
#endif
    stopped = canopy_loop_run(&loop);
    if (!options.quiet) {
        print_summary(config.can);
    }
    if (stopped != CANOPY_OK && options.replay == NULL) {
        fprintf(stderr, "%s: the safe values are not known to be out: the robot must stop by its own timeouts\n",
                CANOPY_APP.name);
    }
    error = close_bus();
    if (error != CANOPY_OK) {
        fprintf(stderr, "%s: %s failed: error %d\n", CANOPY_APP.name,
                options.replay != NULL ? options.replay : options.can, (int)error);
    }
    return error == CANOPY_OK && stopped == CANOPY_OK ? EXIT_SUCCESS : EXIT_FAILURE;
}
