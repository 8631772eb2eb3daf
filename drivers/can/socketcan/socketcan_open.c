/* SPDX-License-Identifier: MIT */
/** @file The driver's two sockets: one for the frames, one for error frames and the echo of what is sent. */
#include <errno.h>
#include <fcntl.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include "socketcan_internal.h"

/* About 1,300 classic frames, 200 ms of a full 1 Mbit/s bus (the default buffer holds 278 frames). */
#define RECEIVE_BUFFER_BYTES (1024 * 1024)

/* The first looks at the clocks, of which the closest counts. */
enum { FIRST_LOOKS = 8 };

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

static bool accepts_errors(const canopy_can_acceptance_t *acceptance)
{
    for (const canopy_can_acceptance_t *list = acceptance; list != NULL; list = list->next) {
        if (list->error_frames) {
            return true;
        }
    }
    return false;
}

bool canopy_socketcan_listen(canopy_socketcan_t *self)
{
    struct can_filter filters[CANOPY_CAN_ACCEPT_MAX];

    for (uint16_t index = 0; index < self->echo_count; index++) {
        const bool extended = (self->echo_ids[index] & CAN_EFF_FLAG) != 0u;

        filters[index].can_id = self->echo_ids[index];
        filters[index].can_mask = CAN_EFF_FLAG | CAN_RTR_FLAG | (extended ? CAN_EFF_MASK : CAN_SFF_MASK);
    }
    return set_option(self->events, SOL_CAN_RAW, CAN_RAW_FILTER, filters, self->echo_count * sizeof filters[0]);
}

/** What must be set before the first socket is bound, so that no frame comes unfiltered or without its data. */
static bool configure_frames(int descriptor, const canopy_can_acceptance_t *acceptance)
{
    const int on = 1;
    const int buffer = RECEIVE_BUFFER_BYTES;
    const can_err_mask_t errors = accepts_errors(acceptance) ? CAN_ERR_MASK : 0u;

    /* Only root may go beyond net.core.rmem_max; what the kernel grants to others is no error, losses are counted. */
    return (set_option(descriptor, SOL_SOCKET, SO_RCVBUFFORCE, &buffer, sizeof buffer) ||
            set_option(descriptor, SOL_SOCKET, SO_RCVBUF, &buffer, sizeof buffer)) &&
           set_option(descriptor, SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on) &&
           set_option(descriptor, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on) &&
           set_option(descriptor, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof errors) &&
           set_filters(descriptor, acceptance);
}

/** The same of the second one: error frames, and no others until an echo is wanted. */
static bool configure_events(int descriptor)
{
    const can_err_mask_t errors = CAN_ERR_MASK;

    return set_option(descriptor, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof errors) &&
           set_option(descriptor, SOL_CAN_RAW, CAN_RAW_FILTER, NULL, 0);
}

static bool read_mtu(canopy_socketcan_t *self)
{
    const int on = 1;
    struct ifreq request = {0};

    (void)memcpy(request.ifr_name, self->name, strlen(self->name));
    if (ioctl(self->socket, SIOCGIFMTU, &request) != 0) {
        return false;
    }
    self->fd_frames = request.ifr_mtu >= (int)CANFD_MTU;
    return !self->fd_frames || (set_option(self->socket, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof on) &&
                                set_option(self->events, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof on));
}

static canopy_error_t bind_to(int descriptor, unsigned index)
{
    struct sockaddr_can address = {.can_family = AF_CAN, .can_ifindex = (int)index};

    if (bind(descriptor, (const struct sockaddr *)&address, sizeof address) == 0) {
        return CANOPY_OK;
    }
    /* The kernel says ENODEV for an interface of another kind (lo, eth0). */
    return errno == ENODEV ? CANOPY_ERROR_UNSUPPORTED : CANOPY_ERROR_IO;
}

/** Makes a socket, in the place of one that was open, so that its number stays. @return 0, or a number of errno.h. */
static int make_socket(int *descriptor)
{
    const int made = socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW);
    int number = made >= 0 ? 0 : errno;

    if (made >= 0 && *descriptor >= 0) {
        number = dup3(made, *descriptor, O_CLOEXEC) >= 0 ? 0 : errno;
        (void)close(made);
    } else if (made >= 0) {
        *descriptor = made;
    }
    return number;
}

