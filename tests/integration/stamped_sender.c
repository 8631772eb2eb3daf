/* SPDX-License-Identifier: MIT */
/**
 * @file
 * stamped_sender BUS PERIOD_MS: two messages, 0x100 and 0x101, in every period until SIGTERM, through the runtime's transmit
 * side, each with its period as the deadline. Their 8 bytes are CLOCK_MONOTONIC [ms] of the tick and the tick's number: so
 * whoever sees them on the bus knows how old they are. Prints changes of the bus's state, and the counters at the end.
 */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include "canopy/can/open.h"
#include "canopy/can_state.h"
#include "canopy/clock/posix.h"
#include "canopy/tx.h"

enum { MESSAGES = 2, LENGTH = 8, SERVICE_US = 1000 };

typedef struct {
    uint32_t ms;
    uint32_t tick;
} output_t;

static void encode(const void *image, uint8_t *data)
{
    const output_t *output = image;

    for (unsigned byte = 0; byte < 4u; byte++) {
        data[byte] = (uint8_t)((output->ms >> (8u * byte)) & 0xFFu);
        data[4u + byte] = (uint8_t)((output->tick >> (8u * byte)) & 0xFFu);
    }
}

static const canopy_tx_message_t messages[MESSAGES] = {
    {.id = 0x100, .length = LENGTH, .data_id = CANOPY_E2E_NONE, .every = 1, .place = 0, .encode = encode},
    {.id = 0x101, .length = LENGTH, .data_id = CANOPY_E2E_NONE, .every = 1, .place = 2 * LENGTH, .encode = encode},
};

static canopy_can_port_t port;
static canopy_posix_clock_t posix_clock;
static canopy_tx_t tx;
static canopy_tx_slot_t slots[MESSAGES];
static uint8_t data[2 * MESSAGES * LENGTH];
static canopy_tx_trace_t trace[1];

static void print_counters(void)
{
    canopy_tx_counters_t counters;
    canopy_can_stats_t stats;

    canopy_tx_count(&tx, &counters);
    port.can->stats(port.can->context, &stats);
    printf("sent=%" PRIu32 " replaced=%" PRIu32 " expired=%" PRIu32 " driver_sent=%" PRIu32 " driver_dropped=%" PRIu32
           "\n",
           counters.sent, counters.replaced, counters.expired, stats.sent, stats.tx_dropped);
}

static void run(canopy_time_t period)
{
    canopy_can_manager_t manager = {0};
    canopy_can_state_t before = CANOPY_CAN_ERROR_ACTIVE;
    const canopy_clock_t *clock = &posix_clock.clock;
    canopy_time_t due = clock->now(clock->context);
    output_t output = {0};
    canopy_can_frame_t frame;

    while (clock->wait_until(clock->context, due)) {
        canopy_time_t now = clock->now(clock->context);

        output.ms = (uint32_t)(now / 1000u);
        output.tick++;
        while (port.can->receive(port.can->context, &frame) == 1) {}
        if (canopy_can_manager_step(&manager, port.can, canopy_tx_is_blocked(&tx), now) != before) {
            before = manager.state;
            printf("state %d\n", (int)before);
            (void)fflush(stdout);
        }
        for (uint16_t message = 0; message < (uint16_t)MESSAGES; message++) {
            canopy_tx_post(&tx, message, &output, now + period);
        }
        canopy_tx_kick(&tx, now);
        due += period;
        while (canopy_tx_is_busy(&tx) && now + (canopy_time_t)SERVICE_US < due &&
               clock->wait_until(clock->context, now + (canopy_time_t)SERVICE_US)) {
            now = clock->now(clock->context);
            canopy_tx_service(&tx, now);
        }
    }
}

int main(int argc, char **argv)
{
    const canopy_tx_memory_t memory = {.slots = slots, .data = data, .trace = trace, .trace_capacity = 1};
    static const canopy_can_acceptance_t nothing = {0};
    char message[CANOPY_CAN_OPEN_MESSAGE] = "stamped_sender BUS PERIOD_MS";
    const atomic_bool *stop = NULL;
    const char *advice;

    if (argc != 3 || canopy_posix_stop_on_signals(&stop) != CANOPY_OK ||
        canopy_can_open(&port, argv[1], &nothing, message, sizeof message) != CANOPY_OK ||
        canopy_tx_init(&tx, messages, MESSAGES, &memory, port.can) != CANOPY_OK) {
        fprintf(stderr, "%s\n", message);
        return EXIT_FAILURE;
    }
    canopy_posix_clock_init(&posix_clock, stop);
    for (unsigned number = 0; (advice = canopy_can_advice(&port, number)) != NULL; number++) {
        printf("advice %s\n", advice);
    }
    printf("ready\n");
    (void)fflush(stdout);
    run(1000u * (canopy_time_t)strtoul(argv[2], NULL, 10));
    print_counters();
    canopy_can_close(&port);
    return EXIT_SUCCESS;
}
