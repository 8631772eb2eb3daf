/* SPDX-License-Identifier: MIT */
/**
 * @file
 * A virtual CAN bus over Unix datagram sockets in a folder: needs neither root nor CAN in the kernel. The protocol, and
 * the rule that finds the folder of a bus name, are in docs/unixbus.md; the same bus is python-can's interface `canopy`.
 *
 * Threads: canopy_unixbus_open() starts a thread, the host's "receive interrupt": it moves frames from the socket into
 * a canopy_ring_t at once, because a socket's own queue holds few of them (net.unix.max_dgram_qlen), and blocks all
 * signals. Everything else is called from one thread, the loop's.
 *
 * Blocking: never. Each other participant is sent to through a socket of its own, so that what one does not read fills
 * no buffer that another one needs. A frame that a full participant does not take at once waits in the newest
 * CANOPY_UNIXBUS_BACKLOG frames, and the thread offers it again for CANOPY_UNIXBUS_LATE_US; then it is lost for that
 * participant (tx_dropped, once for each frame and participant), which is told with the next frame that it takes.
 *
 * Arrival: the kernel stamps a frame when it is sent; the stamp is brought to CLOCK_MONOTONIC, so that setting the wall clock
 * makes no frame younger. Use the loop with the posix clock.
 *
 * Transmission: what send() takes is out. When there are others and all of them have been losing frames and do not take
 * this one, send() gives 0, and the frame may be offered again.
 *
 * State: gone when the folder, or the own socket in it, was deleted; restart() makes them anew.
 *
 * Errors of the operating system: none lasts. A receive that failed is told once by receive() or wait(), and is tried again
 * 10 ms later; a folder that could not be read is read again at the next send.
 *
 * Memory: the object is the caller's (about 350 KiB: make it static), and one file descriptor for each other participant;
 * the operating system's thread and directory functions allocate.
 */
#ifndef CANOPY_CAN_UNIXBUS_H
#define CANOPY_CAN_UNIXBUS_H

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/un.h>
#include <time.h>

#include "canopy/acceptance.h"
#include "canopy/can.h"
#include "canopy/can/arrival.h"
#include "canopy/ring.h"
#include "canopy/status.h"

/** Frames that can wait for the loop; more are dropped and counted (rx_dropped). */
#define CANOPY_UNIXBUS_FRAMES 2048u

/** Most participants of a bus. One more is refused when it joins. A sender reaches no more; what it cannot reach counts
 * once for each frame in tx_dropped. */
#define CANOPY_UNIXBUS_PEERS_MAX 320u

/** Newest sent frames that are kept for participants that are full. */
#define CANOPY_UNIXBUS_BACKLOG 1024u

/** Frames that can wait while the driver's thread is at work on the list of participants. */
#define CANOPY_UNIXBUS_INBOX 1024u

/** How long a frame is offered to a participant that is full [us]: an old command must not arrive late. */
#define CANOPY_UNIXBUS_LATE_US 100000u

/** Bytes of a participant's name, "<pid>-<8 hex digits>.sock". */
#define CANOPY_UNIXBUS_NAME 28u

/** Another participant. Private. */
typedef struct {
    char name[CANOPY_UNIXBUS_NAME];
    int socket;        /* connected to it; -1: not yet */
    uint32_t next;     /* number of the frame that it gets next */
    uint32_t untold;   /* frames that it has lost and was not told of */
    uint32_t pause_us; /* between two tries while it is full; 0: it is not */
    int64_t retry_at;  /* [us] */
    bool is_deaf;      /* has lost frames, and has taken none since */
    bool is_listed;    /* seen when the folder was read last */
} canopy_unixbus_peer_t;

/** The folder as it was last read. Private. */
typedef struct {
    char path[sizeof(((struct sockaddr_un *)NULL)->sun_path)];
    struct sockaddr_un own;
    struct timespec modified; /* the folder's mtime when it was read */
    bool settled;             /* mtime was old enough then that no later change can bear the same */
    bool was_read;            /* at least once since the bus was joined */
    bool too_many;
    size_t count;
    canopy_unixbus_peer_t peers[CANOPY_UNIXBUS_PEERS_MAX];
} canopy_unixbus_folder_t;

