/* SPDX-License-Identifier: MIT */
/**
 * @file
 * CAN driver for Linux SocketCAN (raw sockets): real controllers, vcan, slcan, and all that the kernel has.
 *
 * Threads: everything is called from the loop's thread. Signals end a wait early.
 * Blocking: only wait blocks. The rest is a few system calls each; restart may switch an interface off and on, which takes
 * as long as its kernel driver needs, and opening one that was gone waits while another process changes interfaces (the
 * kernel's lock). The kernel is never asked for a name that does not exist: it would start modprobe and wait for its end.
 * Memory: the object is the caller's; nothing is allocated.
 *
 * Arrival: the kernel stamps received frames; the stamp is brought to CLOCK_MONOTONIC, so that setting the wall clock makes
 * no frame younger. Use the loop with the posix clock.
 *
 * Transmission: one mailbox. How much is known of a frame depends on the interface (canopy_socketcan_knowledge_t). With
 * an echo at most one frame is with the kernel at any time, and the next one follows when the echo says that it is out.
 * So when the bus is blocked at most that one leaves late, whatever the length of the interface's queue. Without an echo a
 * frame counts as out when it has left the kernel's queue: what the adapter holds then may leave late, and
 * canopy_socketcan_advice() says so. Nothing is ever taken back: switching the interface off and on would empty the
 * kernel's queue, but not the adapter, and each time lets one more frame into it.
 *
 * Losses: rx_dropped is the kernel's count of frames that did not fit into the socket's buffer (SO_RXQ_OVFL). The kernel
 * tells it with the next frame received, so it is up to date once the buffer has been drained and a frame has come.
 * ENOBUFS, the queue being full of others' frames: send gives 0, and the frame may be offered again.
 *
 * State: from error frames, from the interface's flags (looked at every CANOPY_SOCKETCAN_LOOK_US) and from failed calls.
 * restart() brings a controller back from bus-off where the kernel does not (`restart-ms` 0) and the process may; and it
 * opens an interface that was removed and made anew. One that is switched off is waited for. send, receive and wait give
 * CANOPY_ERROR_BUS_DOWN, receive and wait at most once each time the link goes down. The count of error frames is up to date
 * after state().
 */
#ifndef CANOPY_CAN_SOCKETCAN_H
#define CANOPY_CAN_SOCKETCAN_H

#include <stdbool.h>
#include <stdint.h>

#include "canopy/acceptance.h"
#include "canopy/can.h"
#include "canopy/can/arrival.h"
#include "canopy/status.h"

/** How often the interface's flags are looked at [us]; a failed call lets the driver look at once. */
#define CANOPY_SOCKETCAN_LOOK_US 50000u

/** Frames taken from the kernel with one call. */
#define CANOPY_SOCKETCAN_BATCH 16u

/** How the driver knows that a frame is out. */
typedef enum {
    CANOPY_SOCKETCAN_AT_ONCE = 0, /**< The interface has no queue and no bus behind it (vcan): when send() took it. */
    CANOPY_SOCKETCAN_BY_ECHO,     /**< The controller echoes frames that were acknowledged (IFF_ECHO). */
    CANOPY_SOCKETCAN_BY_QUEUE     /**< It has left the kernel's queue; nothing is known after that. */
} canopy_socketcan_knowledge_t;

/** The driver's object. Owned by the caller, stays where it is while open; members are private where nothing is said. */
typedef struct {
    canopy_can_t can; /**< The driver: hand &socketcan.can to the loop. */
    bool fd_frames;   /**< The interface carries CAN FD (its MTU when it was opened). Else FD frames are refused. */
    int socket;       /**< File descriptor, e.g. for poll() with others; -1 when closed. */
    canopy_socketcan_knowledge_t knowledge; /**< How the driver knows that a frame is out. */
    int events; /* a second socket: error frames, and the echo of what is sent; -1 when closed */
    char name[16];
    unsigned index; /* of the interface that the sockets are bound to */
    const canopy_can_acceptance_t *acceptance;
    canopy_can_controller_t controller; /* as error frames say */
    canopy_can_controller_t link;       /* ACTIVE: up; DOWN; GONE */
    bool may_switch;                    /* the process may switch interfaces off and on */
    bool restarts_itself;               /* after bus-off, by the kernel's restart-ms */
    bool is_controller;                 /* has bus-off: not a virtual interface */
    uint64_t next_look;                 /* at the interface's flags, monotonic [us] */
    struct {                            /* what was handed to the kernel */
        canopy_can_outcome_t outcome;
        uint32_t id; /* as the kernel writes it */
        uint8_t length;
        uint8_t flags;
        uint8_t data[CANOPY_CAN_DATA_MAX];
    } flight;
    uint32_t echo_ids[CANOPY_CAN_ACCEPT_MAX]; /* whose echo the second socket gets */
    uint16_t echo_count;
    uint16_t waiting_count; /* frames taken from the kernel, and */
    uint16_t waiting_next;  /* of these, handed over */
    canopy_can_frame_t waiting[CANOPY_SOCKETCAN_BATCH];
    canopy_arrival_t arrival;
    uint32_t dropped_before; /* by sockets that were closed since */
    canopy_can_stats_t stats;
} canopy_socketcan_t;

/**
 * Opens an interface. It may be down: then state() says so until it is up.
 *
 * @param self        the object
 * @param interface   its name, e.g. "can0"
 * @param acceptance  filter, which lives as long as the driver is open
 * @return CANOPY_OK; CANOPY_ERROR_ARGUMENT: NULL, name empty or too long, a bad filter; CANOPY_ERROR_NOT_FOUND: no
 *         such interface; CANOPY_ERROR_UNSUPPORTED: the kernel has no SocketCAN, or the interface is not a CAN
 *         interface; CANOPY_ERROR_IO: another failure, with errno.
 */
canopy_error_t canopy_socketcan_open(canopy_socketcan_t *self, const char *interface,
                                     const canopy_can_acceptance_t *acceptance);

/**
 * What the user should know about this interface now: what it cannot promise, and what to do. O(1).
 * @param number 0 for the first text, 1 for the second ...
 * @return one line, static; NULL: no more
 */
const char *canopy_socketcan_advice(const canopy_socketcan_t *self, unsigned number);

/** Closes; nothing happens when it is closed already. */
void canopy_socketcan_close(canopy_socketcan_t *self);

#endif
