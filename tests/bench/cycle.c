/* SPDX-License-Identifier: MIT */
#include "cycle.h"

enum { FRAMES_MAX = 16 };

canopy_loop_t bench_loop;

static canopy_can_frame_t arrived[FRAMES_MAX];
static uint32_t taken;
static uint32_t cycles;
static canopy_time_t now;

/** As cheap as a driver can be: the bytes of one frame out of a mailbox. */
static int receive(void *context, canopy_can_frame_t *frame)
{
    const canopy_can_frame_t *mailbox = &arrived[taken];

    (void)context;
    if (taken == bench_frame_count) {
        return 0;
    }
    taken++;
    frame->time = now;
    frame->id = mailbox->id;
    frame->flags = mailbox->flags;
    frame->length = mailbox->length;
    for (uint8_t byte = 0; byte < mailbox->length; byte++) {
        frame->data[byte] = mailbox->data[byte];
    }
    return 1;
}

static int send(void *context, uint8_t mailbox, const canopy_can_frame_t *frame)
{
    (void)context;
    (void)mailbox;
    (void)frame;
    return 1;
}

static canopy_time_t clock_now(void *context)
{
    (void)context;
    return now;
}

static bool never_wait(void *context, canopy_time_t deadline)
{
    (void)context;
    (void)deadline;
    return false;
}

static const canopy_can_t can = {.receive = receive, .send = send};
static const canopy_clock_t clock_driver = {.now = clock_now, .wait_until = never_wait};
static const canopy_loop_config_t config = {.app = &BENCH_APP, .can = &can, .clock = &clock_driver};

int32_t bench_cycle_start(void)
{
    taken = bench_frame_count;
    cycles = 0;
    now = 0;
    return bench_frame_count <= (uint32_t)FRAMES_MAX ? (int32_t)canopy_loop_init(&bench_loop, &config)
                                                     : (int32_t)CANOPY_ERROR_ARGUMENT;
}

/** Not canopy_e2e_protect(), whose calls are counted. */
static void protect(canopy_can_frame_t *frame)
{
    const canopy_bus_t *bus = config.app->bus;

    for (uint16_t message = 0; message < bus->rx_count; message++) {
        if (bus->rx[message].id == frame->id && bus->rx[message].data_id != CANOPY_E2E_NONE) {
            frame->data[1] = (uint8_t)((frame->data[1] & 0xF0u) | (cycles % CANOPY_E2E_COUNTERS));
            frame->data[0] = canopy_e2e_crc((uint16_t)bus->rx[message].data_id, frame->data, frame->length);
        }
    }
}

void bench_cycle_prepare(void)
{
    for (uint32_t frame = 0; frame < bench_frame_count; frame++) {
        arrived[frame] = bench_frames[frame];
        protect(&arrived[frame]);
    }
    taken = 0;
    cycles++;
    now = bench_loop.deadline;
}

uint32_t bench_cycle_failures(void)
{
    const canopy_app_t *app = config.app;
    const canopy_bus_counters_t *counters = &app->bus_state->counters;
    canopy_tx_counters_t tx;

    canopy_tx_count(app->tx, &tx);
    return cycles * bench_frame_count - counters->accepted + tx.replaced + tx.expired + tx.trace_dropped +
           app->tree_instance->faults + bench_loop.overruns + bench_loop.rx_errors;
}
