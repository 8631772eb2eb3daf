/* SPDX-License-Identifier: MIT */
/** @file A driver like one over SocketCAN; the contract is in socket.h. */
#include "socket.h"

#include <stddef.h>

#include "unity.h"

/** The kernel's side of the controller: takes note of what is out, and fills the mailboxes from the queue. */
static void transmit(socket_t *self)
{
    controller_t *controller = &self->controller;

    for (uint8_t mailbox = 0; mailbox < controller->config.mailboxes; mailbox++) {
        mailbox_state_t state = controller->mailboxes[mailbox].state;

        if (state == MAILBOX_SENT) {
            self->outcome = CANOPY_CAN_SENT; /* the echo: with it, there is one frame at a time */
        } else if (state == MAILBOX_ABORTED) {
            self->outcome = CANOPY_CAN_ABORTED;
        }
        controller_release(controller, mailbox);
        if (self->waiting > 0u && self->link == SOCKET_UP &&
            controller_send(controller, mailbox, &self->queue[self->first])) {
            self->first = (self->first + 1u) % (uint32_t)SOCKET_QUEUE_MAX;
            self->waiting--;
        }
    }
}

static void isr(void *context)
{
    socket_t *self = context;
    received_t received;

    while (controller_receive(&self->controller, 0, &received)) {
        received.frame.time = self->controller.world->now / NS_PER_US;
        if (canopy_can_accepts(self->acceptance, &received.frame)) {
            (void)canopy_ring_push(&self->ring, &received.frame); /* a full ring counts */
        }
    }
    transmit(self);
}

static int receive(void *context, canopy_can_frame_t *frame)
{
    socket_t *self = context;

    return canopy_ring_pop(&self->ring, frame) ? 1 : 0;
}

static int send(void *context, uint8_t mailbox, const canopy_can_frame_t *frame)
{
    socket_t *self = context;

    (void)mailbox;
    if (self->link != SOCKET_UP) {
        return CANOPY_ERROR_BUS_DOWN;
    }
    if (self->waiting == self->queue_length) {
        return 0; /* ENOBUFS */
    }
    self->queue[(self->first + self->waiting) % (uint32_t)SOCKET_QUEUE_MAX] = *frame;
    self->waiting++;
    self->highest = self->waiting > self->highest ? self->waiting : self->highest;
    self->outcome = CANOPY_CAN_PENDING;
    transmit(self);
    return 1;
}

static canopy_can_outcome_t outcome(void *context, uint8_t mailbox)
{
    const socket_t *self = context;

    (void)mailbox;
    return self->outcome;
}

static canopy_can_controller_t state(void *context)
{
    const socket_t *self = context;

    if (self->link != SOCKET_UP) {
        return self->link == SOCKET_DOWN ? CANOPY_CAN_CONTROLLER_DOWN : CANOPY_CAN_CONTROLLER_GONE;
    }
    return controller_state(&self->controller);
}

static void restart(void *context)
{
    socket_t *self = context;

    self->restarts++;
    controller_restart(&self->controller);
}

static int wait(void *context, uint32_t timeout_us)
{
    const socket_t *self = context;
    world_t *world = self->controller.world;

    if (canopy_ring_count(&self->ring) == 0u) {
        world_run(world, world->now + timeout_us * NS_PER_US);
    }
    return canopy_ring_count(&self->ring) > 0u ? 1 : 0;
}

static void stats(void *context, canopy_can_stats_t *counters)
{
    const socket_t *self = context;

    *counters = (canopy_can_stats_t){.sent = self->controller.sent,
                                     .rx_dropped = self->controller.fifos[0].lost + canopy_ring_dropped(&self->ring)};
}

void socket_init(socket_t *self, wire_t *wire, uint32_t queue_length, bool has_echo,
                 const canopy_can_acceptance_t *acceptance)
{
    controller_config_t config = CONTROLLER_COMMON;

    config.in_order = true;
    config.depth = 32;
    *self = (socket_t){.queue_length = queue_length, .acceptance = acceptance};
    controller_init(&self->controller, wire, "controller", &config);
    TEST_ASSERT_EQUAL(CANOPY_OK, canopy_ring_init(&self->ring, self->ring_storage, sizeof self->ring_storage,
                                                  sizeof self->ring_storage[0], SOCKET_RING));
    self->controller.isr = isr;
    self->controller.isr_context = self;
    self->can = (canopy_can_t){.context = self,
                               .receive = receive,
                               .send = send,
                               .outcome = has_echo ? outcome : NULL,
                               .state = state,
                               .restart = restart,
                               .wait = wait,
                               .stats = stats,
                               .mailboxes = 1,
                               .is_filtered = !canopy_can_accepts_everything(acceptance)};
}

void socket_set_link(socket_t *self, socket_link_t link)
{
    self->link = link;
    if (link == SOCKET_UP) {
        return;
    }
    self->waiting = 0;
    if (self->outcome == CANOPY_CAN_PENDING) {
        self->outcome = CANOPY_CAN_ABORTED;
    }
    for (uint8_t mailbox = 0; mailbox < self->controller.config.mailboxes; mailbox++) {
        controller_abort(&self->controller, mailbox);
    }
}