static void start_clock(canopy_socketcan_t *self)
{
    canopy_arrival_clocks_t clocks = canopy_arrival_clocks(canopy_arrival_monotonic());

    canopy_arrival_start(&self->arrival, &clocks);
    for (unsigned look = 0; look < (unsigned)FIRST_LOOKS; look++) {
        clocks = canopy_arrival_clocks(canopy_arrival_monotonic());
        canopy_arrival_look(&self->arrival, &clocks);
    }
}

void canopy_socketcan_learn(canopy_socketcan_t *self)
{
    canopy_socketcan_link_t link = {.has_queue = true}; /* the worst, if the kernel does not say */

    (void)canopy_socketcan_ask_link(self->name, &link);
    self->controller = link.controller;
    self->is_controller = link.is_controller;
    self->restarts_itself = link.restarts_itself;
    self->knowledge = CANOPY_SOCKETCAN_AT_ONCE;
    if (link.has_echo) {
        self->knowledge = CANOPY_SOCKETCAN_BY_ECHO;
    } else if (link.has_queue) {
        self->knowledge = CANOPY_SOCKETCAN_BY_QUEUE;
    }
}

static void start(canopy_socketcan_t *self, unsigned index)
{
    self->index = index;
    self->link = CANOPY_CAN_CONTROLLER_DOWN; /* until the first look, which learns what it is */
    self->knowledge = CANOPY_SOCKETCAN_BY_QUEUE;
    self->next_look = 0;
    self->dropped_before = self->stats.rx_dropped;
    canopy_socketcan_lose_flight(self);
    start_clock(self);
}

static canopy_error_t open_sockets(canopy_socketcan_t *self, unsigned index)
{
    canopy_error_t error;
    int number = make_socket(&self->socket);

    if (number == 0) {
        number = make_socket(&self->events);
    }
    if (number != 0) {
        errno = number;
        return number == EAFNOSUPPORT || number == EPROTONOSUPPORT ? CANOPY_ERROR_UNSUPPORTED : CANOPY_ERROR_IO;
    }
    if (index == 0u) {
        errno = ENODEV;
        return CANOPY_ERROR_NOT_FOUND;
    }
    if (!read_mtu(self) || !configure_frames(self->socket, self->acceptance) || !configure_events(self->events) ||
        (self->echo_count > 0u && !canopy_socketcan_listen(self))) {
        return CANOPY_ERROR_IO;
    }
    error = bind_to(self->socket, index);
    return error == CANOPY_OK ? bind_to(self->events, index) : error;
}

/** Number of an interface; 0: there is none. */
static unsigned index_of(const char *name)
{
    canopy_socketcan_link_t link = {0};

    if (canopy_socketcan_ask_link(name, &link) == CANOPY_ERROR_UNSUPPORTED) {
        return if_nametoindex(name); /* may take long: see canopy_socketcan_ask_link() */
    }
    return link.index;
}

canopy_error_t canopy_socketcan_bind(canopy_socketcan_t *self)
{
    const bool first = self->socket < 0;
    const unsigned index = index_of(self->name);
    canopy_error_t error;

    if (!first && index == 0u) {
        return CANOPY_ERROR_NOT_FOUND;
    }
    error = open_sockets(self, index);
    if (error == CANOPY_OK) {
        start(self, index);
    } else if (first) {
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
    if (self->events >= 0) {
        (void)close(self->events);
        self->events = -1;
    }
}

const char *canopy_socketcan_advice(const canopy_socketcan_t *self, unsigned number)
{
    const char *texts[3];
    unsigned count = 0;

    if (self->link != CANOPY_CAN_CONTROLLER_ACTIVE) { /* and what it is, nobody can know yet */
        texts[count++] = "the interface is down: nothing is sent or received until `ip link set INTERFACE up`";
    } else if (self->knowledge == CANOPY_SOCKETCAN_BY_QUEUE) {
        texts[count++] =
            "the interface does not tell when a frame is out (no IFF_ECHO): when the bus is blocked, one frame in "
            "the kernel's queue and those in the adapter leave after their deadline; use an adapter that echoes";
    }
    if (self->is_controller && !self->restarts_itself && !self->may_switch) {
        texts[count++] =
            "after bus-off nobody restarts the controller: `ip link set INTERFACE type can restart-ms 100`, or "
            "give the program CAP_NET_ADMIN";
    }
    return number < count ? texts[number] : NULL;
}
