/* SPDX-License-Identifier: MIT */
/**
 * @file
 * log_player < LOG: an application whose bus is what a candump log says. Each period of the log is one cycle; what the
 * leaves print is what they see. Ends with the counters of the bus. Compiled with -DAPP=name_app and -DAPP_H="name_app.h".
 */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "canopy/can/loopback.h"
#include "canopy/loop.h"
#include APP_H

enum { QUEUE = 4096 };

static canopy_time_t time_now;
static canopy_loopback_t bus;
static canopy_loopback_endpoint_t ours, theirs;
static canopy_can_frame_t our_queue[QUEUE], their_queue[QUEUE];
static canopy_loop_t loop;

static canopy_time_t now(void *context)
{
    (void)context;
    return time_now;
}

static const canopy_clock_t log_clock = {.now = now};

/** `(1.000000) can0 18FEF100#0102` into a frame; false: it is none. */
static bool parse(const char *line, canopy_can_frame_t *frame)
{
    double seconds;
    char id[9], data[129] = "";

    if (sscanf(line, "(%lf) %*s %8[0-9A-Fa-f]#%128s", &seconds, id, data) < 2) {
        return false;
    }
    *frame = (canopy_can_frame_t){.time = (canopy_time_t)(seconds * 1e6), .id = (uint32_t)strtoul(id, NULL, 16)};
    frame->flags = strlen(id) > 3u ? CANOPY_CAN_EXTENDED : 0u;
    for (const char *digit = data; digit[0] != '\0' && digit[1] != '\0'; digit += 2) {
        const char byte[3] = {digit[0], digit[1], '\0'};

        frame->data[frame->length++] = (uint8_t)strtoul(byte, NULL, 16);
    }
    return true;
}

int main(void)
{
    canopy_loop_config_t config = {.app = &APP, .can = &ours.can, .clock = &log_clock};
    const canopy_bus_counters_t *counters = &APP.bus_state->counters;
    canopy_can_frame_t frame;
    char line[256];

    if (canopy_loopback_join(&bus, &ours, our_queue, QUEUE, APP.acceptance) != CANOPY_OK ||
        canopy_loopback_join(&bus, &theirs, their_queue, QUEUE, CANOPY_CAN_ACCEPT_EVERYTHING) != CANOPY_OK ||
        canopy_loop_init(&loop, &config) != CANOPY_OK) {
        return 1;
    }
    while (fgets(line, sizeof line, stdin) != NULL) {
        if (!parse(line, &frame)) {
            return 1;
        }
        while (time_now + APP.period < frame.time) {
            time_now += APP.period;
            (void)canopy_loop_cycle(&loop, time_now);
        }
        (void)theirs.can.send(theirs.can.context, 0, &frame);
    }
    time_now += APP.period;
    (void)canopy_loop_cycle(&loop, time_now);
    printf("accepted %" PRIu32 " unknown %" PRIu32 " rejected %" PRIu32 "\n", counters->accepted, counters->unknown_id,
           canopy_bus_rejected(counters));
    return 0;
}
