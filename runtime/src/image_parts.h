/* SPDX-License-Identifier: MIT */
/** @file A tree image while it is loaded: its parts in the bytes that have come, and what the firmware has of them. */
#ifndef CANOPY_IMAGE_PARTS_H
#define CANOPY_IMAGE_PARTS_H

#include <string.h>

#include "canopy/image.h"

/** Sizes of the records [bytes]. */
enum { NODE_SIZE = 12, PARAMETER_SIZE = 4, HASH_SIZE = 8, VALUE_SIZE = 12 };

/** An image on its way into a slot: its parts, and how far its uses have been read. */
typedef struct {
    const canopy_image_app_t *self;
    const canopy_image_slot_t *slot;
    unsigned which;
    const uint8_t *nodes;
    const uint8_t *parameters;
    const uint8_t *kinds;
    const uint8_t *scripts;
    const uint8_t *entries;
    const uint8_t *uses;
    const uint8_t *values;
    const uint8_t *texts;
    uint16_t node_count;
    uint16_t parameter_count;
    uint16_t word_count;
    uint16_t kind_count;
    uint16_t script_count;
    uint16_t entry_count;
    uint32_t use_count;
    uint32_t value_count;
    uint32_t text_size;
    uint32_t hash; /* first 8 digits of the tree's */
    uint32_t next_use;
    uint32_t next_value;
    uint16_t where;
} canopy_image_parts_t;

/* Byte by byte: images have no alignment, and their order of bytes need not be the machine's. */

static inline uint16_t canopy_image_get16(const uint8_t *bytes)
{
    return (uint16_t)(bytes[0] | ((unsigned)bytes[1] << 8));
}

static inline uint32_t canopy_image_get32(const uint8_t *bytes)
{
    return canopy_image_get16(bytes) | ((uint32_t)canopy_image_get16(bytes + 2) << 16);
}

static inline uint64_t canopy_image_get64(const uint8_t *bytes)
{
    return canopy_image_get32(bytes) | ((uint64_t)canopy_image_get32(bytes + 4) << 32);
}

/**
 * Looks for the hash at `bytes` among rows that begin with their hash, `stride` bytes each.
 * @return the row's number, or CANOPY_IMAGE_NONE
 */
static inline uint16_t canopy_image_find(const uint8_t *bytes, const void *rows, size_t stride, uint16_t count)
{
    const uint64_t hash = canopy_image_get64(bytes);
    const uint8_t *row = rows;

    for (uint16_t index = 0; index < count; index++) {
        uint64_t known;

        memcpy(&known, row + (stride * index), sizeof known);
        if (known == hash) {
            return index;
        }
    }
    return CANOPY_IMAGE_NONE;
}

/** The firmware's kind that the image's kind number `index` is. */
static inline uint16_t canopy_image_kind_of(const canopy_image_parts_t *image, uint16_t index)
{
    return canopy_image_find(image->kinds + ((size_t)HASH_SIZE * index), image->self->kinds,
                             sizeof image->self->kinds[0], image->self->kind_count);
}

/** The same of a script. */
static inline uint16_t canopy_image_script_of(const canopy_image_parts_t *image, uint16_t index)
{
    return canopy_image_find(image->scripts + ((size_t)HASH_SIZE * index), image->self->scripts,
                             sizeof image->self->scripts[0], image->self->app->tree->script_count);
}

/** The same of an entry. */
static inline uint16_t canopy_image_entry_of(const canopy_image_parts_t *image, uint16_t index)
{
    return canopy_image_find(image->entries + ((size_t)HASH_SIZE * index), image->self->entries,
                             sizeof image->self->entries[0], image->self->entry_count);
}

/**
 * Gives the next use, the kind's use number `parameter`, its ports, and moves on behind its values.
 * @return does all that the image connects fit?
 */
bool canopy_image_decode_ports(canopy_image_parts_t *image, const canopy_image_kind_t *kind, uint16_t parameter);

#endif
