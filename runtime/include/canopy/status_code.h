/* SPDX-License-Identifier: MIT */
/**
 * @file
 * How the engine keeps a node's status in one byte, and the status code that the trace and other tools show of it.
 *
 * The byte: the last result plus CANOPY_STATUS_BASE, and three bits. So "RUNNING now" is one bit, and the engine stores a
 * result as the low byte of a canopy_step_t: neither costs the tick an instruction.
 *
 * For the engine, for node types of your own through canopy/node.h, and for tools. A program asks canopy_tree_status().
 */
#ifndef CANOPY_STATUS_CODE_H
#define CANOPY_STATUS_CODE_H

#include <stdbool.h>
#include <stdint.h>

#include "canopy/status.h"

/** RUNNING, SUCCESS, FAILURE, SKIPPED are kept as 7, 8, 9, 10: only RUNNING has CANOPY_STATUS_RUNS. */
#define CANOPY_STATUS_BASE 6u
#define CANOPY_STATUS_RUNS 4u
/** The parent has reset the node: it is IDLE. A RUNNING node that is halted loses CANOPY_STATUS_RUNS. */
#define CANOPY_STATUS_WAS 16u
/** The node has not been ticked since this bit was set: the trace sets it in all nodes when it has told of a tick. */
#define CANOPY_STATUS_OLD 32u
/** A node that was never ticked. */
#define CANOPY_STATUS_NEVER CANOPY_STATUS_OLD

/** The byte of a node that has just returned `status`, one of RUNNING to SKIPPED. */
static inline uint8_t canopy_status_stored(canopy_status_t status)
{
    return (uint8_t)((unsigned)status + CANOPY_STATUS_BASE);
}

/** The byte of a node that its parent resets: one that is RUNNING counts as halted. */
static inline uint8_t canopy_status_reset(uint8_t stored)
{
    return (uint8_t)((stored & ~CANOPY_STATUS_RUNS) | CANOPY_STATUS_WAS);
}

/** Is the node RUNNING now? */
static inline bool canopy_status_runs(uint8_t stored)
{
    return (stored & CANOPY_STATUS_RUNS) != 0u;
}

/** Has the node returned SKIPPED, and has not been reset since? */
static inline bool canopy_status_is_skipped(uint8_t stored)
{
    return (stored & ~CANOPY_STATUS_OLD) == (unsigned)CANOPY_SKIPPED + CANOPY_STATUS_BASE;
}

/** Has the node returned SUCCESS or FAILURE, and has not been reset since? They differ in the lowest bit. */
static inline bool canopy_status_is_completed(uint8_t stored)
{
    return (stored & ~(CANOPY_STATUS_OLD | 1u)) == (unsigned)CANOPY_SUCCESS + CANOPY_STATUS_BASE;
}

/** What the node returned last, whether it has been reset or not; IDLE: nothing yet. */
static inline canopy_status_t canopy_status_last(uint8_t stored)
{
    unsigned low = stored & 15u;

    if ((stored & (CANOPY_STATUS_WAS | 15u)) == (CANOPY_STATUS_WAS | 3u)) {
        return CANOPY_RUNNING; /* halted */
    }
    return low > CANOPY_STATUS_BASE && low <= CANOPY_STATUS_BASE + (unsigned)CANOPY_SKIPPED
               ? (canopy_status_t)(low - CANOPY_STATUS_BASE)
               : CANOPY_IDLE;
}

/** The node's status now: IDLE when its parent has reset it. */
static inline canopy_status_t canopy_status_now(uint8_t stored)
{
    return (stored & CANOPY_STATUS_WAS) != 0u ? CANOPY_IDLE : canopy_status_last(stored);
}

/*
 * Status codes: 4 bits, docs/trace.md. 0: never ticked. 1..4: canopy_status_t, ticked in this tick. Else one of these plus
 * the last result:
 */
#define CANOPY_CODE_KEPT 4u          /**< 5..8: not ticked in this tick. */
#define CANOPY_CODE_RESET 8u         /**< 9..11: ticked in this tick, and reset since. */
#define CANOPY_CODE_RESET_BEFORE 11u /**< 12..14: not ticked in this tick, and reset. */
#define CANOPY_CODE_NONE 15u         /**< No node. */

/** The status code of a node. A SKIPPED one has nothing to forget: that it was reset is not told. */
static inline uint8_t canopy_status_code(uint8_t stored)
{
    const canopy_status_t status = canopy_status_last(stored);
    unsigned last = (unsigned)status;
    bool is_old = (stored & CANOPY_STATUS_OLD) != 0u;

    if (status == CANOPY_IDLE) {
        return 0;
    }
    if ((stored & CANOPY_STATUS_WAS) == 0u || status == CANOPY_SKIPPED) {
        return (uint8_t)(last + (is_old ? CANOPY_CODE_KEPT : 0u));
    }
    return (uint8_t)(last + (is_old ? CANOPY_CODE_RESET_BEFORE : CANOPY_CODE_RESET));
}

#endif
