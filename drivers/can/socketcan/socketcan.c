/* SPDX-License-Identifier: MIT */
/**
 * @file
 * CAN driver for Linux SocketCAN; the contract is in socketcan.h, the kernel's in its documentation of CAN.
 */
#include "canopy/can/socketcan.h"

#include <errno.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <poll.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>

#include "socketcan_internal.h"

#define NS_PER_S INT64_C(1000000000)

uint64_t canopy_socketcan_now(void)
{
    return (uint64_t)canopy_arrival_monotonic() / 1000u;
}

canopy_error_t canopy_socketcan_error(canopy_socketcan_t *self, int number)
{
    switch (number) {
    case ENETDOWN: /* the link is down */
    case ENETUNREACH:
    case ENODEV: /* the interface is gone */
    case ENXIO:
        self->next_look = 0;
        return CANOPY_ERROR_BUS_DOWN;
    default:
        return CANOPY_ERROR_IO;
    }
}

static void frame_from_kernel(canopy_can_frame_t *frame, const struct canfd_frame *raw, bool fd)
{
    unsigned flags = 0;
    frame->id = raw->can_id & CAN_SFF_MASK;
    if ((raw->can_id & CAN_ERR_FLAG) != 0u) {
        flags |= CANOPY_CAN_ERROR;
        frame->id = raw->can_id & CAN_ERR_MASK;
    } else if ((raw->can_id & CAN_EFF_FLAG) != 0u) {
        flags |= CANOPY_CAN_EXTENDED;
        frame->id = raw->can_id & CAN_EFF_MASK;
    }
    if (fd) {
        flags |= CANOPY_CAN_FD;
        flags |= (raw->flags & CANFD_BRS) != 0 ? (unsigned)CANOPY_CAN_BITRATE_SWITCH : 0u;
        flags |= (raw->flags & CANFD_ESI) != 0 ? (unsigned)CANOPY_CAN_ERROR_STATE : 0u;
    } else if ((raw->can_id & (CAN_ERR_FLAG | CAN_RTR_FLAG)) == CAN_RTR_FLAG) {
        flags |= CANOPY_CAN_REMOTE;
    }
    const uint8_t length_max = fd ? CANFD_MAX_DLEN : CAN_MAX_DLEN;
    frame->flags = (uint8_t)flags;
    frame->length = raw->len < length_max ? raw->len : length_max;
    memcpy(frame->data, raw->data, frame->length);
}

/* A union, because the control buffer must be aligned for its headers. */
typedef union {
    struct cmsghdr align;
    char bytes[CMSG_SPACE(sizeof(uint32_t)) + CMSG_SPACE(sizeof(struct timespec))];
} control_t;

/** Takes the kernel's count of lost frames. @return its stamp [ns]; 0: there is none */
static int64_t take_control_data(canopy_socketcan_t *self, struct msghdr *message)
{
    int64_t stamp_ns = 0;

    for (struct cmsghdr *control = CMSG_FIRSTHDR(message); control != NULL; control = CMSG_NXTHDR(message, control)) {
        if (control->cmsg_level != SOL_SOCKET) {
            continue;
        }
        if (control->cmsg_type == SO_RXQ_OVFL) {
            uint32_t dropped; /* the kernel's count since the socket was made */

            memcpy(&dropped, CMSG_DATA(control), sizeof dropped);
            self->stats.rx_dropped = self->dropped_before + dropped;
        } else if (control->cmsg_type == SCM_TIMESTAMPNS) {
            struct timespec stamp;

            memcpy(&stamp, CMSG_DATA(control), sizeof stamp);
            stamp_ns = (int64_t)stamp.tv_sec * NS_PER_S + (int64_t)stamp.tv_nsec;
        }
    }
    return stamp_ns;
}

/**
 * Takes a batch of frames from the kernel. Without any the queue was empty, so whatever comes later arrived later.
 * @return how many, or negative canopy_error_t
 */
