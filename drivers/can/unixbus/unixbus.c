/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Virtual CAN bus over Unix datagram sockets; the contract is in unixbus.h, the protocol in docs/unixbus.md.
 */
#include "canopy/can/unixbus.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include "unixbus_internal.h"

enum { LOOK_US = 100000, RETRY_US = 10000 };

/* Counting up an eventfd cannot fail but by overflow of the 64-bit count, and then the waiter is awake already. */
static void count_up(int event)
{
    const uint64_t one = 1;
    const ssize_t written = write(event, &one, sizeof one);
    (void)written;
}

static void clear(int event)
{
    uint64_t events;
    const ssize_t cleared = read(event, &events, sizeof events);
    (void)cleared;
}

static void take_datagram(canopy_unixbus_t *self, const uint8_t *datagram, size_t size, int64_t arrived)
{
    canopy_can_frame_t frame;
    if (!canopy_unixbus_decode(&frame, datagram, size)) {
        atomic_fetch_add_explicit(&self->malformed, 1u, memory_order_relaxed);
        return;
    }
    atomic_fetch_add_explicit(&self->lost, datagram[CANOPY_UNIXBUS_LOST], memory_order_relaxed);
    frame.time = (canopy_time_t)arrived / 1000u;
    if ((frame.flags & CANOPY_CAN_ERROR) != 0) {
        atomic_fetch_add_explicit(&self->error_frames, 1u, memory_order_relaxed);
    }
    if (canopy_can_accepts(self->acceptance, &frame) && canopy_ring_push(&self->queue, &frame)) {
        count_up(self->event);
    }
}

/* A union, because the control buffer must be aligned for its header. */
typedef union {
    struct cmsghdr align;
    char bytes[CMSG_SPACE(sizeof(struct timespec))];
} control_t;

/** The kernel's stamp, from when the sender sent [ns]; 0: there is none. */
static int64_t stamp_of(struct msghdr *message)
{
    struct cmsghdr *control = CMSG_FIRSTHDR(message);
    struct timespec stamp = {0};

    if (control != NULL && control->cmsg_level == SOL_SOCKET && control->cmsg_type == SCM_TIMESTAMPNS) {
        memcpy(&stamp, CMSG_DATA(control), sizeof stamp);
    }
    return (int64_t)stamp.tv_sec * INT64_C(1000000000) + stamp.tv_nsec;
}

/** Takes a datagram, or finds that the queue is empty: whatever comes later arrived later. @return as recvmsg() */
static ssize_t take_next(canopy_unixbus_t *self)
{
    uint8_t datagram[CANOPY_UNIXBUS_DATAGRAM_MAX + 1u]; /* one more: what is too long must not look right */
    control_t control;
    struct iovec part = {.iov_base = datagram, .iov_len = sizeof datagram};
    struct msghdr message = {
        .msg_iov = &part, .msg_iovlen = 1, .msg_control = control.bytes, .msg_controllen = sizeof control.bytes};
    const int64_t before = canopy_arrival_monotonic();
    const ssize_t size = recvmsg(self->socket, &message, MSG_DONTWAIT);
    const int number = errno;
    const canopy_arrival_clocks_t clocks = canopy_arrival_clocks(before);

    canopy_arrival_look(&self->arrival, &clocks);
    if (size >= 0) { /* also an empty one: of a socket that was shut down recvmsg() says EAGAIN */
        take_datagram(self, datagram, (size_t)size,
                      canopy_arrival_of(&self->arrival, stamp_of(&message), clocks.after));
    } else if (size < 0 && number == EAGAIN) {
        self->arrival.empty_at = before;
    }
    errno = number;
    return size;
}

/**
 * Waits for a frame, for something to send, or until it is time to try again what could not be sent.
 *
 * Never for ever: a poll() that is woken while unixbus_restart() puts another socket under the number looks at the new one,
 * and goes on waiting for the old one.
 */
static void wait_for_work(const canopy_unixbus_t *self, canopy_unixbus_waiting_t *behind, int64_t timeout_us,
                          bool can_receive)
{
    enum { OWN = 2 };
    struct pollfd descriptors[OWN + CANOPY_UNIXBUS_PEERS_MAX];
    const int64_t us = timeout_us < 0 || timeout_us > LOOK_US ? LOOK_US : timeout_us;
    const struct timespec timeout = {.tv_sec = (time_t)(us / 1000000), .tv_nsec = (long)(us % 1000000) * 1000L};

    descriptors[0] = (struct pollfd){.fd = self->work, .events = POLLIN};
    descriptors[1] = (struct pollfd){.fd = can_receive ? self->socket : -1, .events = POLLIN};
    memcpy(&descriptors[OWN], behind->sockets, behind->count * sizeof descriptors[0]);
    if (ppoll(descriptors, OWN + behind->count, &timeout, NULL) < 0 && errno != EINTR) {
        (void)nanosleep(&(struct timespec){.tv_nsec = RETRY_US * 1000L}, NULL);
    }
    memcpy(behind->sockets, &descriptors[OWN], behind->count * sizeof descriptors[0]);
}

