/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The unixbus's way out: one socket for each other participant, and the newest frames for those that are full just now.
 *
 * The loop's thread sends a frame to everybody who has got all before it. Who is behind is the other thread's to serve: so
 * a send costs the loop one call for each participant that keeps up, and nothing for one that does not. Nor does it wait for
 * the other thread, which may have been stopped by the scheduler while it has the lock.
 */
#include <errno.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "unixbus_internal.h"

enum { FIRST_PAUSE_US = 1000, LONGEST_PAUSE_US = 16000, AT_ONCE = 32, FINISH_STEP_NS = 1000000 };

typedef enum { TAKEN, FULL, GONE } delivery_t;

int64_t canopy_unixbus_now(void)
{
    return canopy_arrival_monotonic() / 1000;
}

/* With the loop's priority where the loop has to wait for it, which it does only to join again and to close. */
static int make_lock(pthread_mutex_t *lock)
{
    pthread_mutexattr_t attributes;
    int number = pthread_mutexattr_init(&attributes);

    if (number == 0) {
        (void)pthread_mutexattr_setprotocol(&attributes, PTHREAD_PRIO_INHERIT); /* where the kernel has it */
        number = pthread_mutex_init(lock, &attributes);
        (void)pthread_mutexattr_destroy(&attributes);
    }
    return number;
}

canopy_error_t canopy_unixbus_tx_open(canopy_unixbus_tx_t *self, const char *bus)
{
    const canopy_error_t error = canopy_unixbus_folder_init(&self->folder, bus);
    if (error != CANOPY_OK) {
        return error;
    }
    self->head = 0u;
    atomic_init(&self->sent, 0u);
    atomic_init(&self->dropped, 0u);
    (void)canopy_ring_init(&self->inbox, self->waiting, sizeof self->waiting, sizeof self->waiting[0],
                           CANOPY_UNIXBUS_INBOX); /* its arguments are right */
    atomic_init(&self->is_behind, false);
    atomic_init(&self->nobody_takes, false);
    errno = make_lock(&self->lock);
    return errno == 0 ? CANOPY_OK : CANOPY_ERROR_IO;
}

void canopy_unixbus_tx_close(canopy_unixbus_tx_t *self)
{
    canopy_unixbus_folder_clear(&self->folder);
    (void)pthread_mutex_destroy(&self->lock);
}

/** Everything that is neither the participant's end nor its absence passes: it is tried again. */
static delivery_t failed(int number)
{
    switch (number) {
    case ECONNREFUSED: /* nobody holds the socket any more */
    case ENOENT:       /* it is leaving the bus in good order */
    case EPIPE:
    case ECONNRESET:
    case ENOTCONN:
    case EPROTOTYPE: /* a socket of another kind: no participant */
    case ENOTSOCK:
        return GONE;
    default:
        return FULL;
    }
}

/* A link could lead out of the bus, to whoever reads a socket elsewhere. */
static delivery_t connect_to(canopy_unixbus_peer_t *peer, const struct sockaddr_un *address)
{
    struct stat status;
    if (lstat(address->sun_path, &status) == 0 && !S_ISSOCK(status.st_mode)) {
        errno = ENOTSOCK;
        return GONE;
    }
    const int made = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (made < 0) {
        return FULL;
    }
    if (connect(made, (const struct sockaddr *)address, sizeof *address) != 0) {
        const int number = errno;
        (void)close(made);
        errno = number;
        return failed(number);
    }
    peer->socket = made;
    return TAKEN;
}

static delivery_t deliver(canopy_unixbus_tx_t *self, canopy_unixbus_peer_t *peer, const canopy_unixbus_sent_t *frame)
{
    uint8_t datagram[CANOPY_UNIXBUS_DATAGRAM_MAX];
    struct sockaddr_un address;
    const uint8_t told = peer->untold > UINT8_MAX ? UINT8_MAX : (uint8_t)peer->untold;
    delivery_t delivery = TAKEN;

    if (!canopy_unixbus_folder_address(&self->folder, peer->name, &address)) {
        return GONE; /* nobody can have bound a name that does not fit */
    }
    if (peer->socket < 0) {
        delivery = connect_to(peer, &address);
    }
    if (delivery == TAKEN) {
        memcpy(datagram, frame->datagram, frame->size);
        datagram[CANOPY_UNIXBUS_LOST] = told;
        if (send(peer->socket, datagram, frame->size, MSG_NOSIGNAL | MSG_DONTWAIT) >= 0) {
            peer->untold -= told;
            return TAKEN;
        }
        delivery = failed(errno);
    }
    if (delivery == GONE && errno == ECONNREFUSED) {
        (void)unlink(address.sun_path); /* its owner died without closing */
    }
    return delivery;
}

