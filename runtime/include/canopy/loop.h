/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The fixed-period loop, one scan cycle as in a PLC: drain what has arrived into the input image, tick, commit the
 * output image, trace, account for time.
 *
 *     static const canopy_loop_config_t config = {.app = &nao_home_app, .can = &can, .clock = &clock};
 *     canopy_loop_t loop;
 *     if (canopy_loop_init(&loop, &config) == CANOPY_OK) canopy_loop_run(&loop);
 *
 * Several trees in one program are several loops: canopy_loop_run_all() (docs/several-trees.md).
 *
 * Threads: everything of one loop runs in one thread. A driver may fill its queue from an interrupt meanwhile.
 */
#ifndef CANOPY_LOOP_H
#define CANOPY_LOOP_H

#include "canopy/acceptance.h"
#include "canopy/bus.h"
#include "canopy/can.h"
#include "canopy/can_state.h"
#include "canopy/clock.h"
#include "canopy/trace.h"
#include "canopy/tree.h"
#include "canopy/tx.h"

/** One application: constant tables, and where its static memory lies. Made by `canopy compile`. */
typedef struct {
    const char *name;
    canopy_time_t period; /**< [us], > 0. */
    const canopy_tree_t *tree;
    const canopy_bus_t *bus;
    const canopy_trace_config_t *trace;        /**< NULL: no trace. */
    const canopy_can_acceptance_t *acceptance; /**< What it receives: for the driver's filter. */
    uint32_t rx_max;                           /**< Frames that the bus can carry in one period, > 0. */
    uint32_t frame_us;                         /**< How long the bus takes for a frame of 8 bytes [us], > 0. */
    uint32_t trace_ticks; /**< Ticks whose trace has room in tx_memory: a frame waits so many periods longer. */
    void *memory; /**< The application's one static object; handed to the leaves' functions. The rest lies in it: */
    void (*start)(
        void *memory); /**< First values of entries and of your nodes' state, for canopy_loop_init(); or NULL. */
    canopy_tree_instance_t *tree_instance;
    uint8_t *status; /**< tree->node_count; with a trace, of an array of uint32_t. */
    uint16_t *words; /**< tree->word_count. */
    canopy_bus_state_t *bus_state;
    void *input;           /**< The input image. */
    void *output;          /**< The output image. */
    canopy_rx_state_t *rx; /**< bus->rx_count. */
    canopy_tx_t *tx;       /**< The transmit side: for the driver's transmit interrupt. */
    canopy_tx_memory_t tx_memory;
    canopy_trace_state_t *trace_state; /**< NULL without trace, as the next two. */
    uint8_t *sent;                     /**< nodes_max; of an array of uint32_t. */
    uint32_t *told;                    /**< trace->value_count, or NULL. */
    uint16_t nodes_max;                /**< Nodes that `status` and `sent` have room for: of the largest tree image. */
} canopy_app_t;

/** Numbers of the fault hook; stable. */
typedef enum {
    CANOPY_FAULT_LEAF_STATUS = 1, /**< A leaf returned no valid status; detail: its node. */
    CANOPY_FAULT_OVERRUN = 2,     /**< A cycle was not done when the next was due; detail: its length [us]. */
    CANOPY_FAULT_CAN_RECEIVE = 3, /**< The driver's receive failed; detail: minus the canopy_error_t. */
    CANOPY_FAULT_RX_BACKLOG =
        4,                    /**< The second cycle in a row that left frames waiting; detail: cycles with a backlog. */
    CANOPY_FAULT_RX_LOST = 5, /**< The driver has lost received frames; detail: how many since the last cycle. */
    CANOPY_FAULT_CAN_STATE = 6,  /**< The state of the bus has changed; detail: the new canopy_can_state_t. */
    CANOPY_FAULT_TX_EXPIRED = 7, /**< Commands were not out at their deadline; detail: how many since the last cycle. */
    CANOPY_FAULT_TX_REPLACED = 8 /**< Commands were not out when a newer value came; detail: the same. */
} canopy_fault_t;

/** What the loop works with. Constant. */
typedef struct {
    void *context; /**< Handed to the functions below. */
    const canopy_app_t *app;
    const canopy_can_t *can;
    const canopy_clock_t *clock;
    /** Most frames taken in one cycle, so that a flooded bus cannot hold up the tick; 0: the application's, which is what
     * the bus can carry in a period. The rest waits. */
    uint32_t rx_max;
    /** Longest time that canopy_loop_stop() waits until the safe values are out [us]; 0: CANOPY_LOOP_STOP_US. */
    canopy_time_t stop_us;
    /** Called after a cycle that was in time; a late one does not kick. NULL: no watchdog. */
    void (*kick_watchdog)(void *context);
    /** Called for each fault, from the loop's thread. NULL: counters only. */
    void (*on_fault)(void *context, canopy_fault_t fault, uint32_t detail);
    /** Called after each cycle; false ends canopy_loop_run(). NULL: runs until the clock's wait_until() is false. */
    bool (*after_cycle)(void *context, canopy_status_t root);
} canopy_loop_config_t;

