/* SPDX-License-Identifier: MIT */
/**
 * @file
 * CAN driver for Linux SocketCAN (a raw socket): real controllers, vcan, slcan, and all that the kernel has.
 *
 * Threads: everything is called from the loop's thread. Signals end a wait early.
 * Blocking: only wait blocks. receive and send are one system call each.
 * Memory: the object is the caller's; nothing is allocated.
 *
 * Losses: rx_dropped is the kernel's count of frames that did not fit into the socket's buffer (SO_RXQ_OVFL). The kernel
 * tells it with the next frame received, so it is up to date once the buffer has been drained and a frame has come.
 * A full transmit queue (ENOBUFS, EAGAIN) drops the frame: send gives 0 and counts it, it is never tried again.
 *
 * Link down: send, receive or wait give CANOPY_ERROR_BUS_DOWN, receive and wait once each time the link goes down. The
 * driver stays open and works again when the link is up. It must be opened anew only if the interface was removed.
 */
#ifndef CANOPY_CAN_SOCKETCAN_H
#define CANOPY_CAN_SOCKETCAN_H

#include <stdbool.h>
#include <stdint.h>

#include "canopy/can.h"
#include "canopy/acceptance.h"
#include "canopy/status.h"

/** The driver's object. Owned by the caller, stays where it is while open. */
typedef struct {
    canopy_can_t can;       /**< The driver: hand &socketcan.can to the loop. */
    uint64_t last_frame_ns; /**< Kernel's time stamp of the last frame received: CLOCK_REALTIME [ns]; 0: none yet. */
    bool fd_frames;    /**< The interface carries CAN FD (its MTU when it was opened). Else FD frames are refused. */
    int socket;        /**< File descriptor, e.g. for poll() with others; -1 when closed. */
    bool error_frames; /* private: hand error frames over */
    canopy_can_stats_t stats; /* private */
} canopy_socketcan_t;

/**
 * Opens an interface. It may be down.
 *
 * @param self        the object
 * @param interface   its name, e.g. "can0"
 * @param acceptance  filter, copied into the kernel; NULL: every frame
 * @return CANOPY_OK; CANOPY_ERROR_ARGUMENT: NULL, name empty or too long, a bad filter; CANOPY_ERROR_NOT_FOUND: no
 *         such interface; CANOPY_ERROR_UNSUPPORTED: the kernel has no SocketCAN, or the interface is not a CAN
 *         interface; CANOPY_ERROR_IO: another failure, with errno.
 */
canopy_error_t canopy_socketcan_open(canopy_socketcan_t *self, const char *interface,
                                     const canopy_can_acceptance_t *acceptance);

/** Closes; nothing happens when it is closed already. */
void canopy_socketcan_close(canopy_socketcan_t *self);

#endif
