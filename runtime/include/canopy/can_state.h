/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The state of the CAN bus as a controller sees it, and its way back after bus-off: one state machine for every driver.
 *
 * The driver says what its controller says of itself (canopy_can_t.state), the transmit side whether anything gets out.
 * A controller that is bus-off, down or gone is restarted, after a pause that doubles with each attempt up to
 * CANOPY_CAN_RESTART_LONGEST_US, so that a node with a short circuit does not disturb the others for ever. The pause is
 * the shortest again when the controller has been up for CANOPY_CAN_SETTLED_US.
 *
 * Leaves see the state in the input image. Threads: the loop's thread only.
 */
#ifndef CANOPY_CAN_STATE_H
#define CANOPY_CAN_STATE_H

#include <stdbool.h>
#include <stdint.h>

#include "canopy/can.h"
#include "canopy/clock.h"

/** The state of the bus. The numbers are stable: they are in the trace. From BUS_OFF on nothing is sent or received. */
typedef enum {
    CANOPY_CAN_ERROR_ACTIVE = 0, /**< As it should be. */
    CANOPY_CAN_ERROR_WARNING,    /**< Many errors lately: an error counter is at 96 or more. */
    CANOPY_CAN_ERROR_PASSIVE, /**< So many that this controller no longer disturbs others: a counter at 128 or more. */
    CANOPY_CAN_BLOCKED,       /**< The controller works, and nothing of what it is to send gets out in time. */
    CANOPY_CAN_BUS_OFF,       /**< The controller has taken itself off the bus. */
    CANOPY_CAN_DOWN,          /**< The interface is switched off. */
    CANOPY_CAN_GONE           /**< The interface does not exist any more. */
} canopy_can_state_t;

#define CANOPY_CAN_RESTART_FIRST_US UINT64_C(50000)     /**< From the fault to the first attempt. */
#define CANOPY_CAN_RESTART_LONGEST_US UINT64_C(5000000) /**< Between attempts, at most. */
#define CANOPY_CAN_SETTLED_US UINT64_C(1000000)         /**< Up for so long: it counts as mended. */

/** The state machine. All zero is the start. Members but `state` and the counters are private. */
typedef struct {
    canopy_can_state_t state;
    canopy_time_t since; /* when it was last seen to work, or to fail */
    canopy_time_t next;  /* attempt */
    canopy_time_t pause; /* before the attempt after that; 0: the shortest */
    uint32_t failures;   /**< How often the bus became unusable. Saturates. */
    uint32_t restarts;   /**< Attempts. Saturates. */
} canopy_can_manager_t;

/** True when nothing can be sent or received. O(1); may be called from anywhere. */
static inline bool canopy_can_is_unusable(canopy_can_state_t state)
{
    return state >= CANOPY_CAN_BUS_OFF;
}

/**
 * One step, in each cycle: asks the driver, restarts where it is time.
 * @param blocked canopy_tx_is_blocked(); not looked at in the first step after an unusable bus
 * @return the state. O(1).
 */
canopy_can_state_t canopy_can_manager_step(canopy_can_manager_t *self, const canopy_can_t *can, bool blocked,
                                           canopy_time_t now);

#endif
