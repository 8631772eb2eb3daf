/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Between the files of the unixbus driver: the datagram's format (unixbus_datagram.c) and the folder with the other
 * participants' sockets (unixbus_folder.c).
 */
#ifndef CANOPY_UNIXBUS_INTERNAL_H
#define CANOPY_UNIXBUS_INTERNAL_H

#include "canopy/can/unixbus.h"

#define CANOPY_UNIXBUS_HEADER 8u
#define CANOPY_UNIXBUS_DATAGRAM_MAX (CANOPY_UNIXBUS_HEADER + CANOPY_CAN_DATA_MAX)

/** Writes a valid frame as a datagram. @return its size [bytes], at most CANOPY_UNIXBUS_DATAGRAM_MAX. */
size_t canopy_unixbus_encode(uint8_t *datagram, const canopy_can_frame_t *frame);

/** Reads a datagram. @return false when it is not exactly one valid frame; *frame is not defined then. */
bool canopy_unixbus_decode(canopy_can_frame_t *frame, const uint8_t *datagram, size_t size);

/** Finds the folder of a bus, makes it if need be, and chooses the own socket's name. Errors as in unixbus.h. */
canopy_error_t canopy_unixbus_folder_init(canopy_unixbus_folder_t *folder, const char *bus);

/** Binds the socket to its name in the folder. Nobody sees the name before the socket can be sent to. */
canopy_error_t canopy_unixbus_folder_join(canopy_unixbus_folder_t *folder, int socket);

/**
 * Brings the list of participants up to date, reading the folder only when it has changed.
 *
 * @return CANOPY_OK, or CANOPY_ERROR_BUS_DOWN: the folder or the own socket in it is gone.
 */
canopy_error_t canopy_unixbus_folder_refresh(canopy_unixbus_folder_t *folder);

/** Takes a participant out of the list (its place is taken by the last one). */
void canopy_unixbus_folder_forget(canopy_unixbus_folder_t *folder, size_t index);

#endif