static void count(_Atomic uint32_t *counter, uint32_t number)
{
    atomic_fetch_add_explicit(counter, number, memory_order_relaxed);
}

static void lose(canopy_unixbus_tx_t *self, canopy_unixbus_peer_t *peer, uint32_t frames)
{
    peer->next += frames;
    peer->untold = peer->untold > UINT32_MAX - frames ? UINT32_MAX : peer->untold + frames;
    peer->is_deaf = true;
    count(&self->dropped, frames);
}

/** Gives a participant what it has not got. @return false: it is gone */
static bool serve(canopy_unixbus_tx_t *self, canopy_unixbus_peer_t *peer, int64_t now)
{
    for (unsigned given = 0; given < AT_ONCE && peer->next != self->head;) {
        const uint32_t behind = self->head - peer->next;
        const canopy_unixbus_sent_t *frame = &self->frames[peer->next % CANOPY_UNIXBUS_BACKLOG];
        if (behind > CANOPY_UNIXBUS_BACKLOG) {
            lose(self, peer, behind - CANOPY_UNIXBUS_BACKLOG);
            continue;
        }
        if (now - frame->sent_at > CANOPY_UNIXBUS_LATE_US) {
            lose(self, peer, 1u);
            continue;
        }
        switch (deliver(self, peer, frame)) {
        case TAKEN:
            peer->next++;
            peer->pause_us = 0u;
            peer->is_deaf = false;
            given++;
            break;
        case FULL:
            peer->pause_us = peer->pause_us == 0u ? FIRST_PAUSE_US : 2u * peer->pause_us;
            peer->pause_us = peer->pause_us > LONGEST_PAUSE_US ? LONGEST_PAUSE_US : peer->pause_us;
            peer->retry_at = now + peer->pause_us;
            return true;
        case GONE:
            return false;
        }
    }
    return true;
}

static bool is_due(const canopy_unixbus_peer_t *peer, int64_t now)
{
    return peer->pause_us == 0u || now >= peer->retry_at;
}

/** What became of a frame. */
typedef struct {
    bool taken;  /* somebody has it */
    bool coming; /* somebody who takes frames will get it soon */
    bool behind; /* somebody has not got it */
} spread_t;

/** Gives everybody the newest frame who has got all others. */
static spread_t spread(canopy_unixbus_tx_t *self, int64_t now)
{
    spread_t result = {0};
    for (size_t i = 0; i < self->folder.count;) {
        canopy_unixbus_peer_t *peer = &self->folder.peers[i];
        const bool keeps_up = peer->next + 1u == self->head;
        if (keeps_up && is_due(peer, now) && !serve(self, peer, now)) {
            canopy_unixbus_folder_forget(&self->folder, i);
            continue;
        }
        result.taken |= peer->next == self->head;
        result.coming |= !peer->is_deaf;
        result.behind |= peer->next != self->head;
        i++;
    }
    return result;
}

static int send_locked(canopy_unixbus_tx_t *self, const canopy_can_frame_t *frame)
{
    canopy_unixbus_sent_t *place = &self->frames[self->head % CANOPY_UNIXBUS_BACKLOG];
    const int64_t now = canopy_unixbus_now();
    const canopy_error_t error = canopy_unixbus_folder_refresh(&self->folder, self->head);
    if (error != CANOPY_OK) {
        count(&self->dropped, 1u);
        return error;
    }
    place->sent_at = now;
    place->size = (uint8_t)canopy_unixbus_encode(place->datagram, frame);
    self->head++;
    const spread_t result = spread(self, now);
    const bool nobody = self->folder.count > 0u && !result.taken && !result.coming;
    atomic_store(&self->nobody_takes, nobody);
    if (nobody) {
        self->head--; /* nobody has it, so it is not out */
        return 0;
    }
    count(&self->dropped, self->folder.too_many ? 1u : 0u);
    count(&self->sent, 1u);
    if (result.behind) {
        atomic_store(&self->is_behind, true);
    }
    return 1;
}

