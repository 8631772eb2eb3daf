/* SPDX-License-Identifier: MIT */
/**
 * @file
 * A CAN wire with a bit rate: arbitration, frames that take their bits, acknowledgement, error frames, faults.
 *
 * What is simplified: two controllers that become ready within the same bit do not meet, unless at the same ns; overload
 * frames, CAN FD and the propagation delay are not there; an error is seen by all at the same bit.
 */
#ifndef CANOPY_TESTS_WIRE_H
#define CANOPY_TESTS_WIRE_H

#include <stdbool.h>
#include <stdint.h>

#include "canopy/can.h"
#include "controller.h"
#include "world.h"

enum { WIRE_CONTROLLERS_MAX = 16 };

typedef enum {
    WIRE_IDLE,
    WIRE_FRAME,        /* up to the end of the ACK slot, or of the bit with the error */
    WIRE_END_OF_FRAME, /* up to the last but one bit: valid for receivers */
    WIRE_LAST_BIT,     /* valid for the transmitter */
    WIRE_ERROR,        /* error flag and delimiter */
    WIRE_INTERMISSION,
    WIRE_DOMINANT /* somebody holds it */
} wire_phase_t;

/** Who watches the wire. */
typedef void (*wire_watch_t)(void *context, const canopy_can_frame_t *frame, const controller_t *from,
                             nanoseconds_t start, nanoseconds_t end);

typedef struct wire {
    world_t *world;
    uint32_t bit_ns;
    actor_t actor; /* end of the phase */
    wire_phase_t phase;
    controller_t *controllers[WIRE_CONTROLLERS_MAX];
    unsigned count;
    canopy_can_frame_t frame; /* on the wire */
    nanoseconds_t start;
    nanoseconds_t recessive_since;
    bool fails;            /* the frame on the wire ends in an error that is no missing acknowledgement */
    bool fails_for_sender; /* and only the sender sees it */
    bool dominant;
    uint32_t disturbed; /* the next so many frames fail */
    uint32_t random;
    wire_watch_t watch;
    void *watch_context;
    uint64_t busy_ns; /* by frames that were sent, intermission included */
    uint32_t frames;
    uint32_t errors;
} wire_t;

/** @param bit_rate [bit/s], a divisor of 10^9 */
void wire_init(wire_t *self, world_t *world, uint32_t bit_rate);

/** Connects a controller to a wire, and so disconnects it from the one it was at. A frame of it on the wire is cut off. */
void wire_plug(wire_t *self, controller_t *controller);

/** Tells of each frame that is out: called when receivers have it, one bit before its end, which it tells. */
void wire_set_watch(wire_t *self, wire_watch_t watch, void *context);

/** Holds the wire dominant (a short circuit), or lets go of it. */
void wire_hold(wire_t *self, bool dominant);

/** Destroys the next frames, each at a bit somewhere in it. */
void wire_disturb(wire_t *self, uint32_t frames);

/** Something has changed at a controller: it has a frame to send, or recovers. Controllers call it. */
void wire_poke(wire_t *self);

/** When the intermission of what is on the wire will be over; now, when nothing is. */
nanoseconds_t wire_free_at(const wire_t *self);

#endif
