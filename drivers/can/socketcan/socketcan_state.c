/* SPDX-License-Identifier: MIT */
/** @file What error frames and the interface's flags say of the controller, and how it comes back. */
#include <errno.h>
#include <linux/can/error.h>
#include <sys/socket.h>

#include "socketcan_internal.h"

enum { EVENTS_MAX = 64, COUNTER_WARNING = 96, COUNTER_PASSIVE = 128 };

/* Where an error frame has the error counters (linux/can/error.h). */
enum { TX_COUNTER = 6, RX_COUNTER = 7 };

#define ERROR_COUNTERS 0x200u /* CAN_ERR_CNT, which older headers do not have */

static canopy_can_controller_t state_by_counters(const uint8_t *data)
{
    uint8_t most = data[TX_COUNTER] > data[RX_COUNTER] ? data[TX_COUNTER] : data[RX_COUNTER];

    if (most >= (uint8_t)COUNTER_PASSIVE) {
        return CANOPY_CAN_CONTROLLER_PASSIVE;
    }
    return most >= (uint8_t)COUNTER_WARNING ? CANOPY_CAN_CONTROLLER_WARNING : CANOPY_CAN_CONTROLLER_ACTIVE;
}

#define STATES                                                                                               \
    (CAN_ERR_CRTL_TX_PASSIVE | CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_WARNING | CAN_ERR_CRTL_RX_WARNING | \
     CAN_ERR_CRTL_ACTIVE)

static canopy_can_controller_t state_by_status(uint8_t status)
{
    if ((status & (CAN_ERR_CRTL_TX_PASSIVE | CAN_ERR_CRTL_RX_PASSIVE)) != 0) {
        return CANOPY_CAN_CONTROLLER_PASSIVE;
    }
    if ((status & (CAN_ERR_CRTL_TX_WARNING | CAN_ERR_CRTL_RX_WARNING)) != 0) {
        return CANOPY_CAN_CONTROLLER_WARNING;
    }
    return CANOPY_CAN_CONTROLLER_ACTIVE;
}

static void take_error(canopy_socketcan_t *self, const struct canfd_frame *raw)
{
    bool has_counters =
        (raw->can_id & ERROR_COUNTERS) != 0u || raw->data[TX_COUNTER] != 0 || raw->data[RX_COUNTER] != 0;

    self->stats.error_frames++;
    if ((raw->can_id & CAN_ERR_BUSOFF) != 0u) {
        self->controller = CANOPY_CAN_CONTROLLER_BUS_OFF;
        return;
    }
    if ((raw->can_id & CAN_ERR_RESTARTED) != 0u) {
        canopy_socketcan_lose_flight(self); /* the kernel has dropped what was with the controller */
        self->controller = CANOPY_CAN_CONTROLLER_ACTIVE;
        return;
    }
    if (self->controller == CANOPY_CAN_CONTROLLER_BUS_OFF) {
        return; /* nothing but a restart ends that */
    }
    if ((raw->can_id & CAN_ERR_CRTL) != 0u && (raw->data[1] & STATES) != 0) {
        self->controller = state_by_status(raw->data[1]);
    } else if (has_counters) {
        self->controller = state_by_counters(raw->data);
    }
}

static void link_went(canopy_socketcan_t *self, canopy_can_controller_t link)
{
    if (self->link == CANOPY_CAN_CONTROLLER_ACTIVE && link != CANOPY_CAN_CONTROLLER_ACTIVE) {
        canopy_socketcan_lose_flight(self); /* its queue was emptied */
        self->controller = CANOPY_CAN_CONTROLLER_ACTIVE;
    }
    if (self->link != CANOPY_CAN_CONTROLLER_ACTIVE && link == CANOPY_CAN_CONTROLLER_ACTIVE) {
        canopy_socketcan_learn(self);
    }
    self->link = link;
}

void canopy_socketcan_take_events(canopy_socketcan_t *self)
{
    for (unsigned taken = 0; taken < (unsigned)EVENTS_MAX; taken++) {
        struct canfd_frame raw = {0};
        struct iovec part = {.iov_base = &raw, .iov_len = sizeof raw};
        struct msghdr message = {.msg_iov = &part, .msg_iovlen = 1};
        ssize_t size = recvmsg(self->events, &message, MSG_DONTWAIT);

        if (size < 0 && errno == EINTR) {
            continue;
        }
        if (size < 0) {
            if (canopy_socketcan_error(self, errno) == CANOPY_ERROR_BUS_DOWN) {
                canopy_socketcan_lose_flight(self); /* told once when the link goes down, however short that was */
                self->controller = CANOPY_CAN_CONTROLLER_ACTIVE;
                continue;
            }
            return;
        }
        if ((raw.can_id & CAN_ERR_FLAG) != 0u) {
            take_error(self, &raw);
        } else if ((message.msg_flags & MSG_DONTROUTE) != 0) { /* the kernel's mark of what this machine has sent */
            canopy_socketcan_take_echo(self, &raw);
        }
    }
}

static void look(canopy_socketcan_t *self, uint64_t now)
{
    self->next_look = now + CANOPY_SOCKETCAN_LOOK_US;
    link_went(self, canopy_socketcan_look(self->socket, self->index, self->name));
}

canopy_can_controller_t canopy_socketcan_state(void *context)
{
    canopy_socketcan_t *self = context;
    uint64_t now = canopy_socketcan_now();

    canopy_socketcan_take_events(self);
    if (now >= self->next_look) {
        look(self, now);
    }
    return self->link != CANOPY_CAN_CONTROLLER_ACTIVE ? self->link : self->controller;
}

void canopy_socketcan_restart(void *context)
{
    canopy_socketcan_t *self = context;

    if (self->link == CANOPY_CAN_CONTROLLER_GONE) {
        /* Fails as long as there is no interface of this name. */
        if (canopy_socketcan_bind(self) == CANOPY_OK) {
            self->next_look = 0;
        }
    } else if (self->link == CANOPY_CAN_CONTROLLER_ACTIVE && self->controller == CANOPY_CAN_CONTROLLER_BUS_OFF &&
               !self->restarts_itself && canopy_socketcan_switch(self)) {
        canopy_socketcan_lose_flight(self);
        self->controller = CANOPY_CAN_CONTROLLER_ACTIVE;
    }
}
