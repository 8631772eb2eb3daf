/* SPDX-License-Identifier: MIT */
/** @file Random numbers that follow from a seed: Marsaglia's xorshift64*. */
#ifndef CANOPY_TESTS_TRACE_RANDOM_H
#define CANOPY_TESTS_TRACE_RANDOM_H

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    uint64_t state; /* not 0 */
} random_t;

static inline random_t random_seed(uint64_t seed)
{
    return (random_t){(seed + 1u) * UINT64_C(0x9E3779B97F4A7C15) | 1u};
}

static inline uint32_t random_bits(random_t *self)
{
    self->state ^= self->state >> 12;
    self->state ^= self->state << 25;
    self->state ^= self->state >> 27;
    return (uint32_t)(self->state * UINT64_C(0x2545F4914F6CDD1D) >> 32);
}

/** 0..count - 1. */
static inline uint32_t random_below(random_t *self, uint32_t count)
{
    return (uint32_t)((uint64_t)random_bits(self) * count >> 32);
}

static inline bool random_chance(random_t *self, uint32_t of_1000)
{
    return random_below(self, 1000u) < of_1000;
}

#endif