static bool somebody_has_room(const canopy_unixbus_waiting_t *behind)
{
    for (size_t i = 0; i < behind->count; i++) {
        if (behind->sockets[i].revents != 0) {
            return true;
        }
    }
    return false;
}

/** The receive "interrupt", and the way out for what could not be sent at once. */
static void *receive_thread(void *context)
{
    canopy_unixbus_t *self = context;
    canopy_unixbus_waiting_t behind = {.count = 0};
    int64_t catch_up_at = 0;

    while (!atomic_load(&self->stopping)) {
        int64_t left = -1;
        const bool taken = take_next(self) >= 0 || errno == EINTR;
        const bool failed = !taken && errno != EAGAIN;
        if (failed) { /* for want of memory, for example: it is told, and passes */
            atomic_store(&self->failure, errno);
            count_up(self->event);
        }
        clear(self->work);
        if (atomic_load(&self->tx.is_behind)) { /* also while frames come without end */
            left = catch_up_at - canopy_unixbus_now();
            if (left <= 0 || somebody_has_room(&behind)) {
                left = canopy_unixbus_tx_catch_up(&self->tx, &behind);
                catch_up_at = canopy_unixbus_now() + left;
            }
        } else {
            behind.count = 0;
            catch_up_at = 0;
        }
        if (!taken) {
            wait_for_work(self, &behind, failed && (left < 0 || left > RETRY_US) ? RETRY_US : left, !failed);
        }
    }
    return NULL;
}

static int unixbus_receive(void *context, canopy_can_frame_t *frame)
{
    canopy_unixbus_t *self = context;
    if (canopy_ring_pop(&self->queue, frame)) {
        self->received++;
        return 1;
    }
    return atomic_exchange(&self->failure, 0) == 0 ? 0 : CANOPY_ERROR_IO;
}

static int unixbus_wait(void *context, uint32_t timeout_us)
{
    canopy_unixbus_t *self = context;
    const int64_t end = canopy_unixbus_now() + timeout_us;
    for (;;) {
        /* Cleared before the look at the queue: a frame that comes after the look counts the event up again. */
        clear(self->event);
        if (canopy_ring_count(&self->queue) > 0u) {
            return 1;
        }
        if (atomic_exchange(&self->failure, 0) != 0) {
            return CANOPY_ERROR_IO;
        }
        const int64_t left = end - canopy_unixbus_now();
        if (left <= 0) {
            return 0;
        }
        const struct timespec timeout = {.tv_sec = (time_t)(left / 1000000), .tv_nsec = (long)(left % 1000000) * 1000L};
        struct pollfd descriptor = {.fd = self->event, .events = POLLIN};
        if (ppoll(&descriptor, 1, &timeout, NULL) < 0) {
            return errno == EINTR ? 0 : CANOPY_ERROR_IO;
        }
    }
}

static int unixbus_send(void *context, uint8_t mailbox, const canopy_can_frame_t *frame)
{
    canopy_unixbus_t *self = context;
    (void)mailbox;
    const int result = canopy_unixbus_tx_send(&self->tx, frame);
    if (atomic_load(&self->tx.is_behind)) {
        count_up(self->work);
    }
    return result;
}

static canopy_can_controller_t unixbus_state(void *context)
{
    canopy_unixbus_t *self = context;

    return canopy_unixbus_tx_is_joined(&self->tx) ? CANOPY_CAN_CONTROLLER_ACTIVE : CANOPY_CAN_CONTROLLER_GONE;
}

static void unixbus_stats(void *context, canopy_can_stats_t *stats)
{
    const canopy_unixbus_t *self = context;
    *stats = (canopy_can_stats_t){
        .received = self->received,
        .sent = atomic_load_explicit(&self->tx.sent, memory_order_relaxed),
        .rx_dropped = canopy_ring_dropped(&self->queue) + atomic_load_explicit(&self->lost, memory_order_relaxed),
        .tx_dropped = atomic_load_explicit(&self->tx.dropped, memory_order_relaxed),
        .error_frames = atomic_load_explicit(&self->error_frames, memory_order_relaxed),
        .rx_high_water = canopy_ring_high_water(&self->queue),
    };
}

/**
 * A socket whose datagrams are stamped; where that cannot be had (qemu-user), a frame counts as having arrived when the
 * queue was last empty. @return its number, or negative with errno
 */
static int make_socket(void)
{
    const int on = 1;
    const int made = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);

    if (made >= 0) {
        (void)setsockopt(made, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on);
    }
    return made;
}

