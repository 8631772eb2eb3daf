/* SPDX-License-Identifier: MIT */
/** @file Drivers over a controller of the double; the contract is in port.h. */
#include "port.h"

#include <stddef.h>

#include "unity.h"

static canopy_time_t now_of(const port_t *self)
{
    return self->controller.world->now / NS_PER_US;
}

/* --- reception ------------------------------------------------------------------------------------------------------ */

/** How long ago, in counts of the timer. */
static uint32_t age_of(const port_t *self, uint32_t stamp)
{
    return (controller_timer(&self->controller) - stamp) & (UINT32_MAX >> (32u - self->controller.config.stamp_bits));
}

/** Takes the frame that arrived first, of all FIFOs. */
static bool take(port_t *self, canopy_can_frame_t *frame)
{
    const controller_config_t *config = &self->controller.config;
    int oldest = -1;

    for (int fifo = 0; fifo < CONTROLLER_FIFOS; fifo++) {
        self->has_head[fifo] =
            self->has_head[fifo] || controller_receive(&self->controller, (unsigned)fifo, &self->heads[fifo]);
        if (self->has_head[fifo] &&
            (oldest < 0 || age_of(self, self->heads[fifo].stamp) > age_of(self, self->heads[oldest].stamp))) {
            oldest = fifo;
        }
    }
    if (oldest < 0) {
        return false;
    }
    *frame = self->heads[oldest].frame;
    frame->time = canopy_time_of_stamp(now_of(self), controller_timer(&self->controller), self->heads[oldest].stamp,
                                       config->stamp_bits, config->stamp_ns);
    self->has_head[oldest] = false;
    self->received++;
    return true;
}

static int receive_polled(void *context, canopy_can_frame_t *frame)
{
    port_t *self = context;

    return take(self, frame) ? 1 : 0;
}

static int receive_queued(void *context, canopy_can_frame_t *frame)
{
    port_t *self = context;

    return canopy_ring_pop(&self->ring, frame) ? 1 : 0;
}

static void isr(void *context)
{
    port_t *self = context;
    canopy_can_frame_t frame;

    while (take(self, &frame)) {
        (void)canopy_ring_push(&self->ring, &frame); /* a full ring counts */
    }
    canopy_tx_service(self->tx, now_of(self));
}

/* --- transmission --------------------------------------------------------------------------------------------------- */

static int send(void *context, uint8_t mailbox, const canopy_can_frame_t *frame)
{
    port_t *self = context;

    TEST_ASSERT_NOT_EQUAL_MESSAGE(MAILBOX_PENDING, self->controller.mailboxes[mailbox].state, "mailbox is in use");
    controller_release(&self->controller, mailbox);
    return controller_send(&self->controller, mailbox, frame) ? 1 : CANOPY_ERROR_ARGUMENT;
}

static canopy_can_outcome_t outcome(void *context, uint8_t mailbox)
{
    port_t *self = context;

    switch (self->controller.mailboxes[mailbox].state) {
    case MAILBOX_SENT:
        controller_release(&self->controller, mailbox);
        return CANOPY_CAN_SENT;
    case MAILBOX_ABORTED:
        controller_release(&self->controller, mailbox);
        self->taken_back++;
        return CANOPY_CAN_ABORTED;
    case MAILBOX_PENDING:
        break;
    case MAILBOX_FREE:
        TEST_FAIL_MESSAGE("the outcome of an empty mailbox was asked for");
        break;
    }
    return CANOPY_CAN_PENDING;
}

static void take_back(void *context, uint8_t mailbox)
{
    port_t *self = context;

    controller_abort(&self->controller, mailbox);
}

static void request(void *context)
{
    port_t *self = context;

    controller_raise(&self->controller);
}

/* --- states --------------------------------------------------------------------------------------------------------- */

static canopy_can_controller_t state(void *context)
{
    const port_t *self = context;

    return controller_state(&self->controller);
}

static void restart(void *context)
{
    port_t *self = context;

    controller_restart(&self->controller);
}

static bool is_waiting(const port_t *self)
{
    return canopy_ring_count(&self->ring) > 0u || self->controller.fifos[0].count > 0u ||
           self->controller.fifos[1].count > 0u || self->has_head[0] || self->has_head[1];
}

static int wait(void *context, uint32_t timeout_us)
{
    const port_t *self = context;
    world_t *world = self->controller.world;
    nanoseconds_t until = world->now + timeout_us * NS_PER_US;

    while (!is_waiting(self) && world->now < until) {
        nanoseconds_t step = world->now + 10u * NS_PER_US;

        world_run(world, step < until ? step : until);
    }
    return is_waiting(self) ? 1 : 0;
}

static void stats(void *context, canopy_can_stats_t *counters)
{
    const port_t *self = context;

    *counters = (canopy_can_stats_t){
        .received = self->received,
        .sent = self->controller.sent,
        .rx_dropped =
            self->controller.fifos[0].lost + self->controller.fifos[1].lost + canopy_ring_dropped(&self->ring),
        .error_frames = self->controller.error_frames,
        .rx_high_water = canopy_ring_high_water(&self->ring),
    };
}

static void add_filters(port_t *self, const port_config_t *config)
{
    unsigned added = 0;

    for (const canopy_can_acceptance_t *list = config->acceptance; list != NULL; list = list->next) {
        TEST_ASSERT_FALSE_MESSAGE(list->everything, "leave the acceptance list out instead");
        for (uint16_t index = 0; index < list->count; index++) {
            const bool extended = (list->ids[index] & CANOPY_CAN_ACCEPT_EXTENDED) != 0u;

            controller_filter(&self->controller,
                              (controller_filter_t){.id = list->ids[index] & ~CANOPY_CAN_ACCEPT_EXTENDED,
                                                    .mask = extended ? UINT32_C(0x1FFFFFFF) : 0x7FFu,
                                                    .extended = extended,
                                                    .fifo = (uint8_t)(config->fifos > 1u ? added % 2u : 0u)});
            added++;
        }
    }
}

void port_init(port_t *self, wire_t *wire, const controller_config_t *controller, const port_config_t *config,
               canopy_tx_t *tx)
{
    *self = (port_t){.tx = tx};
    controller_init(&self->controller, wire, "controller", controller);
    add_filters(self, config);
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_ring_init(&self->ring, self->ring_storage, sizeof self->ring_storage,
                                                  sizeof self->ring_storage[0], PORT_RING));
    self->can = (canopy_can_t){.context = self,
                               .receive = receive_polled,
                               .send = send,
                               .outcome = outcome,
                               .abort = config->can_abort ? take_back : NULL,
                               .state = state,
                               .restart = restart,
                               .wait = wait,
                               .stats = stats,
                               .mailboxes = controller->mailboxes,
                               .is_filtered = config->acceptance != NULL};
    if (config->kind == PORT_INTERRUPT) {
        self->can.receive = receive_queued;
        self->can.request = request;
        self->controller.isr = isr;
        self->controller.isr_context = self;
    }
}
