/* SPDX-License-Identifier: MIT */
/** @file The one frame that is with the kernel: handing it over, and what has become of it. */
#include <errno.h>
#include <linux/sock_diag.h>
#include <string.h>
#include <sys/socket.h>

#include "socketcan_internal.h"

#ifndef SO_MEMINFO
#define SO_MEMINFO 55
#endif

/** @return size of the frame for the kernel [bytes] */
static size_t frame_to_kernel(struct canfd_frame *raw, const canopy_can_frame_t *frame)
{
    const bool fd = (frame->flags & CANOPY_CAN_FD) != 0;

    memset(raw, 0, sizeof *raw);
    raw->can_id = frame->id;
    raw->can_id |= (frame->flags & CANOPY_CAN_EXTENDED) != 0 ? CAN_EFF_FLAG : 0u;
    raw->len = frame->length;
    if ((frame->flags & CANOPY_CAN_REMOTE) != 0) {
        raw->can_id |= CAN_RTR_FLAG;
    } else {
        memcpy(raw->data, frame->data, frame->length);
    }
    if (fd) {
        raw->flags |= (frame->flags & CANOPY_CAN_BITRATE_SWITCH) != 0 ? CANFD_BRS : 0u;
        raw->flags |= (frame->flags & CANOPY_CAN_ERROR_STATE) != 0 ? CANFD_ESI : 0u;
    }
    return fd ? CANFD_MTU : CAN_MTU;
}

/** The second socket must get the echo of this id: each id is told to the kernel once. */
static bool listen_to(canopy_socketcan_t *self, uint32_t id)
{
    for (uint16_t index = 0; index < self->echo_count; index++) {
        if (self->echo_ids[index] == id) {
            return true;
        }
    }
    if (self->echo_count == CANOPY_CAN_ACCEPT_MAX) {
        errno = ENOSPC;
        return false;
    }
    self->echo_ids[self->echo_count++] = id;
    if (canopy_socketcan_listen(self)) {
        return true;
    }
    self->echo_count--;
    return false;
}

static void settle(canopy_socketcan_t *self, canopy_can_outcome_t outcome)
{
    if (self->flight.outcome == CANOPY_CAN_PENDING) {
        self->flight.outcome = outcome;
        if (outcome == CANOPY_CAN_SENT) {
            self->stats.sent++;
        } else {
            self->stats.tx_dropped++;
        }
    }
}

void canopy_socketcan_lose_flight(canopy_socketcan_t *self)
{
    settle(self, CANOPY_CAN_ABORTED);
}

void canopy_socketcan_take_echo(canopy_socketcan_t *self, const struct canfd_frame *raw)
{
    const uint8_t flags = CANFD_BRS | CANFD_ESI;
    bool is_ours = self->knowledge == CANOPY_SOCKETCAN_BY_ECHO && raw->can_id == self->flight.id &&
                   raw->len == self->flight.length && (raw->flags & flags) == self->flight.flags &&
                   memcmp(raw->data, self->flight.data, raw->len) == 0;

    if (is_ours) {
        settle(self, CANOPY_CAN_SENT);
    }
}

static void take_off(canopy_socketcan_t *self, const struct canfd_frame *raw)
{
    self->flight.outcome = CANOPY_CAN_PENDING;
    self->flight.id = raw->can_id;
    self->flight.length = raw->len;
    self->flight.flags = raw->flags;
    memcpy(self->flight.data, raw->data, sizeof self->flight.data);
    if (self->knowledge == CANOPY_SOCKETCAN_AT_ONCE) {
        settle(self, CANOPY_CAN_SENT);
    }
}

/** @return 1 the echo of a frame with this id would be noticed, negative canopy_error_t */
static int prepare_echo(canopy_socketcan_t *self, uint32_t id)
{
    if (self->knowledge != CANOPY_SOCKETCAN_BY_ECHO) {
        return 1;
    }
    if (!listen_to(self, id)) {
        return canopy_socketcan_error(self, errno);
    }
    canopy_socketcan_take_events(self); /* an echo that is there already is not that frame's */
    return 1;
}

/** @return 1 the kernel has it, 0 its queue is full, negative canopy_error_t */
static int hand_over(canopy_socketcan_t *self, const struct canfd_frame *raw, size_t size)
{
    ssize_t written = -1;
    canopy_error_t error = CANOPY_ERROR_BUS_DOWN;

    /* The first answer may be an old one: that the link was down a while ago, which each socket is told once. */
    for (unsigned attempt = 0; written < 0 && error == CANOPY_ERROR_BUS_DOWN && attempt < 2u; attempt++) {
        do {
            written = send(self->socket, raw, size, MSG_DONTWAIT);
        } while (written < 0 && errno == EINTR);
        error = written < 0 ? canopy_socketcan_error(self, errno) : CANOPY_ERROR_IO;
    }
    if (written == (ssize_t)size) {
        return 1;
    }
    if (written < 0 && (errno == ENOBUFS || errno == EAGAIN)) {
        return 0;
    }
    return error;
}

int canopy_socketcan_send(void *context, uint8_t mailbox, const canopy_can_frame_t *frame)
{
    canopy_socketcan_t *self = context;
    struct canfd_frame raw;
    size_t size;
    int result = 1;

    (void)mailbox;
    if (self->flight.outcome == CANOPY_CAN_PENDING) {
        return 0;
    }
    if (!canopy_can_frame_can_be_sent(frame)) {
        result = CANOPY_ERROR_ARGUMENT;
    } else if ((frame->flags & CANOPY_CAN_FD) != 0 && !self->fd_frames) {
        result = CANOPY_ERROR_UNSUPPORTED;
    } else {
        size = frame_to_kernel(&raw, frame);
        result = prepare_echo(self, raw.can_id);
        if (result == 1) {
            result = hand_over(self, &raw, size);
        }
    }
    if (result == 1) {
        take_off(self, &raw);
    } else if (result < 0) {
        self->stats.tx_dropped++;
    }
    return result;
}

/** Nothing of this socket is in the kernel's queue any more. */
static bool has_left_queue(const canopy_socketcan_t *self)
{
    uint32_t info[SK_MEMINFO_VARS] = {0};
    socklen_t size = sizeof info;

    return getsockopt(self->socket, SOL_SOCKET, SO_MEMINFO, info, &size) != 0 || info[SK_MEMINFO_WMEM_ALLOC] == 0u;
}

canopy_can_outcome_t canopy_socketcan_outcome(void *context, uint8_t mailbox)
{
    canopy_socketcan_t *self = context;

    (void)mailbox;
    if (self->flight.outcome == CANOPY_CAN_PENDING) {
        canopy_socketcan_take_events(self);
        if (self->knowledge == CANOPY_SOCKETCAN_BY_QUEUE && has_left_queue(self)) {
            settle(self, CANOPY_CAN_SENT);
        }
    }
    return self->flight.outcome;
}
