/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The transmit side: what the loop wants to send, until it is known to be out.
 *
 *     loop's thread                                     transmit context
 *     canopy_tx_post()     one place per message   -->  canopy_tx_service() --> driver's mailboxes --> wire
 *     canopy_tx_trace()    ring of trace frames    -->  (behind all commands)
 *
 * Each command message has one place to wait in. A newer value takes the place of one that is not out; after its deadline
 * a frame is taken back from the hardware where that can, and dropped and counted. So nothing old leaves, and what leaves
 * is the newest. Trace frames wait in a ring behind the commands and are the first to be lost.
 *
 * The E2E counter and the CRC are put in when a frame goes to a mailbox, and the counter moves on when the frame is out:
 * a frame that another one replaced has used up no number, and the receiver sees no gap.
 *
 * Threads: there are two contexts. post, trace, kick, the questions and the counters belong to the loop's thread.
 * canopy_tx_service() is the transmit context: the transmit interrupt (which may interrupt the loop anywhere, and is not
 * interrupted by it), a thread of the driver, or the loop's own thread for a driver without request(). It must not
 * interrupt itself. Nothing waits: when the loop is just writing a message, the service leaves it out, and the loop
 * requests another one afterwards.
 *
 * Memory order: a place has two buffers. The loop takes the published one back (`latest` = 0), looks which one is being
 * read (`reading`), writes the other, and publishes it. The service announces in `reading` what it is going to read, then
 * looks whether it is still published, then copies. All four accesses are sequentially consistent, so either the service
 * sees that its buffer was taken back, or the loop sees that it is being read. Loads and stores only, no read-modify-write.
 */
#ifndef CANOPY_TX_H
#define CANOPY_TX_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "canopy/can.h"
#include "canopy/clock.h"
#include "canopy/status.h"

/** In data_id: the message has no end-to-end protection. */
#define CANOPY_E2E_NONE (-1)

/** A message that the controller sends. Constant. */
typedef struct {
    uint32_t id;
    uint8_t flags;
    uint8_t length;
    int32_t data_id;        /**< E2E data id 0..65535, or CANOPY_E2E_NONE. */
    uint16_t every;         /**< Sent in every `every`-th tick, >= 1. */
    uint16_t place;         /**< Where its two buffers of `length` bytes begin in canopy_tx_t.data. */
    canopy_time_t deadline; /**< [us] after the tick; a frame that is not out then never leaves. */
    /** Writes the output image's values into `length` bytes, all of them. */
    void (*encode)(const void *output, uint8_t *data);
} canopy_tx_message_t;

/** Where a message waits. Private; canopy_tx_init() sets it up. */
typedef struct {
    canopy_time_t until[2]; /* of each buffer's frame */
    _Atomic uint32_t
        latest;           /* loop: version << 2 | buffer << 1 | 1 of what was posted last; 0: none, or being written */
    _Atomic uint32_t out; /* service: last version that is out; UINT32_MAX, which is no version: none ever was */
    uint32_t posted;      /* loop: last version */
    uint32_t owed_after;  /* loop: while it owes, a version after this one must get out */
    uint32_t taken;       /* service: last version that went to a mailbox, or was dropped */
    _Atomic uint8_t reading; /* service: 1 + the buffer that it copies; 0: none */
    uint8_t counter;         /* service: E2E counter of the next frame */
    bool flying;             /* service: in a mailbox */
    bool owes;               /* loop */
} canopy_tx_slot_t;

#define CANOPY_TX_TRACE_LENGTH 8u

/** What a trace frame carries. */
typedef struct {
    uint8_t byte[CANOPY_TX_TRACE_LENGTH];
} canopy_tx_trace_data_t;

/** A trace frame that waits. Private. */
typedef struct {
    canopy_time_t until;
    uint32_t id;
    canopy_tx_trace_data_t data;
    uint8_t flags;
} canopy_tx_trace_t;

/** What is in a mailbox. The service's alone. Private. */
typedef struct {
    canopy_time_t until;
    uint32_t version;
    uint16_t what; /* 1 + the message; CANOPY_TX_TRACE; 0: empty */
    bool aborting;
} canopy_tx_mailbox_t;

#define CANOPY_TX_TRACE UINT16_MAX

/** What became of frames. Every frame that was posted ends as one of sent, replaced, expired; trace as sent or dropped. */
typedef struct {
    uint32_t sent;          /**< Commands that are out. */
    uint32_t replaced;      /**< Commands that a newer value replaced before they were out. */
    uint32_t expired;       /**< Commands that were not out at their deadline. They never leave. */
    uint32_t trace_sent;    /**< Trace frames that are out. */
    uint32_t trace_dropped; /**< Trace frames for which there was no room or no time. */
} canopy_tx_counters_t;

