/* SPDX-License-Identifier: MIT */
/**
 * @file
 * CAN driver for Linux SocketCAN; the contract is in socketcan.h, the kernel's in its documentation of CAN.
 */
#include "canopy/can/socketcan.h"

#include <errno.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

/* About 1,300 classic frames, 200 ms of a full 1 Mbit/s bus (the default buffer holds 278 frames). */
#define RECEIVE_BUFFER_BYTES (1024 * 1024)

static int error_of_errno(int number)
{
    switch (number) {
    case ENETDOWN: /* the link is down, or the controller is bus-off */
    case ENETUNREACH:
    case ENODEV: /* the interface is gone */
    case ENXIO:
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

static void take_control_data(canopy_socketcan_t *self, struct msghdr *message)
{
    for (struct cmsghdr *control = CMSG_FIRSTHDR(message); control != NULL; control = CMSG_NXTHDR(message, control)) {
        if (control->cmsg_level != SOL_SOCKET) {
            continue;
        }
        if (control->cmsg_type == SO_RXQ_OVFL) {
            /* The kernel's count since the socket was made. */
            memcpy(&self->stats.rx_dropped, CMSG_DATA(control), sizeof self->stats.rx_dropped);
        } else if (control->cmsg_type == SCM_TIMESTAMPNS) {
            struct timespec stamp;
            memcpy(&stamp, CMSG_DATA(control), sizeof stamp);
            self->last_frame_ns = (uint64_t)stamp.tv_sec * UINT64_C(1000000000) + (uint64_t)stamp.tv_nsec;
        }
    }
}

static int socketcan_receive(void *context, canopy_can_frame_t *frame)
{
    canopy_socketcan_t *self = context;
    for (;;) {
        struct canfd_frame raw;
        /* A union, because the control buffer must be aligned for its headers. */
        union {
            struct cmsghdr align;
            char bytes[CMSG_SPACE(sizeof(uint32_t)) + CMSG_SPACE(sizeof(struct timespec))];
        } control;
        struct iovec part = {.iov_base = &raw, .iov_len = sizeof raw};
        struct msghdr message = {
            .msg_iov = &part, .msg_iovlen = 1, .msg_control = control.bytes, .msg_controllen = sizeof control.bytes};
        const ssize_t size = recvmsg(self->socket, &message, MSG_DONTWAIT);
        if (size < 0) {
            if (errno == EINTR) {
                continue;
            }
            return errno == EAGAIN || errno == EWOULDBLOCK ? 0 : error_of_errno(errno);
        }
        take_control_data(self, &message);
        if (size != (ssize_t)CAN_MTU && size != (ssize_t)CANFD_MTU) {
            return CANOPY_ERROR_IO; /* not to be had from a socket that has not asked for CAN XL */
        }
        if ((raw.can_id & CAN_ERR_FLAG) != 0u) {
            self->stats.error_frames++;
            if (!self->error_frames) {
                continue;
            }
        }
        frame_from_kernel(frame, &raw, size == (ssize_t)CANFD_MTU);
        self->stats.received++;
        return 1;
    }
}

static int write_frame(const canopy_socketcan_t *self, const canopy_can_frame_t *frame)
{
    struct canfd_frame raw;
    if (!canopy_can_frame_can_be_sent(frame)) {
        return CANOPY_ERROR_ARGUMENT;
    }
    if ((frame->flags & CANOPY_CAN_FD) != 0 && !self->fd_frames) {
        return CANOPY_ERROR_UNSUPPORTED;
    }
    const size_t size = frame_to_kernel(&raw, frame);
    ssize_t written;
    do {
        written = send(self->socket, &raw, size, MSG_DONTWAIT);
    } while (written < 0 && errno == EINTR);
    if (written < 0) {
        return errno == ENOBUFS || errno == EAGAIN || errno == EWOULDBLOCK ? 0 : error_of_errno(errno);
    }
    return written == (ssize_t)size ? 1 : CANOPY_ERROR_IO;
}

static int socketcan_send(void *context, uint8_t mailbox, const canopy_can_frame_t *frame)
{
    (void)mailbox;
    canopy_socketcan_t *self = context;
    const int result = write_frame(self, frame);
    if (result == 1) {
        self->stats.sent++;
    } else {
        self->stats.tx_dropped++;
    }
    return result;
}

static int socketcan_wait(void *context, uint32_t timeout_us)
{
    const canopy_socketcan_t *self = context;
    const struct timespec timeout = {.tv_sec = (time_t)(timeout_us / 1000000u),
                                     .tv_nsec = (long)(timeout_us % 1000000u) * 1000L};
    struct pollfd descriptor = {.fd = self->socket, .events = POLLIN};
    const int ready = ppoll(&descriptor, 1, &timeout, NULL);
    if (ready < 0) {
        return errno == EINTR ? 0 : CANOPY_ERROR_IO;
    }
    if ((descriptor.revents & POLLIN) != 0 || ready == 0) {
        return ready;
    }
    /* POLLERR alone. Fetching the error clears it, so that the next wait blocks again. */
    int number = 0;
    socklen_t length = sizeof number;
    if (getsockopt(self->socket, SOL_SOCKET, SO_ERROR, &number, &length) != 0 || number == 0) {
        return CANOPY_ERROR_IO;
    }
    return error_of_errno(number);
}

static void socketcan_stats(void *context, canopy_can_stats_t *stats)
{
    const canopy_socketcan_t *self = context;
    *stats = self->stats;
}

static bool set_option(int descriptor, int level, int name, const void *value, size_t size)
{
    return setsockopt(descriptor, level, name, value, (socklen_t)size) == 0;
}

static bool set_filters(int descriptor, const canopy_can_acceptance_t *acceptance)
{
    struct can_filter filters[CANOPY_CAN_ACCEPT_MAX];
    size_t count = 0;

    if (canopy_can_accepts_everything(acceptance)) {
        return true; /* the kernel's default: every data and remote frame */
    }
    for (const canopy_can_acceptance_t *list = acceptance; list != NULL; list = list->next) {
        for (uint16_t index = 0; index < list->count; index++) {
            const bool extended = (list->ids[index] & CANOPY_CAN_ACCEPT_EXTENDED) != 0u;

            filters[count].can_id = list->ids[index];
            filters[count].can_mask = CAN_EFF_FLAG | (extended ? CAN_EFF_MASK : CAN_SFF_MASK);
            count++;
        }
    }
    return set_option(descriptor, SOL_CAN_RAW, CAN_RAW_FILTER, filters, count * sizeof filters[0]);
}

/** Options that must be set before the socket is bound, so that no frame comes unfiltered or without its data. */
static canopy_error_t configure(canopy_socketcan_t *self, const char *interface,
                                const canopy_can_acceptance_t *acceptance)
{
    const int on = 1;
    const int buffer = RECEIVE_BUFFER_BYTES;
    const can_err_mask_t errors = CAN_ERR_MASK;
    struct ifreq request = {0};
    (void)strncpy(request.ifr_name, interface, sizeof request.ifr_name - 1u);
    if (ioctl(self->socket, SIOCGIFMTU, &request) != 0) {
        return CANOPY_ERROR_IO;
    }
    self->fd_frames = request.ifr_mtu >= (int)CANFD_MTU;
    if (self->fd_frames && !set_option(self->socket, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof on)) {
        return CANOPY_ERROR_IO;
    }
    /* Only root may go beyond net.core.rmem_max; what the kernel grants to others is no error, losses are counted. */
    if (!set_option(self->socket, SOL_SOCKET, SO_RCVBUFFORCE, &buffer, sizeof buffer) &&
        !set_option(self->socket, SOL_SOCKET, SO_RCVBUF, &buffer, sizeof buffer)) {
        return CANOPY_ERROR_IO;
    }
    if (!set_option(self->socket, SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on) ||
        !set_option(self->socket, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on) ||
        !set_option(self->socket, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof errors) ||
        !set_filters(self->socket, acceptance)) {
        return CANOPY_ERROR_IO;
    }
    return CANOPY_OK;
}

static canopy_error_t bind_to(canopy_socketcan_t *self, unsigned index)
{
    struct sockaddr_can address = {.can_family = AF_CAN, .can_ifindex = (int)index};
    if (bind(self->socket, (const struct sockaddr *)&address, sizeof address) == 0) {
        return CANOPY_OK;
    }
    /* The kernel says ENODEV for an interface of another kind (lo, eth0). */
    return errno == ENODEV ? CANOPY_ERROR_UNSUPPORTED : CANOPY_ERROR_IO;
}

canopy_error_t canopy_socketcan_open(canopy_socketcan_t *self, const char *interface,
                                     const canopy_can_acceptance_t *acceptance)
{
    if (self == NULL || interface == NULL || interface[0] == '\0' || strlen(interface) >= IFNAMSIZ ||
        !canopy_can_acceptance_is_valid(acceptance)) {
        return CANOPY_ERROR_ARGUMENT;
    }
    *self = (canopy_socketcan_t){
        .can = {.context = self,
                .receive = socketcan_receive,
                .send = socketcan_send,
                .wait = socketcan_wait,
                .stats = socketcan_stats},
        .error_frames = acceptance != NULL && acceptance->error_frames,
    };
    self->socket = socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW);
    if (self->socket < 0) {
        return errno == EAFNOSUPPORT || errno == EPROTONOSUPPORT ? CANOPY_ERROR_UNSUPPORTED : CANOPY_ERROR_IO;
    }
    const unsigned index = if_nametoindex(interface);
    canopy_error_t error = index == 0u ? CANOPY_ERROR_NOT_FOUND : configure(self, interface, acceptance);
    if (error == CANOPY_OK) {
        error = bind_to(self, index);
    }
    if (error != CANOPY_OK) {
        const int number = errno;
        canopy_socketcan_close(self);
        errno = number;
    }
    return error;
}

void canopy_socketcan_close(canopy_socketcan_t *self)
{
    if (self->socket >= 0) {
        (void)close(self->socket);
        self->socket = -1;
    }
}
