/* SPDX-License-Identifier: MIT */
/**
 * @file
 * record_double SCENARIO LOG: runs nao_home on the double and writes all that was on the wire into LOG, as candump does.
 * tests/integration/test_replay_double.py replays it. Prints what became of commands, and the oldest age that a leaf saw.
 */
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "nao_home_app.h"
#include "rig.h"
#include "unity.h"

enum { LENGTH_S = 20 };

/** What happens to the controller now and then. */
typedef enum { NOTHING, CABLE_OUT, CANNOT_DRIVE } fault_kind_t;

typedef struct {
    const char *name;
    rig_options_t options;
    fault_kind_t fault;
    unsigned first_ms; /* of the faults */
    unsigned length_ms;
    unsigned pause_ms; /* between them */
} scenario_t;

static const controller_config_t deep = {
    .mailboxes = 3, .keeps_at_bus_off = true, .depth = 16, .stamp_bits = 16, .stamp_ns = 2000, .latency_ns = 3000};

static const scenario_t scenarios[] = {
    {.name = "calm"},
    {.name = "fifos", .options = {.controller = &deep, .fifos = 2, .polled = true, .peer_period = 10 * NS_PER_MS}},
    {.name = "backlog", .options = {.rx_max = 2, .peer_period = 47 * NS_PER_MS}},
    {.name = "loaded",
     .options = {.mailboxes = 1, .cannot_abort = true, .traffic = {.per_mille = 850, .burst = 40, .highest_id = 0xFF}}},
    {.name = "bursts", /* of 32 ms */
     .options = {.mailboxes = 1,
                 .cannot_abort = true,
                 .traffic = {.per_mille = 900, .burst = 120, .highest_id = 0xFF}}},
    {.name = "overloaded",
     .options = {.mailboxes = 1,
                 .cannot_abort = true,
                 .traffic = {.per_mille = 985, .burst = 120, .highest_id = 0xFF}}},
    {.name = "replaced", .fault = CABLE_OUT, .first_ms = 390, .length_ms = 70, .pause_ms = 430},
    {.name = "one_mailbox",
     .options = {.mailboxes = 1},
     .fault = CABLE_OUT,
     .first_ms = 390,
     .length_ms = 70,
     .pause_ms = 430},
    {.name = "no_abort",
     .options = {.mailboxes = 1, .cannot_abort = true},
     .fault = CABLE_OUT,
     .first_ms = 390,
     .length_ms = 70,
     .pause_ms = 430},
    {.name = "socket", .options = {.queue = 10}, .fault = CABLE_OUT, .first_ms = 390, .length_ms = 70, .pause_ms = 430},
    {.name = "blocked", .fault = CABLE_OUT, .first_ms = 390, .length_ms = 200, .pause_ms = 800}, /* for four ticks */
    {.name = "bus_off", .fault = CANNOT_DRIVE, .first_ms = 499, .length_ms = 10, .pause_ms = 1990},
    {.name = "long_block", .fault = CABLE_OUT, .first_ms = 5000, .length_ms = 1000, .pause_ms = 5000},
};

static rig_t rig;
static FILE *output;
static const scenario_t *scenario;
static actor_t actor;
static bool is_faulty;
static uint32_t oldest_ms;

void setUp(void)
{
}

void tearDown(void)
{
}

static void write_frame(void *context, const canopy_can_frame_t *frame, const controller_t *from, nanoseconds_t start,
                        nanoseconds_t end)
{
    (void)context;
    (void)from;
    (void)start;
    (void)fprintf(output, "(%" PRIu64 ".%06" PRIu64 ") can0 %03" PRIX32 "#", end / NS_PER_S, end % NS_PER_S / NS_PER_US,
                  frame->id);
    for (uint8_t byte = 0; byte < frame->length; byte++) {
        (void)fprintf(output, "%02X", frame->data[byte]);
    }
    (void)fputs("\n", output);
}

static void change(void *context)
{
    (void)context;
    is_faulty = !is_faulty;
    actor.due = rig.world.now + (is_faulty ? scenario->length_ms : scenario->pause_ms) * NS_PER_MS;
    if (scenario->fault == CANNOT_DRIVE) {
        rig.controller->cannot_drive = is_faulty;
    } else if (is_faulty) {
        rig_unplug(&rig);
    } else {
        rig_plug(&rig);
    }
}

static void after(rig_t *self)
{
    uint16_t age = nao_home_input->posture.age_ms;

    (void)self;
    oldest_ms = nao_home_input->posture.fresh && age > oldest_ms ? age : oldest_ms;
}

int main(int argc, char **argv)
{
    rig_options_t options;
    canopy_tx_counters_t counters;
    canopy_error_t error;

    for (unsigned index = 0; argc == 3 && index < sizeof scenarios / sizeof scenarios[0]; index++) {
        scenario = strcmp(argv[1], scenarios[index].name) == 0 ? &scenarios[index] : scenario;
    }
    output = scenario != NULL ? fopen(argv[2], "w") : NULL;
    if (output == NULL) {
        (void)fputs("usage: record_double SCENARIO LOG\n", stderr);
        return 2;
    }
    options = scenario->options;
    options.app = &nao_home_app;
    rig_init(&rig, &options);
    wire_set_watch(&rig.wire, write_frame, NULL);
    rig.after = after;
    if (scenario->fault != NOTHING) {
        world_at(&rig.world, &actor, rig.world.now + scenario->first_ms * NS_PER_MS, change, NULL);
    }
    error = rig_run(&rig, rig.world.now + LENGTH_S * NS_PER_S);
    counters = rig_counters(&rig);
    printf("%s: %" PRIu32 " ticks; sent %" PRIu32 ", replaced %" PRIu32 ", expired %" PRIu32 ", trace dropped %" PRIu32
           "; oldest %" PRIu32 " ms, backlogs %" PRIu32 ", bus-offs %" PRIu32 ", stop %d\n",
           scenario->name, rig.loop.ticks, counters.sent, counters.replaced, counters.expired, counters.trace_dropped,
           oldest_ms, rig.loop.rx_backlogs, rig.controller->bus_offs, (int)error);
    return fclose(output) == 0 ? 0 : 1;
}
