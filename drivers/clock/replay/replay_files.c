/* SPDX-License-Identifier: MIT */
/**
 * @file
 * A replay from a file, and into one; the contract is in replay_files.h.
 */
#include "canopy/clock/replay_files.h"

#include <errno.h>
#include <string.h>

#include "unixbus_internal.h"

static int read_frame(void *context, canopy_can_frame_t *frame)
{
    canopy_replay_files_t *self = context;
    uint8_t bytes[CANOPY_UNIXBUS_DATAGRAM_MAX];
    size_t data = 0;
    size_t header = fread(bytes, 1, CANOPY_UNIXBUS_HEADER, self->record);

    if (header == 0u && feof(self->record)) {
        return 0;
    }
    if (header == CANOPY_UNIXBUS_HEADER && (bytes[1] & CANOPY_CAN_REMOTE) == 0 && bytes[2] <= CANOPY_CAN_DATA_MAX) {
        data = fread(bytes + CANOPY_UNIXBUS_HEADER, 1, bytes[2], self->record);
    }
    return canopy_unixbus_decode(frame, bytes, header + data) ? 1 : CANOPY_ERROR_IO;
}

static int write_frame(void *context, const canopy_can_frame_t *frame)
{
    canopy_replay_files_t *self = context;
    uint8_t bytes[CANOPY_UNIXBUS_DATAGRAM_MAX];
    size_t size = canopy_unixbus_encode(bytes, frame);

    return fwrite(bytes, 1, size, self->sent) == size ? 1 : CANOPY_ERROR_IO;
}

static FILE *open_file(const char *path, const char *mode, char *message, size_t message_size)
{
    FILE *file = fopen(path, mode);

    if (file == NULL) {
        /* Programs open their replay before they start threads that might ask for an error's text too. */
        const char *cause = strerror(errno); /* NOLINT(concurrency-mt-unsafe) */
        (void)snprintf(message, message_size, "%s: %s", path, cause);
    }
    return file;
}

static void close_file(FILE **file)
{
    if (*file != NULL) {
        (void)fclose(*file);
        *file = NULL;
    }
}

canopy_error_t canopy_replay_open(canopy_replay_files_t *self, const char *record, const char *sent,
                                  const canopy_trace_config_t *trace, char *message, size_t message_size)
{
    const canopy_replay_io_t io = {.context = self, .read = read_frame, .write = sent != NULL ? write_frame : NULL};
    canopy_error_t error;

    self->sent = NULL;
    self->record = open_file(record, "rb", message, message_size);
    if (self->record == NULL) {
        return CANOPY_ERROR_NOT_FOUND;
    }
    error = canopy_replay_init(&self->replay, &io, trace);
    if (error == CANOPY_ERROR_UNSUPPORTED) {
        (void)snprintf(message, message_size,
                       "this application does not send both CanopyInputs and CanopyArrivals; add them to its DBC "
                       "(docs/trace.md)");
    } else if (error != CANOPY_OK) {
        (void)snprintf(message, message_size, "%s: is no record of this application; `canopy replay --keep` makes one",
                       record);
    } else if (sent != NULL) {
        self->sent = open_file(sent, "wb", message, message_size);
        error = self->sent != NULL ? CANOPY_OK : CANOPY_ERROR_IO;
    }
    if (error != CANOPY_OK) {
        close_file(&self->record);
    }
    return error;
}

canopy_error_t canopy_replay_close(canopy_replay_files_t *self)
{
    canopy_error_t error = canopy_replay_error(&self->replay);

    close_file(&self->record);
    if (self->sent != NULL && fclose(self->sent) != 0 && error == CANOPY_OK) {
        error = CANOPY_ERROR_IO; /* the disk is full: seen only when the last bytes are written */
    }
    self->sent = NULL;
    return error;
}
