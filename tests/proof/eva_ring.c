/* SPDX-License-Identifier: MIT */
/** @file For Frama-C: a ring of any small shape at any point of its counters, and the E2E check of any frame. */
#include <stddef.h>

#include "__fc_builtin.h"
#include "canopy/clock.h"
#include "canopy/e2e.h"
#include "canopy/ring.h"

enum { STORAGE = 64, ELEMENT_MAX = 16 };

static uint8_t storage[STORAGE];
static uint8_t element[ELEMENT_MAX];
static uint8_t frame[64];

static void any_ring(void)
{
    canopy_ring_t ring;
    uint32_t start = (uint32_t)Frama_C_unsigned_int_interval(0, UINT32_MAX);

    for (uint32_t element_size = 1; element_size <= (uint32_t)ELEMENT_MAX; element_size++) {
        for (uint32_t capacity = 1; capacity * element_size <= (uint32_t)STORAGE; capacity *= 2u) {
            if (canopy_ring_init(&ring, storage, STORAGE, element_size, capacity) != CANOPY_OK) {
                continue;
            }
            ring.head = start;
            ring.tail = start - (uint32_t)Frama_C_unsigned_int_interval(0, capacity);
            (void)canopy_ring_push(&ring, element);
            (void)canopy_ring_pop(&ring, element);
            (void)canopy_ring_count(&ring);
            (void)canopy_ring_dropped(&ring);
            (void)canopy_ring_high_water(&ring);
        }
    }
    (void)canopy_ring_init(&ring, storage, (size_t)Frama_C_unsigned_int_interval(0, UINT32_MAX),
                           (size_t)Frama_C_unsigned_int_interval(0, UINT32_MAX),
                           (uint32_t)Frama_C_unsigned_int_interval(0, UINT32_MAX));
}

static void any_frame(void)
{
    canopy_e2e_receiver_t receiver = {.counter = (uint8_t)Frama_C_unsigned_int_interval(0, CANOPY_E2E_COUNTERS - 1u),
                                      .started = Frama_C_interval(0, 1) != 0};

    for (unsigned byte = 0; byte < sizeof frame; byte++) {
        frame[byte] = (uint8_t)Frama_C_unsigned_int_interval(0, UINT8_MAX);
    }
    for (uint8_t length = 2; length <= sizeof frame; length++) {
        (void)canopy_e2e_check(&receiver, (uint16_t)Frama_C_unsigned_int_interval(0, UINT16_MAX), frame, length);
        canopy_e2e_protect((uint16_t)Frama_C_unsigned_int_interval(0, UINT16_MAX),
                           (uint8_t)Frama_C_unsigned_int_interval(0, CANOPY_E2E_COUNTERS - 1u), frame, length);
    }
}

int main(void)
{
    any_ring();
    any_frame();
    (void)canopy_time_reached((canopy_time_t)Frama_C_unsigned_long_long_interval(0, UINT64_MAX),
                              (canopy_time_t)Frama_C_unsigned_long_long_interval(0, UINT64_MAX));
    return 0;
}