/** What the loop has left while somebody else had the lock. It was called sent: what nobody takes now is lost. */
static void empty_inbox(canopy_unixbus_tx_t *self)
{
    canopy_can_frame_t frame;
    while (canopy_ring_pop(&self->inbox, &frame)) {
        if (send_locked(self, &frame) == 0) {
            count(&self->dropped, 1u);
        }
    }
}

int canopy_unixbus_tx_send(canopy_unixbus_tx_t *self, const canopy_can_frame_t *frame)
{
    int result;
    if (!canopy_can_frame_can_be_sent(frame)) {
        count(&self->dropped, 1u);
        return CANOPY_ERROR_ARGUMENT;
    }
    if (pthread_mutex_trylock(&self->lock) == 0) {
        empty_inbox(self);
        result = send_locked(self, frame);
        (void)pthread_mutex_unlock(&self->lock);
        return result;
    }
    if (atomic_load(&self->nobody_takes)) {
        return 0;
    }
    result = canopy_ring_push(&self->inbox, frame) ? 1 : 0;
    atomic_store(&self->is_behind, true);
    return result;
}

static bool has_room(const canopy_unixbus_waiting_t *waiting, int socket)
{
    for (size_t i = 0; i < waiting->count; i++) {
        if (waiting->sockets[i].fd == socket) {
            return waiting->sockets[i].revents != 0;
        }
    }
    return false;
}

/* The lock is given back after each participant, so that the loop finds it free. */
int64_t canopy_unixbus_tx_catch_up(canopy_unixbus_tx_t *self, canopy_unixbus_waiting_t *waiting)
{
    static const int64_t never = INT64_MAX;
    int64_t soonest = never;
    const int64_t now = canopy_unixbus_now();
    canopy_unixbus_waiting_t behind;
    bool is_there = true;

    behind.count = 0;
    atomic_store(&self->is_behind, false); /* set again by whoever is found behind, here or by the loop meanwhile */
    for (size_t i = 0; is_there;) {
        (void)pthread_mutex_lock(&self->lock);
        empty_inbox(self);
        canopy_unixbus_peer_t *peer = &self->folder.peers[i];
        is_there = i < self->folder.count;
        if (is_there && peer->next != self->head && (is_due(peer, now) || has_room(waiting, peer->socket)) &&
            !serve(self, peer, now)) {
            canopy_unixbus_folder_forget(&self->folder, i); /* the last one has its place now */
        } else if (is_there) {
            if (peer->next != self->head) {
                const int64_t left = peer->pause_us == 0u ? 0 : peer->retry_at - now;
                soonest = left < soonest ? left : soonest;
                behind.sockets[behind.count++] = (struct pollfd){.fd = peer->socket, .events = POLLOUT};
            }
            i++;
        }
        (void)pthread_mutex_unlock(&self->lock);
    }
    *waiting = behind;
    if (soonest == never) {
        return -1;
    }
    atomic_store(&self->is_behind, true);
    return soonest;
}

void canopy_unixbus_tx_finish(canopy_unixbus_tx_t *self)
{
    const int64_t end = canopy_unixbus_now() + CANOPY_UNIXBUS_LATE_US;
    bool coming = true;

    while (coming && canopy_unixbus_now() < end) {
        coming = false;
        (void)pthread_mutex_lock(&self->lock);
        empty_inbox(self);
        for (size_t i = 0; i < self->folder.count; i++) {
            const canopy_unixbus_peer_t *peer = &self->folder.peers[i];
            coming |= peer->next != self->head && !peer->is_deaf;
        }
        (void)pthread_mutex_unlock(&self->lock);
        if (coming) {
            (void)nanosleep(&(struct timespec){.tv_nsec = FINISH_STEP_NS}, NULL);
        }
    }
}

bool canopy_unixbus_tx_is_joined(canopy_unixbus_tx_t *self)
{
    if (pthread_mutex_trylock(&self->lock) != 0) {
        return true; /* the other thread is at work on it; it is asked again soon */
    }
    const bool result = canopy_unixbus_folder_refresh(&self->folder, self->head) != CANOPY_ERROR_BUS_DOWN;
    (void)pthread_mutex_unlock(&self->lock);
    return result;
}
