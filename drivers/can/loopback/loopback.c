/* SPDX-License-Identifier: MIT */
/**
 * @file
 * CAN bus inside one program; the contract is in loopback.h.
 */
#include "canopy/can/loopback.h"

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

static int loopback_send(void *context, uint8_t mailbox, const canopy_can_frame_t *frame)
{
    canopy_loopback_endpoint_t *self = context;
    if (self->bus == NULL || !canopy_can_frame_can_be_sent(frame)) {
        self->tx_dropped++;
        return self->bus == NULL ? CANOPY_ERROR_BUS_DOWN : CANOPY_ERROR_ARGUMENT;
    }
    const canopy_can_t *controller = self->bus->controller;
    const int result = controller != NULL ? controller->send(controller->context, mailbox, frame) : 1;
    if (result != 1) {
        self->tx_dropped++;
        return result;
    }
    hand_to_others(self, frame);
    self->sent++;
    return 1;
}

static void loopback_stats(void *context, canopy_can_stats_t *stats)
{
    const canopy_loopback_endpoint_t *self = context;
    *stats = (canopy_can_stats_t){
        .received = self->received,
        .sent = self->sent,
        .rx_dropped = canopy_ring_dropped(&self->queue),
        .tx_dropped = self->tx_dropped,
        .error_frames = 0u,
        .rx_high_water = canopy_ring_high_water(&self->queue),
    };
}

canopy_error_t canopy_loopback_join(canopy_loopback_t *bus, canopy_loopback_endpoint_t *endpoint,
                                    canopy_can_frame_t *storage, uint32_t capacity,
                                    const canopy_can_acceptance_t *acceptance)
{
    if (bus == NULL || endpoint == NULL || !canopy_can_acceptance_is_valid(acceptance)) {
        return CANOPY_ERROR_ARGUMENT;
    }
    const canopy_error_t error =
        canopy_ring_init(&endpoint->queue, storage, (size_t)capacity * sizeof *storage, sizeof *storage, capacity);
    if (error != CANOPY_OK) {
        return error;
    }
    endpoint->can = (canopy_can_t){
        .context = endpoint,
        .receive = loopback_receive,
        .send = loopback_send,
        .wait = NULL,
        .stats = loopback_stats,
    };
    endpoint->bus = bus;
    endpoint->next = bus->first;
    endpoint->acceptance = acceptance;
    endpoint->received = 0u;
    endpoint->sent = 0u;
    endpoint->tx_dropped = 0u;
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
    endpoint->bus = NULL;
    endpoint->next = NULL;
}
