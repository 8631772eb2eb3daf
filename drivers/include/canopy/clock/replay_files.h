/* SPDX-License-Identifier: MIT */
/**
 * @file
 * A replay from a file, and into one: canopy/clock/replay.h for programs on a desk. `canopy replay` makes the record and
 * reads what was sent.
 *
 * A record begins with CANOPY_REPLAY_BEGIN. Its items follow one behind the other, numbers with the low byte first:
 *
 *   'T', the time of a tick [us] (8 bytes), CanState (1 byte, canopy_can_state_t), 1 * overload + 2 * returning (1 byte)
 *   'F', the age of a frame [ms] (2 bytes), the frame
 *
 * Frames are as the unixbus writes them (docs/unixbus.md): 8 bytes of header, which say how many bytes of data follow. The
 * file of what was sent holds frames alone.
 *
 * Threads: the loop's thread only. Reading and writing block as long as the file system does.
 */
#ifndef CANOPY_CLOCK_REPLAY_FILES_H
#define CANOPY_CLOCK_REPLAY_FILES_H

#include <stddef.h>
#include <stdio.h>

#include "canopy/clock/replay.h"

/** A record's first bytes, with the number of its version. */
#define CANOPY_REPLAY_BEGIN "CANOPY RECORD 2\n"

/** Bytes that every error's text fits into. */
#define CANOPY_REPLAY_MESSAGE 512u

/** The pair and its files. Owned by the caller, stays where it is. */
typedef struct {
    canopy_replay_t replay; /**< Hand &replay.can and &replay.clock to the loop. */
    FILE *record;           /* private, as the next one */
    FILE *sent;
} canopy_replay_files_t;

/**
 * Opens a record and makes the pair.
 *
 * @param record  path of the record
 * @param sent    path of a new file for the frames that the controller sends, one that is there is overwritten; NULL: none
 * @param message receives one line for people when it fails: what was wrong, and the way out
 * @return CANOPY_OK; CANOPY_ERROR_NOT_FOUND, CANOPY_ERROR_IO: a file; or what canopy_replay_init() says. On an error all is
 *         closed.
 */
canopy_error_t canopy_replay_open(canopy_replay_files_t *self, const char *record, const char *sent, char *message,
                                  size_t message_size);

/**
 * Closes both files.
 * @return CANOPY_OK when the whole record was replayed and everything sent was written; else the first error.
 */
canopy_error_t canopy_replay_close(canopy_replay_files_t *self);

#endif
