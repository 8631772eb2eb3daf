/* SPDX-License-Identifier: MIT */
/**
 * @file
 * A CAN bus inside one program: several endpoints joined; a frame that one sends, all others receive. For tests, and
 * simulations in the same process. Needs no operating system.
 *
 * With a controller below it, it is how several trees share that: each has an endpoint, and sees what comes from the
 * wire and what the others send.
 *
 *     static canopy_loopback_t bus = {.controller = &board_can};
 *
 * Each endpoint has one mailbox of its own. With a controller, frames wait there until one of the controller's mailboxes
 * is free for them, the most urgent first (lowest arbitration id); where the controller can abort, a less urgent frame
 * gives up its mailbox. A frame that is out is handed to the other endpoints, not before. Without a controller a frame is
 * out at once.
 *
 * Threads: all endpoints of a bus are used by one thread; or the bus has exactly two endpoints and no controller, and
 * each of them has a thread (or an interrupt) of its own. More senders than that would make several producers for one ring.
 * Joining and leaving happens while nobody sends.
 *
 * The controller: its receive may be fed by an interrupt through a ring. Its send, outcome and abort are called from the
 * endpoints' thread only, so its transmit interrupt may do no more than note what is out; its request is not used: the
 * loops look every `frame_us`. Endpoints of loops that are run by canopy_loop_run_all() are in one thread.
 *
 * Blocking and memory: nothing blocks or allocates; wait is NULL. The queues are the caller's.
 */
#ifndef CANOPY_CAN_LOOPBACK_H
#define CANOPY_CAN_LOOPBACK_H

#include "canopy/acceptance.h"
#include "canopy/can.h"
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
     * The way to the wire, or NULL: then the bus ends in the program. Nobody else uses it. Set before the first endpoint
     * joins. Endpoints fetch from it while their own queue is empty, so each must take its own often enough for the queues
     * of the slower ones: a queue holds what comes in one period of its owner.
     */
    const canopy_can_t *controller;
    struct { /* private */
        bool used;
        canopy_loopback_endpoint_t *owner; /* of the frame in it; NULL: has left the bus */
    } mailboxes[CANOPY_CAN_MAILBOXES_MAX]; /* of the controller */
} canopy_loopback_t;

struct canopy_loopback_endpoint {
    canopy_can_t can; /**< The driver: hand &endpoint.can to the loop. */
    canopy_loopback_t *bus;
    canopy_loopback_endpoint_t *next;
    const canopy_can_acceptance_t *acceptance;
    canopy_ring_t queue;
    canopy_can_frame_t held; /* in the endpoint's mailbox, while `outcome` is PENDING */
    canopy_can_outcome_t outcome;
    int error;     /* why the controller did not take it: 0, or negative canopy_error_t */
    bool loaded;   /* in one of the controller's mailboxes, too */
    bool giving;   /* and the controller was asked to give it back, */
    bool dropping; /* for good */
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
 * @param acceptance  filter, which lives as long as the endpoint: an application's `acceptance`, or a list of your own
 * @return CANOPY_OK, or CANOPY_ERROR_ARGUMENT.
 *
 * Send: O(endpoints * mailboxes). CANOPY_ERROR_ARGUMENT for a frame that cannot exist on a bus; an error of the controller
 * is handed on. For a participant whose queue is full a frame is lost and counted there (rx_dropped), as on a real bus.
 *
 * Receive: at most CANOPY_LOOPBACK_FETCH frames are fetched from the controller, O(endpoints) each, until one is for this
 * endpoint. An error of the controller is handed on, to the endpoint that came across it.
 *
 * State, restart: the controller's. Stats: the endpoint's own; rx_dropped with what the controller has lost.
 */
canopy_error_t canopy_loopback_join(canopy_loopback_t *bus, canopy_loopback_endpoint_t *endpoint,
                                    canopy_can_frame_t *storage, uint32_t capacity,
                                    const canopy_can_acceptance_t *acceptance);

/**
 * Leaves the bus; nothing happens when the endpoint is in none. A frame of its that is with the controller may still get
 * out, and then nobody hears of it. O(endpoints).
 */
void canopy_loopback_leave(canopy_loopback_endpoint_t *endpoint);

#endif
