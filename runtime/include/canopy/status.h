/* SPDX-License-Identifier: MIT */
/**
 * @file
 * What a node of the tree returns, and what the runtime's functions return.
 */
#ifndef CANOPY_STATUS_H
#define CANOPY_STATUS_H

/**
 * Status of a node. The numbers are those of BehaviorTree.CPP 4, so that a trace needs no translation.
 *
 * A leaf returns SUCCESS or FAILURE; an action may return RUNNING; SKIPPED means "as if this child were not there".
 * A leaf that returns anything else counts as FAILURE and raises the fault counter (rule 7 of docs/semantics.md).
 */
typedef enum {
    CANOPY_IDLE = 0,
    CANOPY_RUNNING = 1,
    CANOPY_SUCCESS = 2,
    CANOPY_FAILURE = 3,
    CANOPY_SKIPPED = 4
} canopy_status_t;

/**
 * Results of functions that can fail. Negative, so that a positive return can be a count and 0 is "nothing, and no
 * error". The numbers are stable: they may be logged and sent.
 */
typedef enum {
    CANOPY_OK = 0,
    CANOPY_ERROR_ARGUMENT = -1,    /**< A pointer is NULL or a value is out of its documented range. */
    CANOPY_ERROR_TREE = -2,        /**< The node table is not well formed. */
    CANOPY_ERROR_BUS_DOWN = -3,    /**< The CAN interface is down, gone, or bus-off. */
    CANOPY_ERROR_IO = -4,          /**< The driver's device failed in another way. */
    CANOPY_ERROR_UNSUPPORTED = -5, /**< The driver cannot do this (e.g. a CAN FD frame on a classic bus). */
    CANOPY_ERROR_NOT_FOUND = -6    /**< The named device or bus does not exist. */
} canopy_error_t;

#endif