/** The transmit side of one application at run time. Members are private. */
typedef struct {
    const canopy_tx_message_t *messages; /* in the order of their urgency */
    const canopy_can_t *can;
    canopy_tx_slot_t *slots;  /* `count` */
    uint8_t *data;            /* two buffers per message */
    canopy_tx_trace_t *trace; /* a ring of trace_mask + 1 places, which are written and read where they are */
    uint32_t trace_mask;
    uint16_t count;
    uint8_t mailbox_count;
    /* The loop's: */
    uint32_t trace_full;         /* frames that found no place */
    uint32_t held;               /* commands held back */
    _Atomic uint32_t trace_head; /* frames that ever got a place */
    /* The service's: */
    _Atomic uint32_t trace_tail; /* frames that ever left theirs */
    uint8_t in_flight;           /* frames in mailboxes */
    bool trace_flying;           /* the oldest frame is in a mailbox */
    _Atomic bool trace_stopped;  /* by the loop: no trace frame leaves any more */
    bool watching;               /* something was handed over, and nothing has got out since */
    _Atomic bool busy;           /* a frame is in a mailbox, or waits because none took it */
    _Atomic bool blocked;
    canopy_time_t watched_until; /* its deadline, of several the first */
    canopy_tx_mailbox_t mailboxes[CANOPY_CAN_MAILBOXES_MAX];
    _Atomic uint32_t sent;
    _Atomic uint32_t replaced;
    _Atomic uint32_t expired;
    _Atomic uint32_t trace_sent;
    _Atomic uint32_t trace_late;
} canopy_tx_t;

/** Where a transmit side has its memory. */
typedef struct {
    canopy_tx_slot_t *slots;  /**< One per message. */
    uint8_t *data;            /**< Twice the length of all messages. */
    canopy_tx_trace_t *trace; /**< Room for trace frames. */
    uint32_t trace_capacity;  /**< A power of two, >= 1. */
} canopy_tx_memory_t;

/**
 * Makes an empty transmit side. Before the driver's transmit context runs; canopy_loop_init() does it.
 * @param messages in the order of their urgency: the first is sent first
 * @return CANOPY_OK, or CANOPY_ERROR_ARGUMENT: memory is missing, or the room for trace frames is no power of two.
 *         O(messages).
 */
canopy_error_t canopy_tx_init(canopy_tx_t *self, const canopy_tx_message_t *messages, uint16_t count,
                              const canopy_tx_memory_t *memory, const canopy_can_t *can);

/**
 * Gives a message a new value, which replaces one that is not out. Loop's thread.
 * @param message its place in the table; not checked
 * @param output  the output image, for `encode`
 * @param until   when it must be out [us]. O(bytes).
 */
void canopy_tx_post(canopy_tx_t *self, uint16_t message, const void *output, canopy_time_t until);

/**
 * From now on every message owes a value: one that is posted after this call, and gets out. For the way back of a bus on
 * which nothing got out. Loop's thread. O(messages).
 */
void canopy_tx_owe(canopy_tx_t *self);

/** True until a value that a message owes is known to be out. Loop's thread. O(1). */
bool canopy_tx_owes(canopy_tx_t *self, uint16_t message);

/** A command is held back for others that are owed: it counts as replaced, and uses up no E2E counter. Loop's thread. O(1). */
void canopy_tx_hold(canopy_tx_t *self);

/** Lets a trace frame wait behind the commands. Loop's thread. One that finds no room is lost and counted. O(1). */
void canopy_tx_trace(canopy_tx_t *self, uint32_t id, uint8_t flags, const canopy_tx_trace_data_t *data,
                     canopy_time_t until);

/**
 * From now on no trace frame leaves: those that wait are dropped and counted by the next service, and so is the one in a
 * mailbox where the hardware can take it back. canopy_tx_resume_trace() ends that. Loop's thread. O(1).
 */
void canopy_tx_stop_trace(canopy_tx_t *self);

/** Trace frames that are posted from now on leave again. Loop's thread. O(1). */
static inline void canopy_tx_resume_trace(canopy_tx_t *self)
{
    atomic_store_explicit(&self->trace_stopped, false, memory_order_relaxed);
}

/**
 * The transmit context: takes note of what is out, takes back what is too late, fills the mailboxes. To be called by the
 * driver when a mailbox has become free, and after request(). A driver without request() leaves it to the loop.
 *
 * @param now the loop's clock [us], read in this context
 *
 * Does not block. O(mailboxes * (messages + bytes)) plus what the driver's functions take.
 */
void canopy_tx_service(canopy_tx_t *self, canopy_time_t now);

/** Sends what was posted, or lets the transmit context do it. Loop's thread, after posting, and as often as it likes. */
static inline void canopy_tx_kick(canopy_tx_t *self, canopy_time_t now)
{
    if (self->can->request != NULL) {
        self->can->request(self->can->context);
    } else {
        canopy_tx_service(self, now);
    }
}

/** True while a frame is in a mailbox, or waits for one, as the service saw it last. Anyone. O(1). */
static inline bool canopy_tx_is_busy(const canopy_tx_t *self)
{
    return atomic_load_explicit(&self->busy, memory_order_relaxed);
}

/** True when the last value of every message that was ever posted is known to be out. Loop's thread. O(messages). */
bool canopy_tx_is_out(const canopy_tx_t *self);

/**
 * True while the bus lets nothing through: a frame is not out at its deadline, and nothing has got out since it was handed
 * to the driver. One that only lost to more urgent ones does not count. Anyone. O(1).
 */
static inline bool canopy_tx_is_blocked(const canopy_tx_t *self)
{
    return atomic_load_explicit(&self->blocked, memory_order_relaxed);
}

/** Copies the counters, which saturate. Loop's thread. O(1). */
void canopy_tx_count(const canopy_tx_t *self, canopy_tx_counters_t *counters);

#endif
