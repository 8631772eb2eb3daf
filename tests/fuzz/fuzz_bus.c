/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Any frames at any times at the example application, with its generated codec: nothing leaves its memory, a frame that
 * is refused changes nothing but a counter, and every frame is counted exactly once.
 */
#include <string.h>

#include "input.h"
#include "nao_home_app.h"

enum { DATA_IDS = 3 };

static input_t input;

static void take_frame(canopy_can_frame_t *frame, canopy_time_t now)
{
    static const uint16_t data_ids[DATA_IDS] = {256, 272, 0};
    const canopy_rx_message_t *message = &nao_home_app.bus->rx[take8(&input) % nao_home_app.bus->rx_count];
    uint8_t kind = take8(&input);

    *frame = (canopy_can_frame_t){.id = message->id, .flags = message->flags, .length = (uint8_t)message->length};
    frame->time = kind % 4u == 0u ? now - take32(&input) : now; /* old, or just now, or yet to come */
    if (kind % 8u == 0u) {
        frame->id = take32(&input);
        frame->flags = take8(&input);
        frame->length = take8(&input) % (CANOPY_CAN_DATA_MAX + 1u);
    }
    for (uint8_t byte = 0; byte < frame->length; byte++) {
        frame->data[byte] = take8(&input);
    }
    if (kind % 2u == 1u && frame->length >= 2u) { /* a right CRC, so that the search gets beyond it */
        uint16_t data_id = message->data_id != CANOPY_E2E_NONE ? (uint16_t)message->data_id : data_ids[kind % DATA_IDS];
        canopy_e2e_receiver_t receiver = {0};
        uint8_t counter = take8(&input) % CANOPY_E2E_COUNTERS;

        canopy_e2e_protect(data_id, counter, frame->data, frame->length);
        EXPECT(canopy_e2e_check(&receiver, data_id, frame->data, frame->length) == CANOPY_E2E_OK);
        EXPECT(canopy_e2e_check(&receiver, data_id, frame->data, frame->length) == CANOPY_E2E_REPEATED);
        frame->data[frame->length - 1u] ^= 1u;
        EXPECT(canopy_e2e_check(&receiver, data_id, frame->data, frame->length) != CANOPY_E2E_OK);
        frame->data[frame->length - 1u] ^= 1u;
    }
}

static uint32_t accounted(const canopy_bus_counters_t *counters)
{
    return counters->accepted + counters->unknown_id + canopy_bus_rejected(counters);
}

static void receive(canopy_time_t now)
{
    const canopy_bus_counters_t *counters = &nao_home_app.bus_state->counters;
    nao_home_input_t before;
    canopy_can_frame_t frame;
    uint32_t accepted = counters->accepted;
    uint32_t all = accounted(counters);

    take_frame(&frame, now);
    memcpy(&before, nao_home_input, sizeof before);
    canopy_bus_receive(nao_home_app.bus_state, &frame, now);
    EXPECT(accounted(counters) == all + 1u);
    EXPECT(counters->accepted != accepted || memcmp(&before, nao_home_input, sizeof before) == 0);
}

static int driver_receive(void *context, canopy_can_frame_t *frame)
{
    (void)context;
    (void)frame;
    return take8(&input) % 8u == 0u ? CANOPY_ERROR_IO : 0;
}

/* A controller with two mailboxes: frames get out, come back or stay as the input says. */
enum { MAILBOXES = 2 };

static struct {
    bool is_full;
    bool is_aborting;
} mailboxes[MAILBOXES];

static int driver_send(void *context, uint8_t mailbox, const canopy_can_frame_t *frame)
{
    int result = (int)(take8(&input) % 3u) - 1;

    (void)context;
    EXPECT(mailbox < MAILBOXES && !mailboxes[mailbox].is_full);
    EXPECT(frame->length <= CANOPY_CAN_DATA_MAX);
    if (result == 1) {
        mailboxes[mailbox].is_full = true;
        mailboxes[mailbox].is_aborting = false;
    }
    return result;
}

static canopy_can_outcome_t driver_outcome(void *context, uint8_t mailbox)
{
    canopy_can_outcome_t outcome = (canopy_can_outcome_t)(take8(&input) % 3u);

    (void)context;
    EXPECT(mailbox < MAILBOXES && mailboxes[mailbox].is_full);
    mailboxes[mailbox].is_full = outcome == CANOPY_CAN_PENDING;
    return outcome;
}

static void driver_abort(void *context, uint8_t mailbox)
{
    (void)context;
    EXPECT(mailbox < MAILBOXES && mailboxes[mailbox].is_full && !mailboxes[mailbox].is_aborting);
    mailboxes[mailbox].is_aborting = true;
}

static canopy_can_controller_t driver_state(void *context)
{
    (void)context;
    return (canopy_can_controller_t)(take8(&input) % (CANOPY_CAN_CONTROLLER_GONE + 1u));
}

static void driver_restart(void *context)
{
    (void)context;
}

static void driver_stats(void *context, canopy_can_stats_t *stats)
{
    (void)context;
    *stats = (canopy_can_stats_t){.rx_dropped = take8(&input)};
}

/** Every command that was posted is in a mailbox, waits, or has ended once; one that was held back counts as replaced. */
static void check_accounts(const canopy_app_t *app)
{
    canopy_tx_counters_t counters;
    uint32_t posted = 0;
    uint32_t open = 0;

    canopy_tx_count(app->tx, &counters);
    for (uint16_t message = 0; message < app->bus->tx_count; message++) {
        const canopy_tx_slot_t *slot = &app->tx_memory.slots[message];

        posted += slot->posted;
        open += slot->posted - slot->taken; /* those that wait, and those that they will have replaced */
        open += slot->flying ? 1u : 0u;
    }
    EXPECT(counters.sent + counters.replaced + counters.expired + open == posted + app->tx->held);
}

static canopy_time_t clock_time;

/** Moves on with each reading, so that a stop comes to its end. */
static canopy_time_t driver_now(void *context)
{
    (void)context;
    clock_time += 1000u + take8(&input);
    return clock_time;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const canopy_can_t can = {.receive = driver_receive,
                                     .send = driver_send,
                                     .outcome = driver_outcome,
                                     .abort = driver_abort,
                                     .state = driver_state,
                                     .restart = driver_restart,
                                     .stats = driver_stats,
                                     .mailboxes = MAILBOXES};
    static const canopy_clock_t clock = {.now = driver_now};
    static const canopy_loop_config_t config = {.app = &nao_home_app, .can = &can, .clock = &clock};
    canopy_loop_t loop;
    canopy_time_t now;

    input = (input_t){.next = data, .end = data + size};
    clock_time = take32(&input) * UINT64_C(0xFFFFFFFF);
    memset(mailboxes, 0, sizeof mailboxes);
    EXPECT(canopy_loop_init(&loop, &config) == CANOPY_OK);
    now = loop.deadline;
    while (input.next != input.end) {
        uint8_t what = take8(&input);

        if (what % 4u != 0u) {
            receive(now);
        } else {
            canopy_status_t root = canopy_loop_cycle(&loop, now);

            EXPECT(root > CANOPY_IDLE && root <= CANOPY_SKIPPED);
        }
        check_accounts(&nao_home_app);
        now += what * UINT64_C(1000);
    }
    (void)canopy_loop_stop(&loop, clock_time);
    check_accounts(&nao_home_app);
    return 0;
}