/** A frame that was sent. Private. */
typedef struct {
    int64_t sent_at; /* [us] */
    uint8_t size;
    uint8_t datagram[8u + CANOPY_CAN_DATA_MAX];
} canopy_unixbus_sent_t;

/**
 * What was sent, and to whom it has still to go. Both threads work on it, under the lock; but the loop never waits for the
 * lock: what it cannot send itself it leaves in the inbox for the thread. Private.
 */
typedef struct {
    pthread_mutex_t lock;
    canopy_unixbus_folder_t folder;
    uint32_t head; /* number of the next frame */
    _Atomic uint32_t sent;
    _Atomic uint32_t dropped;
    canopy_ring_t inbox; /* from the loop to whoever has the lock */
    canopy_can_frame_t waiting[CANOPY_UNIXBUS_INBOX];
    atomic_bool is_behind;    /* somebody has not got all of it: the thread shall try again */
    atomic_bool nobody_takes; /* of the last frame */
    canopy_unixbus_sent_t frames[CANOPY_UNIXBUS_BACKLOG];
} canopy_unixbus_tx_t;

/** The driver's object. Owned by the caller, stays where it is while open; members but `can` are private. */
typedef struct {
    canopy_can_t can; /**< The driver: hand &unixbus.can to the loop. */
    const canopy_can_acceptance_t *acceptance;
    char bus[sizeof(((struct sockaddr_un *)NULL)->sun_path)]; /* as it was named */
    int socket;
    int event; /* eventfd that the thread counts up after each frame */
    int work;  /* eventfd that the loop counts up when the thread has something to send */
    pthread_t thread;
    atomic_bool stopping;
    atomic_int failure; /* errno of a receive that failed, until it was told */
    _Atomic uint32_t malformed;
    _Atomic uint32_t lost;    /* frames that senders say this participant has lost */
    canopy_arrival_t arrival; /* the thread's */
    _Atomic uint32_t error_frames;
    uint32_t received;
    canopy_unixbus_tx_t tx;
    canopy_ring_t queue;
    canopy_can_frame_t storage[CANOPY_UNIXBUS_FRAMES];
} canopy_unixbus_t;

/**
 * Joins a bus; its folder is made if need be.
 *
 * @param self        the object
 * @param bus         a name ("bus0"), or the path of a folder if it contains a slash
 * @param acceptance  filter, which lives as long as the driver is open
 * @return CANOPY_OK; CANOPY_ERROR_ARGUMENT: NULL, a bad name or filter, or (errno ENAMETOOLONG) a path too long for a
 *         socket; CANOPY_ERROR_NOT_FOUND: the folder's parent does not exist; CANOPY_ERROR_IO: another failure, with
 *         errno (EPERM: the default folder belongs to somebody else or can be written by others; EUSERS: the bus has
 *         CANOPY_UNIXBUS_PEERS_MAX participants).
 *
 * Later errors: CANOPY_ERROR_BUS_DOWN from send: the folder or the own socket in it was deleted; CANOPY_ERROR_IO: it could
 * not be read yet.
 */
canopy_error_t canopy_unixbus_open(canopy_unixbus_t *self, const char *bus, const canopy_can_acceptance_t *acceptance);

/**
 * Leaves the bus, removes the own socket and ends the thread; nothing happens when it is closed already. Waits up to
 * CANOPY_UNIXBUS_LATE_US for participants that have not got the last frames yet, but are taking some.
 */
void canopy_unixbus_close(canopy_unixbus_t *self);

/** Datagrams that were no frame, since the bus was joined. Any thread. O(1). */
uint32_t canopy_unixbus_malformed(const canopy_unixbus_t *self);

#endif