#define CANOPY_LATENESS_BUCKETS 12u

/** How long canopy_loop_stop() waits for the bus if the configuration does not say [us]. */
#define CANOPY_LOOP_STOP_US UINT64_C(100000)

/** State and accounts of a loop. Counters saturate; `ticks` alone wraps around, for it also says which messages are due. */
typedef struct {
    const canopy_loop_config_t *config;
    canopy_time_t deadline; /**< When the next cycle is to start [us]. */
    uint32_t ticks;         /**< Cycles done, modulo 2^32. */
    uint32_t overruns;      /**< Cycles that were not done before the next was due. */
    uint32_t slips;         /**< Cycles left out after overruns; the phase is kept. */
    uint32_t rx_backlogs;   /**< Cycles that left frames waiting because of rx_max. */
    uint32_t rx_errors;     /**< Failures of the driver's receive. */
    uint32_t rx_lost;       /**< Frames that the driver has lost, as its counter says. */
    uint32_t tx_expired;    /**< Commands that were not out at their deadline. */
    uint32_t tx_replaced;   /**< Commands that were not out when a newer value came. */
    bool backlog;           /**< The last cycle left frames waiting. */
    bool returning;         /**< The bus was unusable: safe values go out until one of each message is out. */
    canopy_can_manager_t can_manager;
    canopy_time_t longest_cycle; /**< [us] */
    canopy_time_t most_late;     /**< Latest start of a cycle after its deadline [us]. */
    /** Starts of cycles by lateness: bucket i counts those below 16 us << i and not below the one before; the last
     * one takes the rest. */
    uint32_t lateness[CANOPY_LATENESS_BUCKETS];
} canopy_loop_t;

/**
 * Sets up a loop and its application: tree IDLE, all counters 0, first deadline now.
 * @return CANOPY_OK; CANOPY_ERROR_ARGUMENT when something needed is NULL, or 0. O(nodes + messages).
 */
canopy_error_t canopy_loop_init(canopy_loop_t *self, const canopy_loop_config_t *config);

/**
 * One scan cycle, without waiting and without accounting for time: for programs that keep their own time.
 * @param now this cycle's time [us]
 * @return status of the root
 *
 * O(nodes + messages + frames waiting, rx_max at most), and what the leaves take. Does not block. A program that calls it
 * by itself, with a driver without request(), calls canopy_tx_service() in between while canopy_tx_is_busy().
 */
canopy_status_t canopy_loop_cycle(canopy_loop_t *self, canopy_time_t now);

/**
 * The cycle that is due at `deadline`, now, with all accounts: as canopy_loop_cycle(), and then `deadline` is the next
 * one. For programs that wait by themselves; call it when the clock has reached `deadline`, not before.
 * @return false when after_cycle says stop; the tree is not halted then: canopy_loop_stop() does it.
 */
bool canopy_loop_step(canopy_loop_t *self);

/**
 * Cycles at the period until the clock or after_cycle says stop, then canopy_loop_stop(). Deadlines are absolute: lateness
 * does not add up. After an overrun the cycles that are past are left out. While frames wait for the bus, a driver without
 * request() is served every `frame_us` of the application, until the next deadline.
 * @return as canopy_loop_stop().
 */
canopy_error_t canopy_loop_run(canopy_loop_t *self);

/**
 * canopy_loop_run() for several loops in one thread, each at its own period: always the one whose deadline is first; of
 * several due together, the first in the list. A cycle is not interrupted, so it delays those that become due meanwhile:
 * that counts as their lateness, and as an overrun when they are not done in time. One that says stop stops all.
 *
 * @param loops set up, each with an application of its own, and all with the same clock. Their first deadlines, and so
 *              their phases, are when they were set up; add an offset to `deadline` before the run for others.
 * @param count >= 1. O(count) more for each cycle.
 * @return CANOPY_OK, or the first error of a canopy_loop_stop().
 */
canopy_error_t canopy_loop_run_all(canopy_loop_t *const *loops, uint16_t count);

/**
 * Halts the tree, and sends the outputs that result (safe values, unless a halt handler wrote others) until they are known
 * to be out. canopy_loop_run() does it at its end.
 *
 * Blocks until then, `stop_us` of the configuration at most. After that nothing leaves any more.
 *
 * @return CANOPY_OK: every command message is out with these values, as far as the driver can know (its header says how
 *         far). CANOPY_ERROR_BUS_DOWN: not all are; the receivers' timeouts must stop the robot.
 *
 * O(nodes + messages).
 */
canopy_error_t canopy_loop_stop(canopy_loop_t *self, canopy_time_t now);

#endif
