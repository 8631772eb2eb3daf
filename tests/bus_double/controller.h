/* SPDX-License-Identifier: MIT */
/**
 * @file
 * A CAN controller at the wire, as a microcontroller has one: mailboxes with abort, an acceptance filter, receive FIFOs with
 * stamps, error counters, one interrupt line. The program's side is what a driver does with its registers.
 *
 * Source of the counters' rules: Bosch, "CAN Specification 2.0", part B, chapter 8 (rules 1, 3, 6 to 9, 11 and 12) and
 * ISO 11898-1, 12.1.4. Rule 2 (a receiver that sees a dominant bit after its error flag) is not there.
 */
#ifndef CANOPY_TESTS_CONTROLLER_H
#define CANOPY_TESTS_CONTROLLER_H

#include <stdbool.h>
#include <stdint.h>

#include "canopy/can.h"
#include "world.h"

enum {
    CONTROLLER_MAILBOXES_MAX = 4,
    CONTROLLER_FIFOS = 2,
    CONTROLLER_FIFO_MAX = 64,
    CONTROLLER_FILTERS_MAX = 28,
    ERRORS_WARNING = 96,
    ERRORS_PASSIVE = 128,
    ERRORS_BUS_OFF = 256
};

struct wire;

/** A filter: a frame passes whose id is equal to `id` where `mask` has ones, and that is (not) extended as the filter is. */
typedef struct {
    uint32_t id;
    uint32_t mask;
    bool extended;
    uint8_t fifo;
} controller_filter_t;

/** How a controller is made. */
typedef struct {
    uint8_t mailboxes;     /**< 1..CONTROLLER_MAILBOXES_MAX */
    bool in_order;         /**< Mailboxes leave in the order in which they were filled; else the lowest id first. */
    bool keeps_at_bus_off; /**< What waits at bus-off leaves after the recovery; else it is aborted then. */
    uint8_t depth;         /**< Of each receive FIFO, 1..CONTROLLER_FIFO_MAX. */
    bool overwrites;       /**< A full FIFO loses its newest frame for the new one; else the new one is lost. */
    uint8_t stamp_bits;    /**< Width of the receive stamps' timer, 1..32. */
    uint32_t stamp_ns;     /**< Length of one count of that timer. */
    uint32_t latency_ns;   /**< From an interrupt's cause to its service, at least. */
    uint32_t latency_jitter_ns; /**< And so much more at most, at random. */
} controller_config_t;

/** Three mailboxes, lowest id first, FIFOs of 3, a stamp of 16 bits that counts bits at 500 kbit/s: a common part. */
#define CONTROLLER_COMMON                            \
    ((controller_config_t){.mailboxes = 3,           \
                           .keeps_at_bus_off = true, \
                           .depth = 3,               \
                           .stamp_bits = 16,         \
                           .stamp_ns = 2000,         \
                           .latency_ns = 3000,       \
                           .latency_jitter_ns = 7000})

typedef enum { MAILBOX_FREE, MAILBOX_PENDING, MAILBOX_SENT, MAILBOX_ABORTED } mailbox_state_t;

typedef struct {
    canopy_can_frame_t frame;
    mailbox_state_t state;
    bool abort;     /* asked for while it was on the wire */
    uint32_t order; /* in which it was filled */
} mailbox_t;

typedef struct {
    canopy_can_frame_t frame;
    uint32_t stamp;
} received_t;

typedef struct {
    received_t frames[CONTROLLER_FIFO_MAX];
    uint32_t first;
    uint32_t count;
    uint32_t lost; /* what really happened: a real part has a flag only */
} fifo_t;

/** One controller. Read what you like; change it through the functions. */
typedef struct controller {
    world_t *world;
    struct wire *wire;
    controller_config_t config;
    const char *name;
    mailbox_t mailboxes[CONTROLLER_MAILBOXES_MAX];
    int on_wire; /* the mailbox whose frame is on the wire; -1: none is */
    uint32_t order;
    fifo_t fifos[CONTROLLER_FIFOS];
    controller_filter_t filters[CONTROLLER_FILTERS_MAX]; /* none: everything goes to FIFO 0 */
    unsigned filter_count;
    unsigned transmit_errors; /* TEC */
    unsigned receive_errors;  /* REC */
    bool bus_off;
    bool recovering;        /* counts recessive bits */
    bool cannot_drive;      /* its transmitter is broken: no bit of it reaches the wire, and it notices */
    unsigned recovery_left; /* sequences of 11 recessive bits */
    nanoseconds_t recovery_from;
    nanoseconds_t suspended_until; /* an error-passive transmitter waits a little longer */
    uint32_t sent;
    uint32_t bus_offs;
    uint32_t error_frames; /* that it saw */
    actor_t interrupt;
    void (*isr)(void *context);
    void *isr_context;
    uint32_t random;
} controller_t;

/** Makes a controller and puts it to the wire. */
void controller_init(controller_t *self, struct wire *wire, const char *name, const controller_config_t *config);

/** Adds a filter; frames that no filter lets through are not received. */
void controller_filter(controller_t *self, controller_filter_t filter);

/** Fills a free mailbox. @return false: it is not free, or the frame is none of a classic bus. */
bool controller_send(controller_t *self, uint8_t mailbox, const canopy_can_frame_t *frame);

/** Takes a frame back, at once where it only waits; of one on the wire the outcome decides: gone, or aborted. */
void controller_abort(controller_t *self, uint8_t mailbox);

/** A finished mailbox (sent or aborted) is free again. */
void controller_release(controller_t *self, uint8_t mailbox);

/** Takes the oldest frame of a FIFO. @return false: there is none */
bool controller_receive(controller_t *self, unsigned fifo, received_t *received);

/** The timer of the receive stamps, now. */
uint32_t controller_timer(const controller_t *self);

/** Lets the interrupt come, as its software request does. */
void controller_raise(controller_t *self);

/** Begins the way back from bus-off: 128 times 11 recessive bits. */
void controller_restart(controller_t *self);

/** As the controller says it of itself. */
canopy_can_controller_t controller_state(const controller_t *self);

/** --- what the wire does with a controller ----------------------------------------------------------------------- */

/** The mailbox that takes part in the arbitration now; -1: none. */
int controller_offer(const controller_t *self);

/** The frame on the wire is out. */
void controller_sent(controller_t *self);

/** The frame on the wire failed. @param counts the transmit error counter goes up, too */
void controller_failed(controller_t *self, bool counts);

/** Sent by another one, and valid. */
void controller_hear(controller_t *self, const canopy_can_frame_t *frame);

/** An error frame of the wire, in which the controller is a receiver. */
void controller_receive_error(controller_t *self, unsigned errors);

/** Adds to the transmit error counter. */
void controller_transmit_error(controller_t *self);

/** Recessive bits end at `until`, or have come as far as that. */
void controller_recover(controller_t *self, nanoseconds_t recessive_since, nanoseconds_t until);

/** When the recovery will be over if nothing else happens; NEVER. */
nanoseconds_t controller_recovered_at(const controller_t *self, nanoseconds_t recessive_since);

#endif
