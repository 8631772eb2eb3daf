/* SPDX-License-Identifier: MIT */
/**
 * @file
 * A CAN bus inside one program: several endpoints joined; a frame that one sends, all others receive. For tests, and
 * simulations in the same process. Needs no operating system.
 *
 * With a controller below it, it is how several trees share that: each has an endpoint, and sees what comes from the
 * wire and what the others send. What an endpoint sends goes to the wire first, and to the others if that took it.
 *
 *     static canopy_loopback_t bus = {.controller = &board_can};
 *
 * Threads: all endpoints of a bus are used by one thread; or the bus has exactly two endpoints and no controller, and
 * each of them has a thread (or an interrupt) of its own. More senders than that would make several producers for one ring.
 * Joining and leaving happens while nobody sends.
 *
 * Blocking and memory: nothing blocks or allocates; wait is NULL. The queues are the caller's.
 */
#ifndef CANOPY_CAN_LOOPBACK_H
#define CANOPY_CAN_LOOPBACK_H

#include "canopy/can.h"
#include "canopy/acceptance.h"
#include "canopy/ring.h"
#include "canopy/status.h"

/** Most frames that one receive fetches from the controller, so that a flooded bus cannot hold it up. */
#define CANOPY_LOOPBACK_FETCH 64u

/** One participant. Owned by the caller, stays where it is while joined; members but `can` are private. */
typedef struct canopy_loopback_endpoint canopy_loopback_endpoint_t;

/** The bus. Owned by the caller; a zeroed one (`= {0}`) has no participants, and no controller. */
typedef struct {
    canopy_loopback_endpoint_t *first;
    /**
     * The way to the wire, or NULL: then the bus ends in the program. Nobody else takes frames from it. Endpoints fetch
     * from it while their own queue is empty, so each must take its own often enough for the queues of the slower ones:
     * a queue holds what comes in one period of its owner.
     */
    const canopy_can_t *controller;
} canopy_loopback_t;

struct canopy_loopback_endpoint {
    canopy_can_t can; /**< The driver: hand &endpoint.can to the loop. */
    canopy_loopback_t *bus;
    canopy_loopback_endpoint_t *next;
    const canopy_can_acceptance_t *acceptance;
    canopy_ring_t queue;
    uint32_t received;
    uint32_t sent;
    uint32_t tx_dropped;
};

/**
 * Joins a bus.
 *
 * @param bus         the bus
 * @param endpoint    the new participant; in no bus yet
 * @param storage     its receive queue; lives as long as the endpoint
 * @param capacity    [frames] a power of two
 * @param acceptance  filter, which lives as long as the endpoint; NULL: every frame
 * @return CANOPY_OK, or CANOPY_ERROR_ARGUMENT.
 *
 * Send: O(endpoints). It always takes a valid frame, unless the controller does not (its answer is handed on); for a
 * participant whose queue is full the frame is lost and counted there (rx_dropped), as on a real bus.
 * CANOPY_ERROR_ARGUMENT for a frame that cannot exist on a bus.
 *
 * Receive: at most CANOPY_LOOPBACK_FETCH frames are fetched from the controller, O(endpoints) each, until one is for this
 * endpoint. An error of the controller is handed on, to the endpoint that came across it.
 */
canopy_error_t canopy_loopback_join(canopy_loopback_t *bus, canopy_loopback_endpoint_t *endpoint,
                                    canopy_can_frame_t *storage, uint32_t capacity,
                                    const canopy_can_acceptance_t *acceptance);

/** Leaves the bus; nothing happens when the endpoint is in none. O(endpoints). */
void canopy_loopback_leave(canopy_loopback_endpoint_t *endpoint);

#endif