/** Joins again, in a folder that is made anew. The thread goes on with a new socket under the old one's number. */
static void unixbus_restart(void *context)
{
    canopy_unixbus_t *self = context;
    const int made = unixbus_state(self) == CANOPY_CAN_CONTROLLER_GONE ? make_socket() : -1;

    if (made < 0) {
        return;
    }
    (void)pthread_mutex_lock(&self->tx.lock);
    const struct sockaddr_un left = self->tx.folder.own;
    canopy_unixbus_folder_clear(&self->tx.folder);
    if (canopy_unixbus_folder_init(&self->tx.folder, self->bus) == CANOPY_OK &&
        canopy_unixbus_folder_join(&self->tx.folder, made) == CANOPY_OK) {
        (void)unlink(left.sun_path);
        (void)shutdown(self->socket, SHUT_RD); /* wakes the thread, which else would wait at the old one for ever */
        (void)dup3(made, self->socket, O_CLOEXEC);
    }
    (void)pthread_mutex_unlock(&self->tx.lock);
    (void)close(made);
}

/* The thread starts with all signals blocked: they are for the loop's thread, whose sleep they shall end. */
static canopy_error_t start_thread(canopy_unixbus_t *self)
{
    sigset_t all;
    sigset_t before;
    (void)sigfillset(&all);
    int number = pthread_sigmask(SIG_SETMASK, &all, &before);
    if (number == 0) {
        number = pthread_create(&self->thread, NULL, receive_thread, self);
        (void)pthread_sigmask(SIG_SETMASK, &before, NULL);
    }
    errno = number;
    return number == 0 ? CANOPY_OK : CANOPY_ERROR_IO;
}

static void close_descriptors(canopy_unixbus_t *self)
{
    int *const descriptors[] = {&self->event, &self->work, &self->socket};
    for (size_t i = 0; i < sizeof descriptors / sizeof descriptors[0]; i++) {
        if (*descriptors[i] >= 0) {
            (void)close(*descriptors[i]);
            *descriptors[i] = -1;
        }
    }
}

static canopy_error_t join_bus(canopy_unixbus_t *self)
{
    self->socket = make_socket();
    self->event = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    self->work = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (self->socket < 0 || self->event < 0 || self->work < 0) {
        return CANOPY_ERROR_IO;
    }
    canopy_error_t error = canopy_unixbus_folder_join(&self->tx.folder, self->socket);
    if (error != CANOPY_OK) {
        return error;
    }
    error = start_thread(self);
    if (error != CANOPY_OK) {
        (void)unlink(self->tx.folder.own.sun_path);
    }
    return error;
}

canopy_error_t canopy_unixbus_open(canopy_unixbus_t *self, const char *bus, const canopy_can_acceptance_t *acceptance)
{
    const canopy_arrival_clocks_t clocks = canopy_arrival_clocks(canopy_arrival_monotonic());

    if (self == NULL || bus == NULL || !canopy_can_acceptance_is_valid(acceptance)) {
        errno = EINVAL;
        return CANOPY_ERROR_ARGUMENT;
    }
    self->can = (canopy_can_t){
        .context = self,
        .receive = unixbus_receive,
        .send = unixbus_send,
        .state = unixbus_state,
        .restart = unixbus_restart,
        .wait = unixbus_wait,
        .stats = unixbus_stats,
        .mailboxes = 1,
        .is_filtered = !canopy_can_accepts_everything(acceptance),
    };
    self->acceptance = acceptance;
    (void)strncpy(self->bus, bus, sizeof self->bus - 1u); /* a longer one fits no socket: it is refused below */
    self->bus[sizeof self->bus - 1u] = '\0';
    canopy_arrival_start(&self->arrival, &clocks);
    self->socket = -1;
    self->event = -1;
    self->work = -1;
    atomic_init(&self->stopping, false);
    atomic_init(&self->failure, 0);
    atomic_init(&self->malformed, 0u);
    atomic_init(&self->lost, 0u);
    atomic_init(&self->error_frames, 0u);
    self->received = 0u;
    canopy_error_t error = canopy_ring_init(&self->queue, self->storage, sizeof self->storage, sizeof self->storage[0],
                                            CANOPY_UNIXBUS_FRAMES);
    if (error == CANOPY_OK) {
        error = canopy_unixbus_tx_open(&self->tx, bus);
    }
    if (error != CANOPY_OK) {
        return error;
    }
    error = join_bus(self);
    if (error != CANOPY_OK) {
        const int number = errno;
        close_descriptors(self);
        canopy_unixbus_tx_close(&self->tx);
        errno = number;
    }
    return error;
}

void canopy_unixbus_close(canopy_unixbus_t *self)
{
    if (self->socket < 0) {
        return;
    }
    canopy_unixbus_tx_finish(&self->tx);
    (void)unlink(self->tx.folder.own.sun_path);
    atomic_store(&self->stopping, true);
    (void)shutdown(self->socket, SHUT_RD);
    count_up(self->work);
    (void)pthread_join(self->thread, NULL);
    close_descriptors(self);
    canopy_unixbus_tx_close(&self->tx);
}

uint32_t canopy_unixbus_malformed(const canopy_unixbus_t *self)
{
    return atomic_load_explicit(&self->malformed, memory_order_relaxed);
}