static int fetch(canopy_socketcan_t *self)
{
    struct canfd_frame raw[CANOPY_SOCKETCAN_BATCH];
    struct iovec parts[CANOPY_SOCKETCAN_BATCH];
    control_t control[CANOPY_SOCKETCAN_BATCH];
    struct mmsghdr messages[CANOPY_SOCKETCAN_BATCH] = {0};
    const int64_t before = canopy_arrival_monotonic();
    canopy_arrival_clocks_t clocks;
    int count;

    for (unsigned place = 0; place < CANOPY_SOCKETCAN_BATCH; place++) {
        parts[place] = (struct iovec){.iov_base = &raw[place], .iov_len = sizeof raw[place]};
        messages[place].msg_hdr = (struct msghdr){.msg_iov = &parts[place],
                                                  .msg_iovlen = 1,
                                                  .msg_control = control[place].bytes,
                                                  .msg_controllen = sizeof control[place].bytes};
    }
    do {
        count = recvmmsg(self->socket, messages, CANOPY_SOCKETCAN_BATCH, MSG_DONTWAIT, NULL);
    } while (count < 0 && errno == EINTR);
    if (count < 0 && errno != EAGAIN && errno != EWOULDBLOCK) {
        return canopy_socketcan_error(self, errno);
    }
    clocks = canopy_arrival_clocks(before);
    canopy_arrival_look(&self->arrival, &clocks);
    if (count <= 0) {
        self->arrival.empty_at = before;
        return 0;
    }
    for (int place = 0; place < count; place++) {
        canopy_can_frame_t *frame = &self->waiting[place];
        int64_t stamp = take_control_data(self, &messages[place].msg_hdr);

        /* Another length is not to be had from a socket that has not asked for CAN XL. */
        frame_from_kernel(frame, &raw[place], messages[place].msg_len == CANFD_MTU);
        frame->time = (canopy_time_t)canopy_arrival_of(&self->arrival, stamp, clocks.after) / 1000u;
    }
    self->waiting_next = 0;
    self->waiting_count = (uint16_t)count;
    return count;
}

static int socketcan_receive(void *context, canopy_can_frame_t *frame)
{
    canopy_socketcan_t *self = context;

    if (self->waiting_next == self->waiting_count) {
        int result = fetch(self);

        if (result <= 0) {
            return result;
        }
    }
    *frame = self->waiting[self->waiting_next++];
    self->stats.received++;
    return 1;
}

/** What poll() says of an error. Fetching it clears it, so that the next wait blocks again. */
static int take_poll_error(canopy_socketcan_t *self)
{
    int number = 0;
    socklen_t length = sizeof number;

    if (getsockopt(self->socket, SOL_SOCKET, SO_ERROR, &number, &length) != 0 || number == 0) {
        return CANOPY_ERROR_IO;
    }
    return canopy_socketcan_error(self, number);
}

static int socketcan_wait(void *context, uint32_t timeout_us)
{
    canopy_socketcan_t *self = context;
    const struct timespec timeout = {.tv_sec = (time_t)(timeout_us / 1000000u),
                                     .tv_nsec = (long)(timeout_us % 1000000u) * 1000L};
    bool in_flight = self->flight.outcome == CANOPY_CAN_PENDING;
    struct pollfd descriptors[] = {{.fd = self->socket, .events = POLLIN},
                                   {.fd = in_flight ? self->events : -1, .events = POLLIN}};

    if (self->waiting_next != self->waiting_count) {
        return 1;
    }
    if (ppoll(descriptors, sizeof descriptors / sizeof descriptors[0], &timeout, NULL) < 0) {
        return errno == EINTR ? 0 : CANOPY_ERROR_IO;
    }
    if ((descriptors[0].revents & POLLIN) != 0) {
        return 1;
    }
    if (descriptors[1].revents != 0) {
        canopy_socketcan_take_events(self);
    }
    return descriptors[0].revents != 0 ? take_poll_error(self) : 0;
}

static void socketcan_stats(void *context, canopy_can_stats_t *stats)
{
    const canopy_socketcan_t *self = context;
    *stats = self->stats;
}

canopy_error_t canopy_socketcan_open(canopy_socketcan_t *self, const char *interface,
                                     const canopy_can_acceptance_t *acceptance)
{
    canopy_error_t error;

    if (self == NULL || interface == NULL || interface[0] == '\0' || strlen(interface) >= sizeof self->name ||
        !canopy_can_acceptance_is_valid(acceptance)) {
        return CANOPY_ERROR_ARGUMENT;
    }
    memset(self, 0, sizeof *self);
    self->can = (canopy_can_t){.context = self,
                               .receive = socketcan_receive,
                               .send = canopy_socketcan_send,
                               .outcome = canopy_socketcan_outcome,
                               .state = canopy_socketcan_state,
                               .restart = canopy_socketcan_restart,
                               .wait = socketcan_wait,
                               .stats = socketcan_stats,
                               .mailboxes = 1,
                               .is_filtered = !canopy_can_accepts_everything(acceptance)};
    (void)strcpy(self->name, interface);
    self->acceptance = acceptance;
    self->socket = -1;
    self->events = -1;
    self->flight.outcome = CANOPY_CAN_ABORTED; /* nothing is with the kernel */
    self->may_switch = canopy_socketcan_may_switch();
    error = canopy_socketcan_bind(self);
    if (error == CANOPY_OK) {
        (void)canopy_socketcan_state(self);
    }
    return error;
}
