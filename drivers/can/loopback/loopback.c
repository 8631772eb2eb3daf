/* SPDX-License-Identifier: MIT */
/**
 * @file
 * CAN bus inside one program; the contract is in loopback.h.
 */
#include "canopy/can/loopback.h"

#include "loopback_internal.h"

static void hand_to_others(const canopy_loopback_endpoint_t *self, const canopy_can_frame_t *frame)
{
    for (canopy_loopback_endpoint_t *peer = self->bus->first; peer != NULL; peer = peer->next) {
        if (peer != self && canopy_can_accepts(peer->acceptance, frame)) {
            /* A full queue is the receiver's loss; its ring counts it. */
            (void)canopy_ring_push(&peer->queue, frame);
        }
    }
}

/** From the controller, for all who accept it. @return as receive: 1 when one of the frames was for self */
static int fetch(const canopy_loopback_endpoint_t *self, canopy_can_frame_t *frame)
{
    const canopy_can_t *controller = self->bus->controller;

    for (unsigned fetched = 0; fetched < CANOPY_LOOPBACK_FETCH; fetched++) {
        canopy_can_frame_t arrived;
        const int result = controller->receive(controller->context, &arrived);
        if (result != 1) {
            return result;
        }
        hand_to_others(self, &arrived);
        if (canopy_can_accepts(self->acceptance, &arrived)) {
            *frame = arrived;
            return 1;
        }
    }
    return 0;
}

static int loopback_receive(void *context, canopy_can_frame_t *frame)
{
    canopy_loopback_endpoint_t *self = context;
    int result = canopy_ring_pop(&self->queue, frame) ? 1 : 0;
    if (result == 0 && self->bus != NULL && self->bus->controller != NULL) {
        result = fetch(self, frame);
    }
    if (result == 1) {
        self->received++;
    }
    return result;
}

void canopy_loopback_settle(canopy_loopback_endpoint_t *self, canopy_can_outcome_t outcome)
{
    self->outcome = outcome;
    self->giving = false;
    self->dropping = false;
    if (outcome == CANOPY_CAN_SENT) {
        self->sent++;
        hand_to_others(self, &self->held);
    } else {
        self->tx_dropped++;
    }
}

static int loopback_send(void *context, uint8_t mailbox, const canopy_can_frame_t *frame)
{
    canopy_loopback_endpoint_t *self = context;

    (void)mailbox;
    if (self->bus == NULL || !canopy_can_frame_can_be_sent(frame)) {
        self->tx_dropped++;
        return self->bus == NULL ? CANOPY_ERROR_BUS_DOWN : CANOPY_ERROR_ARGUMENT;
    }
    if (self->outcome == CANOPY_CAN_PENDING) {
        return 0;
    }
    self->held = *frame;
    self->error = 0;
    if (self->bus->controller == NULL) {
        canopy_loopback_settle(self, CANOPY_CAN_SENT);
        return 1;
    }
    self->outcome = CANOPY_CAN_PENDING;
    canopy_loopback_service(self->bus);
    return self->error < 0 ? self->error : 1;
}

static canopy_can_outcome_t loopback_outcome(void *context, uint8_t mailbox)
{
    canopy_loopback_endpoint_t *self = context;

    (void)mailbox;
    if (self->outcome == CANOPY_CAN_PENDING && self->bus != NULL) {
        canopy_loopback_service(self->bus);
    }
    return self->outcome;
}

static void loopback_abort(void *context, uint8_t mailbox)
{
    canopy_loopback_endpoint_t *self = context;

    (void)mailbox;
    if (self->outcome == CANOPY_CAN_PENDING && self->bus != NULL) {
        canopy_loopback_take_back(self);
    }
}

static const canopy_can_t *controller_of(const canopy_loopback_endpoint_t *self)
{
    return self->bus != NULL ? self->bus->controller : NULL;
}

static canopy_can_controller_t loopback_state(void *context)
{
    const canopy_can_t *controller = controller_of(context);

    return controller != NULL && controller->state != NULL ? controller->state(controller->context)
                                                           : CANOPY_CAN_CONTROLLER_ACTIVE;
}

static void loopback_restart(void *context)
{
    const canopy_can_t *controller = controller_of(context);

    if (controller != NULL && controller->restart != NULL) {
        controller->restart(controller->context);
    }
}

static void loopback_stats(void *context, canopy_can_stats_t *stats)
{
    const canopy_loopback_endpoint_t *self = context;
    const canopy_can_t *controller = controller_of(self);
    canopy_can_stats_t below = {0};

    if (controller != NULL && controller->stats != NULL) {
        controller->stats(controller->context, &below);
    }
    *stats = (canopy_can_stats_t){
        .received = self->received,
        .sent = self->sent,
        .rx_dropped = canopy_ring_dropped(&self->queue) + below.rx_dropped,
        .tx_dropped = self->tx_dropped,
        .error_frames = below.error_frames,
        .rx_high_water = canopy_ring_high_water(&self->queue),
    };
}

canopy_error_t canopy_loopback_join(canopy_loopback_t *bus, canopy_loopback_endpoint_t *endpoint,
                                    canopy_can_frame_t *storage, uint32_t capacity,
                                    const canopy_can_acceptance_t *acceptance)
{
    canopy_error_t error;

    if (bus == NULL || endpoint == NULL || !canopy_can_acceptance_is_valid(acceptance)) {
        return CANOPY_ERROR_ARGUMENT;
    }
    *endpoint = (canopy_loopback_endpoint_t){
        .can = {.context = endpoint,
                .receive = loopback_receive,
                .send = loopback_send,
                .outcome = loopback_outcome,
                .abort = loopback_abort,
                .state = loopback_state,
                .restart = loopback_restart,
                .stats = loopback_stats,
                .mailboxes = 1,
                .is_filtered = !canopy_can_accepts_everything(acceptance)},
        .acceptance = acceptance,
        .outcome = CANOPY_CAN_ABORTED,
    };
    error = canopy_ring_init(&endpoint->queue, storage, (size_t)capacity * sizeof *storage, sizeof *storage, capacity);
    if (error != CANOPY_OK) {
        return error;
    }
    endpoint->bus = bus;
    endpoint->next = bus->first;
    bus->first = endpoint;
    return CANOPY_OK;
}

void canopy_loopback_leave(canopy_loopback_endpoint_t *endpoint)
{
    if (endpoint->bus == NULL) {
        return;
    }
    for (canopy_loopback_endpoint_t **link = &endpoint->bus->first; *link != NULL; link = &(*link)->next) {
        if (*link == endpoint) {
            *link = endpoint->next;
            break;
        }
    }
    canopy_loopback_disown(endpoint);
    endpoint->outcome = CANOPY_CAN_ABORTED;
    endpoint->bus = NULL;
    endpoint->next = NULL;
}
