/* SPDX-License-Identifier: MIT */
/**
 * @file
 * A tree image as bytes that a test changes: where things are in it, and how it is made whole again.
 */
#ifndef CANOPY_TEST_IMAGE_BYTES_H
#define CANOPY_TEST_IMAGE_BYTES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "canopy/image.h"

enum { IMAGE_MAX = 2048 };

/* Places in an image, docs/image.md. */
enum {
    AT_VERSION = 4,
    AT_SIZE = 8,
    AT_CRC = 12,
    AT_ENGINE = 24,
    AT_NODES = 32,
    AT_PARAMETERS = 34,
    AT_WORDS = 36,
    AT_KINDS = 38,
    AT_SCRIPTS = 40,
    AT_ENTRIES = 42,
    AT_USES = 44,
    AT_VALUES = 48,
    AT_TEXTS = 52
};

static uint8_t copy[IMAGE_MAX];
static size_t copy_size;

static inline void put(size_t at, uint64_t value, unsigned bytes)
{
    for (unsigned byte = 0; byte < bytes; byte++) {
        copy[at + byte] = (uint8_t)((value >> (8u * byte)) & 0xFFu);
    }
}

static inline uint32_t get(size_t at, unsigned bytes)
{
    uint32_t value = 0;

    for (unsigned byte = 0; byte < bytes; byte++) {
        value |= (uint32_t)copy[at + byte] << (8u * byte);
    }
    return value;
}

static inline void take(const uint8_t *bytes, size_t size)
{
    memcpy(copy, bytes, size);
    copy_size = size;
}

/** Size and CRC as they have to be: what is wrong now is wrong in a whole image. */
static inline void seal(void)
{
    uint32_t crc = UINT32_MAX;

    put(AT_SIZE, copy_size, 4);
    for (size_t index = 0; index < copy_size; index++) {
        if (index >= (size_t)AT_CRC && index < (size_t)AT_CRC + 4u) {
            continue;
        }
        crc ^= copy[index];
        for (unsigned bit = 0; bit < 8u; bit++) {
            crc = (crc & 1u) != 0u ? (crc >> 1) ^ 0xEDB88320u : crc >> 1;
        }
    }
    put(AT_CRC, ~crc & UINT32_MAX, 4);
}

static inline size_t node_at(uint16_t node)
{
    return CANOPY_IMAGE_HEADER + (size_t)12 * node;
}

static inline size_t parameters_at(void)
{
    return node_at((uint16_t)get(AT_NODES, 2));
}

static inline size_t kind_at(uint16_t kind)
{
    return parameters_at() + (size_t)4 * get(AT_PARAMETERS, 2) + (size_t)8 * kind;
}

static inline size_t script_at(uint16_t script)
{
    return kind_at((uint16_t)get(AT_KINDS, 2)) + (size_t)8 * script;
}

static inline size_t entry_at(uint16_t entry)
{
    return script_at((uint16_t)get(AT_SCRIPTS, 2)) + (size_t)8 * entry;
}

static inline size_t use_at(uint16_t use)
{
    return entry_at((uint16_t)get(AT_ENTRIES, 2)) + (size_t)8 * use;
}

static inline size_t value_at(uint16_t value)
{
    return use_at((uint16_t)get(AT_USES, 4)) + (size_t)12 * value;
}

static inline size_t texts_at(void)
{
    return value_at((uint16_t)get(AT_VALUES, 4));
}

/** Takes bytes out, or puts zeros in. */
static inline void resize(size_t at, int change)
{
    if (change > 0) {
        memmove(copy + at + change, copy + at, copy_size - at);
        memset(copy + at, 0, (size_t)change);
    } else {
        memmove(copy + at, copy + at - change, copy_size - at - (size_t)-change);
    }
    copy_size += (size_t)change; /* wraps around below 0, and so takes away */
}

/** What is the k-th use of the image's kind `kind`: the use's node. */
static inline uint16_t node_of(uint16_t kind, unsigned number)
{
    for (uint16_t node = 0;; node++) {
        uint8_t type = copy[node_at(node)];
        bool has_kind = type <= CANOPY_NODE_STATEFUL_ACTION || type >= CANOPY_NODE_USER_CONTROL;

        if (has_kind && get(node_at(node) + 8u, 2) == kind && number-- == 0u) {
            return node;
        }
    }
}

#endif
