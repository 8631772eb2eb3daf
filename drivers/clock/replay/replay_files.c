/* SPDX-License-Identifier: MIT */
/**
 * @file
 * A replay from a file, and into one; the contract is in replay_files.h.
 */
#include "canopy/clock/replay_files.h"

#include <errno.h>
#include <string.h>

#include "unixbus_internal.h"

/* Of an item: 'T', the time (8 bytes, low byte first), CanState, 1 overload + 2 returning; or 'F', the age (2 bytes), and
 * the frame as the unixbus writes it. */
enum { TICK_BYTES = 10, TIME_BYTES = 8, FRAME_BYTES = 2 + CANOPY_UNIXBUS_HEADER, OVERLOAD = 1, RETURNING = 2 };

static int read_tick(FILE *record, canopy_replay_item_t *item)
{
    uint8_t bytes[TICK_BYTES];

    if (fread(bytes, 1, sizeof bytes, record) != sizeof bytes) {
        return CANOPY_ERROR_IO;
    }
    *item = (canopy_replay_item_t){.is_tick = true,
                                   .conditions = {.can_state = bytes[TIME_BYTES],
                                                  .overload = (bytes[TIME_BYTES + 1] & (unsigned)OVERLOAD) != 0u,
                                                  .returning = (bytes[TIME_BYTES + 1] & (unsigned)RETURNING) != 0u}};
    for (unsigned byte = 0; byte < (unsigned)TIME_BYTES; byte++) {
        item->now |= (canopy_time_t)bytes[byte] << (8u * byte);
    }
    return 1;
}

static int read_frame(FILE *record, canopy_replay_item_t *item)
{
    uint8_t bytes[2 + CANOPY_UNIXBUS_DATAGRAM_MAX];
    const uint8_t *frame = &bytes[2];
    size_t data = 0;

    if (fread(bytes, 1, FRAME_BYTES, record) != (size_t)FRAME_BYTES) {
        return CANOPY_ERROR_IO;
    }
    if ((frame[1] & CANOPY_CAN_REMOTE) == 0 && frame[2] <= CANOPY_CAN_DATA_MAX) {
        data = fread(bytes + FRAME_BYTES, 1, frame[2], record);
    }
    item->is_tick = false;
    item->age = (uint16_t)(bytes[0] | ((unsigned)bytes[1] << 8));
    return canopy_unixbus_decode(&item->frame, frame, CANOPY_UNIXBUS_HEADER + data) ? 1 : CANOPY_ERROR_IO;
}

static int read_item(void *context, canopy_replay_item_t *item)
{
    const canopy_replay_files_t *self = context;

    switch (fgetc(self->record)) {
    case EOF:
        return ferror(self->record) != 0 ? CANOPY_ERROR_IO : 0;
    case 'T':
        return read_tick(self->record, item);
    case 'F':
        return read_frame(self->record, item);
    default:
        return CANOPY_ERROR_IO;
    }
}

/** Does the file begin as a record of this form? */
static bool is_record(FILE *file)
{
    char begin[sizeof CANOPY_REPLAY_BEGIN - 1u];

    return fread(begin, 1, sizeof begin, file) == sizeof begin && memcmp(begin, CANOPY_REPLAY_BEGIN, sizeof begin) == 0;
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

canopy_error_t canopy_replay_open(canopy_replay_files_t *self, const char *record, const char *sent, char *message,
                                  size_t message_size)
{
    const canopy_replay_io_t io = {.context = self, .read = read_item, .write = sent != NULL ? write_frame : NULL};
    canopy_error_t error;

    self->sent = NULL;
    self->record = open_file(record, "rb", message, message_size);
    if (self->record == NULL) {
        return CANOPY_ERROR_NOT_FOUND;
    }
    error = is_record(self->record) ? canopy_replay_init(&self->replay, &io) : CANOPY_ERROR_NOT_FOUND;
    if (error != CANOPY_OK) {
        (void)snprintf(message, message_size,
                       "%s: is no record, or one of another version of Canopy; `canopy replay --keep` makes one",
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
