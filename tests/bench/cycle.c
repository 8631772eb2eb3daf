/* SPDX-License-Identifier: MIT */
#include "cycle.h"

enum { FRAMES_MAX = 16 };

canopy_loop_t bench_loop;

/** A receive mailbox as controllers have it, bxCAN for example: the data in two registers. */
typedef struct {
    uint32_t id;
    uint32_t length;
    uint32_t low;
    uint32_t high;
} mailbox_t;

static mailbox_t arrived[FRAMES_MAX];
static uint32_t taken;
static uint32_t cycles;
static canopy_time_t now;

static void put_word(uint8_t *data, uint32_t word)
{
    data[0] = (uint8_t)word;
    data[1] = (uint8_t)(word >> 8);
    data[2] = (uint8_t)(word >> 16);
    data[3] = (uint8_t)(word >> 24);
}

static uint32_t get_word(const uint8_t *data)
{
    return data[0] | ((uint32_t)data[1] << 8) | ((uint32_t)data[2] << 16) | ((uint32_t)data[3] << 24);
}

/** As cheap as a driver can be: one frame out of a mailbox. */
static int receive(void *context, canopy_can_frame_t *frame)
{
    const mailbox_t *mailbox = &arrived[taken];

    (void)context;
    if (taken == bench_frame_count) {
        return 0;
    }
    taken++;
    frame->time = now;
    frame->id = mailbox->id;
    frame->flags = 0;
    frame->length = (uint8_t)mailbox->length;
    put_word(&frame->data[0], mailbox->low);
    put_word(&frame->data[4], mailbox->high);
    return 1;
}

static int send(void *context, uint8_t mailbox, const canopy_can_frame_t *frame)
{
    (void)context;
    (void)mailbox;
    (void)frame;
    return 1;
}

/** A controller with mailboxes: what it takes is out when bench_cycle_interrupt() says so. */
static bool is_full[CANOPY_CAN_MAILBOXES_MAX];

static int load(void *context, uint8_t mailbox, const canopy_can_frame_t *frame)
{
    (void)context;
    (void)frame;
    is_full[mailbox] = true;
    return 1;
}

static canopy_can_outcome_t outcome(void *context, uint8_t mailbox)
{
    (void)context;
    return is_full[mailbox] ? CANOPY_CAN_PENDING : CANOPY_CAN_SENT;
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

static const canopy_can_t bus_in_memory = {.receive = receive, .send = send};
static const canopy_can_t controller = {
    .receive = receive, .send = load, .outcome = outcome, .mailboxes = BENCH_MAILBOXES};
static const canopy_clock_t clock_driver = {.now = clock_now, .wait_until = never_wait};
static const canopy_loop_config_t config = {
    .app = &BENCH_APP, .can = BENCH_MAILBOXES != 0 ? &controller : &bus_in_memory, .clock = &clock_driver};

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
        canopy_can_frame_t next = bench_frames[frame];

        protect(&next);
        arrived[frame] = (mailbox_t){next.id, next.length, get_word(&next.data[0]), get_word(&next.data[4])};
    }
    taken = 0;
    cycles++;
    now = bench_loop.deadline;
}

void bench_cycle_interrupt(void)
{
    canopy_tx_service(config.app->tx, now);
}

bool bench_cycle_let_out(void)
{
    for (unsigned mailbox = 0; mailbox < CANOPY_CAN_MAILBOXES_MAX; mailbox++) {
        if (is_full[mailbox]) {
            is_full[mailbox] = false;
            return true;
        }
    }
    return false;
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
