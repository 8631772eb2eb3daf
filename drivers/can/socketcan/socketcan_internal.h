/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Between the files of the SocketCAN driver: frames (socketcan.c), what became of a sent one (socketcan_flight.c), the
 * state of controller and interface (socketcan_state.c), the kernel's description of the interface (socketcan_link.c),
 * the sockets (socketcan_open.c).
 */
#ifndef CANOPY_SOCKETCAN_INTERNAL_H
#define CANOPY_SOCKETCAN_INTERNAL_H

#include <linux/can.h>

#include "canopy/can/socketcan.h"

/** CLOCK_MONOTONIC [us]: the loop's clock. */
uint64_t canopy_socketcan_now(void);

/** Takes note of a failed call: BUS_DOWN when the interface is down or gone, and the driver looks at it soon. */
canopy_error_t canopy_socketcan_error(canopy_socketcan_t *self, int number);

/* --- socketcan_flight.c --------------------------------------------------------------------------------------------- */

int canopy_socketcan_send(void *context, uint8_t mailbox, const canopy_can_frame_t *frame);
canopy_can_outcome_t canopy_socketcan_outcome(void *context, uint8_t mailbox);

/** The frame that is with the kernel, if any, never leaves: the interface has dropped it. */
void canopy_socketcan_lose_flight(canopy_socketcan_t *self);

/** Looks whether a frame of the second socket is the echo of the one that is with the kernel. */
void canopy_socketcan_take_echo(canopy_socketcan_t *self, const struct canfd_frame *raw);

/* --- socketcan_state.c ---------------------------------------------------------------------------------------------- */

/** Takes what the second socket has: error frames, echoes. Bounded. */
void canopy_socketcan_take_events(canopy_socketcan_t *self);

canopy_can_controller_t canopy_socketcan_state(void *context);
void canopy_socketcan_restart(void *context);

/* --- socketcan_link.c ----------------------------------------------------------------------------------------------- */

/** What the kernel says of an interface. */
typedef struct {
    unsigned index;                     /**< Its number. */
    bool has_echo;                      /**< IFF_ECHO */
    bool has_queue;                     /**< Frames may wait in the kernel. */
    bool is_controller;                 /**< It has the attributes of a CAN controller. */
    bool restarts_itself;               /**< restart-ms is not 0. */
    canopy_can_controller_t controller; /**< Error state. */
} canopy_socketcan_link_t;

/**
 * Asks the kernel by netlink. Blocks until its answer is there, which is at once, unless another process is just changing
 * interfaces. Not by ioctl() of a name: where there is no such interface the kernel looks for a module of that name, which
 * starts a process (modprobe) and waits for its end.
 * @return CANOPY_OK; CANOPY_ERROR_NOT_FOUND: there is no interface of this name; CANOPY_ERROR_UNSUPPORTED: the kernel does
 *         not say, or the process may not ask
 */
canopy_error_t canopy_socketcan_ask_link(const char *name, canopy_socketcan_link_t *link);

/** Does the process have CAP_NET_ADMIN? */
bool canopy_socketcan_may_switch(void);

/**
 * Is the interface that had this number and this name still there, and is it up? By the number, so that nothing is asked of
 * a name that does not exist.
 * @return ACTIVE, DOWN or GONE
 */
canopy_can_controller_t canopy_socketcan_look(int socket, unsigned index, const char *name);

/** Switches the interface off and on. @return false: it may not, or it fails. */
bool canopy_socketcan_switch(canopy_socketcan_t *self);

/* --- socketcan_open.c ----------------------------------------------------------------------------------------------- */

/** Asks the kernel what the interface is, and so how the driver knows that a frame is out: when it comes up. */
void canopy_socketcan_learn(canopy_socketcan_t *self);

/** Opens the sockets for the interface that has the name now; they take the place of those that were open. */
canopy_error_t canopy_socketcan_bind(canopy_socketcan_t *self);

/** Gives the second socket the ids whose echo it must get. @return false, with errno. */
bool canopy_socketcan_listen(canopy_socketcan_t *self);

#endif
