/* SPDX-License-Identifier: MIT */
/** @file The fuzzer's bytes, taken one after the other; zeros when they have run out. And a check that ends the run. */
#ifndef CANOPY_TESTS_FUZZ_INPUT_H
#define CANOPY_TESTS_FUZZ_INPUT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

typedef struct {
    const uint8_t *next;
    const uint8_t *end;
} input_t;

static inline uint8_t take8(input_t *input)
{
    return input->next != input->end ? *input->next++ : 0u;
}

static inline uint16_t take16(input_t *input)
{
    uint16_t low = take8(input);

    return (uint16_t)(low | ((unsigned)take8(input) << 8));
}

static inline uint32_t take32(input_t *input)
{
    uint32_t low = take16(input);

    return low | ((uint32_t)take16(input) << 16);
}

/** What must hold; else the fuzzer keeps the input. */
#define EXPECT(condition)                                                         \
    do {                                                                          \
        if (!(condition)) {                                                       \
            (void)fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition); \
            abort();                                                              \
        }                                                                         \
    } while (false)

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#endif
