/* SPDX-License-Identifier: MIT */
/**
 * @file
 * An application in one program with what surrounds it: a bus and a clock in memory. For runs of millions of ticks, for
 * simulations, and on targets that have no CAN. The application is the same as everywhere: its frames go through the loop,
 * E2E and the codec; only the wire is missing.
 *
 *     canopy_in_process_init(&host, &nao_home_app, sensors, NAO_HOME_RX_MESSAGES, &world, true);
 *     canopy_in_process_put(&host, battery, bytes, 0);
 *     canopy_in_process_tick(&host);
 *
 * A world (a simulated robot) takes part through three functions: before each tick it puts what its sensors show, during
 * it it is handed the frames that the application sends, and after it it makes one step. Without a world the program puts
 * and reads by itself, between ticks.
 *
 * One application is one instance, for its memory is static. Several at once are several copies of one shared library:
 * cmake/CanopyInProcess.cmake makes it, the Python package canopy.inprocess loads it (docs/in-process.md).
 *
 * Threads: none, nothing blocks, nothing is allocated. Needs no operating system.
 */
#ifndef CANOPY_IN_PROCESS_H
#define CANOPY_IN_PROCESS_H

#include "canopy/loop.h"

/** What a message that the application receives will bring. Private; canopy_in_process_init() sets it up. */
typedef struct {
    uint8_t data[CANOPY_CAN_DATA_MAX];
    canopy_time_t age;
    uint16_t queued; /* the message that was put as the i-th since the last tick; i is this one's place */
    uint8_t counter; /* E2E, of the next frame */
    bool is_due;
    bool is_held;
} canopy_in_process_sensor_t;

typedef struct canopy_in_process canopy_in_process_t;

/** What surrounds the application. Each function may be NULL. */
typedef struct {
    void *context; /**< Handed to the functions. */
    /** Before a tick: puts what the sensors show now, canopy_in_process_put(). */
    void (*sense)(void *context, canopy_in_process_t *host);
    /** During a tick: a frame that the application sends; commands in the order of their urgency, then the trace. */
    void (*take)(void *context, const canopy_can_frame_t *frame);
    /** After a tick: one step. @return false ends canopy_in_process_run(). */
    bool (*step)(void *context);
} canopy_world_t;

/** One application, its bus and its clock. Read `now`, `root`, `ticks` and the loop's counters; leave the rest alone. */
struct canopy_in_process {
    canopy_time_t now; /**< Of the next tick [us]; may be set to a later time. */
    uint64_t ticks;
    canopy_status_t root; /**< Of the last tick. */
    bool has_ended;       /**< The world's last step said so. */
    canopy_loop_t loop;
    canopy_app_t app; /* the application's without a trace: what runs where none is wanted */
    canopy_can_t can;
    canopy_clock_t clock;
    canopy_loop_config_t config;
    const canopy_world_t *world;
    canopy_in_process_sensor_t *sensors; /* one per received message */
    uint16_t due;                        /* messages put since the last tick */
    uint16_t taken;                      /* of these the loop has taken so many */
    uint16_t held;
    /** Told of every frame, those that come in and those that go out, in their order. NULL: nobody. */
    void (*tap)(void *context, const canopy_can_frame_t *frame);
    void *tap_context;
    /** A byte per node: bit s is set once the node has had status s. NULL: nobody wants to know. */
    uint8_t *seen;
};

/** What canopy_in_process_find() gives when there is no such message. */
#define CANOPY_IN_PROCESS_NONE UINT16_MAX

/**
 * Sets up the application, as canopy_loop_init() does, with the clock at 0. The object stays where it is.
 *
 * @param app        made by `canopy compile`
 * @param sensors    room for the messages that it receives; lives as long as the object
 * @param count      places in it; at least app->bus->rx_count
 * @param world      NULL: none
 * @param with_trace false: no trace frames are made, which saves their time
 * @return CANOPY_OK, or CANOPY_ERROR_ARGUMENT. O(nodes + messages).
 */
canopy_error_t canopy_in_process_init(canopy_in_process_t *self, const canopy_app_t *app,
                                      canopy_in_process_sensor_t *sensors, uint16_t count, const canopy_world_t *world,
                                      bool with_trace);

/** The place of a message that the application receives, for put; CANOPY_IN_PROCESS_NONE. O(messages). */
uint16_t canopy_in_process_find(const canopy_in_process_t *self, uint32_t id, bool is_extended);

/**
 * A frame of this message comes in with the next tick, protected as its E2EDataId wants. Put again before that, the newer
 * bytes count.
 * @param message from canopy_in_process_find(); not checked
 * @param data    as many bytes as the message has; where it is protected, the first 12 bits are not looked at
 * @param age     since it was on the wire when the tick takes it [us]. O(bytes).
 */
void canopy_in_process_put(canopy_in_process_t *self, uint16_t message, const uint8_t *data, canopy_time_t age);

/** From now on the last bytes put come again with every tick; false: no more. */
void canopy_in_process_hold(canopy_in_process_t *self, uint16_t message, bool is_held);

/** One cycle of the loop, and of the world. @return the root's status. */
canopy_status_t canopy_in_process_tick(canopy_in_process_t *self);

/**
 * At most `ticks` cycles, one after the other.
 * @param until bit s: ends after a tick whose root had status s (1u << CANOPY_SUCCESS, for example); 0: none ends it
 * @return how many were made
 */
uint64_t canopy_in_process_run(canopy_in_process_t *self, uint64_t ticks, uint32_t until);

/**
 * The bytes of a message that the application sends, as the output image has them now, due or not; without CRC and counter.
 * @param message place in app->bus->tx; not checked
 * @param data    as many bytes as the message has. O(bytes).
 */
void canopy_in_process_read(const canopy_in_process_t *self, uint16_t message, uint8_t *data);

/** An entry of the blackboard: where it lies in the application's memory. Generated code makes a table of them. */
typedef struct {
    const char *name; /**< With the path of its subtree before it. */
    const char *type; /**< In C. */
    const char *step; /**< Of fixed point; else "1". */
    uint32_t size;    /**< [bytes] */
    const void *address;
    char
        kind; /**< 'b' bool, 'i' signed, 'u' unsigned, 'f' floating point, 't' place in the table of texts, 'o' other. */
} canopy_in_process_entry_t;

#endif
