/* SPDX-License-Identifier: MIT */
#include "harness.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "canopy/e2e.h"

#define TICKS 200u
#define FRAMES_A_TICK 4u

static uint64_t state = 1;
static volatile unsigned seen;

uint64_t fuzz_next(void)
{
    state ^= state << 13u;
    state ^= state >> 7u;
    state ^= state << 17u;
    return state;
}

void fuzz_read(const void *bytes, size_t size)
{
    const unsigned char *place = bytes;

    for (size_t index = 0; index < size; index++) {
        seen += place[index];
    }
}

void fuzz_read_text(const char *text)
{
    if (text != NULL) {
        fuzz_read(text, strlen(text));
    }
}

void canopy_fuzz_injected(void)
{
    fprintf(stderr, "CANOPY-FUZZ-INJECTED: a text of a file has become code\n");
    abort();
}

/** The bus: as many frames as are left in this tick, most of them with an id and a form that the application knows. */
typedef struct {
    const canopy_app_t *app;
    canopy_time_t time;
    unsigned left;
    uint8_t counter;
} bus_t;

static int receive(void *context, canopy_can_frame_t *frame)
{
    bus_t *bus = context;
    const canopy_bus_t *tables = bus->app->bus;

    if (bus->left == 0u) {
        return 0;
    }
    bus->left--;
    memset(frame, 0, sizeof *frame);
    frame->time = bus->time - fuzz_next() % 2000000u; /* up to 2 s ago, or longer than there is time */
    for (unsigned place = 0; place < sizeof frame->data; place++) {
        frame->data[place] = (fuzz_next() & 3u) != 0u ? 0u : (uint8_t)fuzz_next();
    }
    frame->id = (uint32_t)(fuzz_next() & 0x7FFu);
    frame->length = (uint8_t)(fuzz_next() % 9u);
    if (tables->rx_count != 0u && (fuzz_next() & 15u) != 0u) {
        const canopy_rx_message_t *message = &tables->rx[fuzz_next() % tables->rx_count];

        frame->id = message->id;
        frame->flags = message->flags;
        /* A message of several packets is longer than a frame. */
        frame->length =
            message->length <= CANOPY_CAN_DATA_MAX ? (uint8_t)message->length : (uint8_t)CANOPY_CAN_DATA_MAX;
        if (message->data_id >= 0) {
            bus->counter = (uint8_t)((bus->counter + 1u) % 15u);
            canopy_e2e_protect((uint16_t)message->data_id, bus->counter, frame->data, frame->length);
        }
    }
    return 1;
}

static int send_frame(void *context, uint8_t mailbox, const canopy_can_frame_t *frame)
{
    (void)context;
    (void)mailbox;
    fuzz_read(frame->data, frame->length);
    return (fuzz_next() & 15u) != 0u;
}

static void stats(void *context, canopy_can_stats_t *counters)
{
    (void)context;
    memset(counters, 0, sizeof *counters);
}

static canopy_time_t now(void *context)
{
    return *(const canopy_time_t *)context;
}

static bool wait_until(void *context, canopy_time_t deadline)
{
    (void)context;
    (void)deadline;
    return true;
}

/** A DBC says times in ms: any other number of us is one that did not fit. */
static void check_tables(const canopy_bus_t *bus)
{
    for (uint16_t place = 0; place < bus->rx_count; place++) {
        if (bus->rx[place].timeout % 1000u != 0u || bus->rx[place].data_id > (int32_t)UINT16_MAX) {
            puts("a timeout or a data id that no DBC can have given");
            abort();
        }
    }
}

void fuzz_run(const canopy_app_t *app, uint64_t seed)
{
    static canopy_loop_t loop;
    static canopy_loop_config_t config;
    canopy_time_t time = seed & 0xFFFFFFu;
    bus_t bus = {.app = app};
    const canopy_can_t can = {.context = &bus, .receive = receive, .send = send_frame, .stats = stats};
    const canopy_clock_t clock = {.context = &time, .now = now, .wait_until = wait_until};

    state = seed | 1u;
    check_tables(app->bus);
    config = (canopy_loop_config_t){.app = app, .can = &can, .clock = &clock};
    if (canopy_loop_init(&loop, &config) != CANOPY_OK || canopy_tree_validate(app->tree, NULL) != CANOPY_OK) {
        puts("the runtime refuses the tables");
        abort();
    }
    for (unsigned tick = 0; tick < TICKS; tick++) {
        bus.left = (unsigned)(fuzz_next() % (FRAMES_A_TICK + 1u));
        bus.time = time;
        (void)canopy_loop_cycle(&loop, time);
        time += app->period;
    }
    (void)canopy_loop_stop(&loop, time);
}
