/* SPDX-License-Identifier: MIT */
/**
 * @file
 * An application's loop on the double: world, wire, driver, other traffic, the other side, and a clock that lets the wire
 * run on while the loop waits.
 */
#ifndef CANOPY_TESTS_RIG_H
#define CANOPY_TESTS_RIG_H

#include "canopy/loop.h"
#include "peer.h"
#include "port.h"
#include "socket.h"
#include "traffic.h"
#include "wire.h"

#define RIG_BIT_RATE 500000u /**< If the options have none. */
#define RIG_SEED 20261130u   /**< Of the others' traffic, if the options have none. */

/** What a rig is made of. All zero: one common controller with an interrupt, abort and filters; nobody else on the bus. */
typedef struct {
    const canopy_app_t *app;
    uint32_t bit_rate; /**< [bit/s] 0: RIG_BIT_RATE. */
    uint8_t mailboxes; /**< 0: those of `controller`. */
    bool polled;       /**< No interrupts. */
    bool cannot_abort;
    bool unfiltered;                       /**< The driver takes everything. */
    const controller_config_t *controller; /**< NULL: CONTROLLER_COMMON. */
    uint32_t queue;                        /**< Frames in the queue of a driver like SocketCAN; 0: not like it. */
    bool no_echo;                          /**< Of such a driver. */
    unsigned fifos;                        /**< 2: the acceptance list is split over two FIFOs. */
    traffic_config_t traffic;
    nanoseconds_t peer_period; /**< 0: the application's. */
    nanoseconds_t peer_phase;  /**< Its messages come so much after a tick. */
    uint32_t rx_max;           /**< As in the loop's configuration. */
} rig_options_t;

/** One fault that the loop reported. */
typedef struct {
    uint32_t count;
    uint32_t last_detail;
} rig_fault_t;

typedef struct rig {
    world_t world;
    wire_t wire;
    wire_t nowhere; /* a cable that ends in the air: where the controller is when it is unplugged */
    port_t port;
    socket_t socket;
    controller_t *controller; /* the one of the application */
    traffic_t traffic;
    peer_t peer;
    canopy_clock_t clock;
    canopy_loop_config_t config;
    canopy_loop_t loop;
    nanoseconds_t end;        /* the loop is told to stop then */
    nanoseconds_t stopped_at; /* when canopy_loop_run() came back */
    uint32_t from_controller;
    rig_fault_t faults[CANOPY_FAULT_TX_REPLACED + 1];                                 /* by canopy_fault_t */
    void (*saw)(struct rig *rig, const canopy_can_frame_t *frame, nanoseconds_t end); /* a frame of the application */
    void (*after)(struct rig *rig);                                                   /* a cycle */
} rig_t;

/** Sets all up; the application's loop, too. */
void rig_init(rig_t *self, const rig_options_t *options);

/** canopy_loop_run() up to a time, with the stop that ends it; then the wire runs on for 200 ms. @return as the loop. */
canopy_error_t rig_run(rig_t *self, nanoseconds_t until);

/** Pulls the application's cable, or puts it in again. */
void rig_unplug(rig_t *self);
void rig_plug(rig_t *self);

/** What was posted, sent, replaced and so on. */
canopy_tx_counters_t rig_counters(const rig_t *self);

/** A message's place in the application's table of commands; -1: it is none. */
int rig_command_of(const rig_t *self, const canopy_can_frame_t *frame);

#endif
