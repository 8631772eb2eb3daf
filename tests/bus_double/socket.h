/* SPDX-License-Identifier: MIT */
/**
 * @file
 * A driver behind canopy_can_t like one over SocketCAN: an operating system with a queue of frames stands between the
 * program and the controller, and nothing that is in it can be taken back. Polled: no request(), no abort().
 *
 * With the echo the program is told when a frame is out, and hands over the next one only then. Without it, send() is all
 * that it knows.
 */
#ifndef CANOPY_TESTS_SOCKET_H
#define CANOPY_TESTS_SOCKET_H

#include "canopy/acceptance.h"
#include "canopy/can.h"
#include "canopy/ring.h"
#include "controller.h"
#include "wire.h"

enum { SOCKET_RING = 1024, SOCKET_QUEUE_MAX = 1000 };

typedef enum { SOCKET_UP, SOCKET_DOWN, SOCKET_GONE } socket_link_t;

typedef struct {
    canopy_can_t can;
    controller_t controller;
    const canopy_can_acceptance_t *acceptance;
    canopy_ring_t ring; /* the socket's receive buffer */
    canopy_can_frame_t ring_storage[SOCKET_RING];
    canopy_can_frame_t queue[SOCKET_QUEUE_MAX]; /* the interface's transmit queue */
    uint32_t queue_length;
    uint32_t first;
    uint32_t waiting;
    uint32_t highest;             /* most frames ever in it */
    canopy_can_outcome_t outcome; /* of the frame that was handed over last */
    socket_link_t link;
    uint32_t restarts;
} socket_t;

/**
 * @param queue_length frames that the interface's queue holds, 1..SOCKET_QUEUE_MAX
 * @param acceptance   not NULL
 */
void socket_init(socket_t *self, wire_t *wire, uint32_t queue_length, bool has_echo,
                 const canopy_can_acceptance_t *acceptance);

/** Switches the interface; what waits in it is lost when it is not up. */
void socket_set_link(socket_t *self, socket_link_t link);

#endif
