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
 * Blocking: receive never. send at most CANOPY_UNIXBUS_SEND_WAIT_US in all, and only for participants that are full now
 * but were not before; one that stays full loses frames (tx_dropped, once for each frame and participant) and is not
 * waited for again until it has taken a frame.
 *
 * Arrival: the kernel stamps a frame when it is sent; the stamp is brought to CLOCK_MONOTONIC, so that setting the wall clock
 * makes no frame younger. Use the loop with the posix clock.
 *
 * Transmission: what send() takes is out. When every participant lost it, send() gives 0, and the frame may be offered
 * again. When some took it, or there are no others, it is out.
 *
 * State: gone when the folder, or the own socket in it, was deleted; restart() makes them anew.
 *
 * Memory: the object is the caller's (about 160 KiB: make it static); the operating system's thread and directory
 * functions allocate.
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

/** Other participants that a sender reaches. Each frame counts once in tx_dropped when there are more. */
#define CANOPY_UNIXBUS_PEERS_MAX 64u

/** Longest time that a send can take for participants that are full [µs]. */
#define CANOPY_UNIXBUS_SEND_WAIT_US 100000u

/** Another participant. Private. */
typedef struct {
    struct sockaddr_un address;
    bool slow; /* has let a send wait in vain, and has taken no frame since */
} canopy_unixbus_peer_t;

/** The folder as it was last read. Private. */
typedef struct {
    char path[sizeof(((struct sockaddr_un *)NULL)->sun_path)];
    struct sockaddr_un own;
    struct timespec modified; /* the folder's mtime when it was read */
    bool settled;             /* mtime was old enough then that no later change can bear the same */
    bool too_many;
    size_t count;
    canopy_unixbus_peer_t peers[CANOPY_UNIXBUS_PEERS_MAX];
} canopy_unixbus_folder_t;

/** The driver's object. Owned by the caller, stays where it is while open; members but `can` are private. */
typedef struct {
    canopy_can_t can; /**< The driver: hand &unixbus.can to the loop. */
    const canopy_can_acceptance_t *acceptance;
    char bus[sizeof(((struct sockaddr_un *)NULL)->sun_path)]; /* as it was named */
    int socket;
    int event; /* eventfd that the thread counts up after each frame */
    pthread_t thread;
    atomic_bool stopping;
    atomic_int failure; /* errno that ended the thread */
    _Atomic uint32_t malformed;
    canopy_arrival_t arrival; /* the thread's */
    _Atomic uint32_t error_frames;
    uint32_t received;
    uint32_t sent;
    uint32_t tx_dropped;
    canopy_unixbus_folder_t folder;
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
 *         errno (EPERM: the default folder belongs to somebody else or can be written by others).
 *
 * Later errors: CANOPY_ERROR_BUS_DOWN from send: the folder or the own socket in it was deleted.
 */
canopy_error_t canopy_unixbus_open(canopy_unixbus_t *self, const char *bus, const canopy_can_acceptance_t *acceptance);

/** Leaves the bus, removes the own socket and ends the thread; nothing happens when it is closed already. */
void canopy_unixbus_close(canopy_unixbus_t *self);

/** Datagrams that were no frame, since the bus was joined. Any thread. O(1). */
uint32_t canopy_unixbus_malformed(const canopy_unixbus_t *self);

#endif
