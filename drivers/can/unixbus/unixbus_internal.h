/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Between the files of the unixbus driver: the datagram's format (unixbus_datagram.c), the folder with the other
 * participants' sockets (unixbus_folder.c), and the way to them (unixbus_send.c).
 */
#ifndef CANOPY_UNIXBUS_INTERNAL_H
#define CANOPY_UNIXBUS_INTERNAL_H

#include <poll.h>

#include "canopy/can/unixbus.h"

#define CANOPY_UNIXBUS_HEADER 8u
#define CANOPY_UNIXBUS_DATAGRAM_MAX (CANOPY_UNIXBUS_HEADER + CANOPY_CAN_DATA_MAX)

/** Byte of the header: how many frames of the sender the receiver has lost before this one. */
#define CANOPY_UNIXBUS_LOST 3u

/** Writes a valid frame as a datagram that tells of no losses. @return its size [bytes], at most CANOPY_UNIXBUS_DATAGRAM_MAX */
size_t canopy_unixbus_encode(uint8_t *datagram, const canopy_can_frame_t *frame);

/** Reads a datagram. @return false when it is not exactly one valid frame; *frame is not defined then. */
bool canopy_unixbus_decode(canopy_can_frame_t *frame, const uint8_t *datagram, size_t size);

/** Finds the folder of a bus, makes it if need be, and chooses the own socket's name. Errors as in unixbus.h. */
canopy_error_t canopy_unixbus_folder_init(canopy_unixbus_folder_t *folder, const char *bus);

/**
 * Binds the socket to its name in the folder. Nobody sees the name before the socket can be sent to, by all who may write
 * the folder. Fails with EUSERS when the bus has as many participants as it can have.
 */
canopy_error_t canopy_unixbus_folder_join(canopy_unixbus_folder_t *folder, int socket);

/**
 * Brings the list of participants up to date, reading the folder only when it has changed. Where the operating system
 * cannot read it just now, the list stays as it was and is read the next time.
 *
 * @param next number of the frame that newcomers get first
 * @return CANOPY_OK; CANOPY_ERROR_BUS_DOWN: the folder or the own socket in it is gone; CANOPY_ERROR_IO: it could never be
 *         read yet, so that nobody knows who is there.
 */
canopy_error_t canopy_unixbus_folder_refresh(canopy_unixbus_folder_t *folder, uint32_t next);

/** Writes the path of a socket in the folder. @return false: it is too long for one */
bool canopy_unixbus_folder_address(const canopy_unixbus_folder_t *folder, const char *name,
                                   struct sockaddr_un *address);

/** Takes a participant out of the list (its place is taken by the last one). */
void canopy_unixbus_folder_forget(canopy_unixbus_folder_t *folder, size_t index);

/** Takes all participants out of the list. */
void canopy_unixbus_folder_clear(canopy_unixbus_folder_t *folder);

/** CLOCK_MONOTONIC [us]. */
int64_t canopy_unixbus_now(void);

/** Starts with nothing sent, in the folder of a bus. Errors as in unixbus.h. */
canopy_error_t canopy_unixbus_tx_open(canopy_unixbus_tx_t *self, const char *bus);

/** Gives back what canopy_unixbus_tx_open() has taken. Both threads have ended their work with it. */
void canopy_unixbus_tx_close(canopy_unixbus_tx_t *self);

/** Sends a frame to everybody, without waiting for anybody. @return as canopy_can_t.send */
int canopy_unixbus_tx_send(canopy_unixbus_tx_t *self, const canopy_can_frame_t *frame);

/** Participants that are behind, for poll(). */
typedef struct {
    size_t count;
    struct pollfd sockets[CANOPY_UNIXBUS_PEERS_MAX];
} canopy_unixbus_waiting_t;

/**
 * Offers participants that were full what they have not got yet.
 *
 * @param waiting[in,out] of the last call, as poll() has left it: who has room is not kept waiting; then those who are still
 *                        behind
 * @return after how long it has to be called again, if nobody has room before [us]; negative: everybody has got everything
 */
int64_t canopy_unixbus_tx_catch_up(canopy_unixbus_tx_t *self, canopy_unixbus_waiting_t *waiting);

/** Waits, not for long, until everybody who takes frames has got all of them. */
void canopy_unixbus_tx_finish(canopy_unixbus_tx_t *self);

/** Whether the folder and the own socket in it are there. */
bool canopy_unixbus_tx_is_joined(canopy_unixbus_tx_t *self);

#endif
