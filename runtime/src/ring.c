/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Single-producer single-consumer ring; the contract is in ring.h.
 */
#include "canopy/ring.h"

#include <string.h>

#define CAPACITY_MAX (UINT32_C(1) << 31)

canopy_error_t canopy_ring_init(canopy_ring_t *ring, void *storage, size_t storage_size, size_t element_size,
                                uint32_t capacity)
{
    if (ring == NULL || storage == NULL || element_size == 0u) {
        return CANOPY_ERROR_ARGUMENT;
    }
    if (capacity == 0u || capacity > CAPACITY_MAX || (capacity & (capacity - 1u)) != 0u) {
        return CANOPY_ERROR_ARGUMENT;
    }
    /* A division, because capacity * element_size may not fit into a size_t. */
    if (storage_size / element_size < capacity) {
        return CANOPY_ERROR_ARGUMENT;
    }
    ring->storage = storage;
    ring->element_size = element_size;
    ring->capacity = capacity;
    atomic_init(&ring->head, 0u);
    atomic_init(&ring->tail, 0u);
    atomic_init(&ring->dropped, 0u);
    atomic_init(&ring->high_water, 0u);
    return CANOPY_OK;
}

/*@ requires canopy_ring_is_sound((canopy_ring_t *)ring);
    assigns \nothing;
    ensures \result == ring->storage + canopy_ring_place((canopy_ring_t *)ring, index);
    ensures 0 <= canopy_ring_place((canopy_ring_t *)ring, index) <=
            canopy_ring_bytes((canopy_ring_t *)ring) - ring->element_size;
*/
static uint8_t *place(const canopy_ring_t *ring, uint32_t index)
{
    return ring->storage + (size_t)(index & (ring->capacity - 1u)) * ring->element_size;
}

/* For a counter with a single writer: a load and a store cannot lose an increment. */
/*@ requires \valid(counter);
    assigns *counter;
    ensures *counter == (uint32_t)(\old(*counter) + 1);
*/
static void count_up(_Atomic uint32_t *counter)
{
    atomic_store_explicit(counter, atomic_load_explicit(counter, memory_order_relaxed) + 1u, memory_order_relaxed);
}

bool canopy_ring_push(canopy_ring_t *ring, const void *element)
{
    const uint32_t head = atomic_load_explicit(&ring->head, memory_order_relaxed);
    const uint32_t waiting = head - atomic_load_explicit(&ring->tail, memory_order_acquire);
    if (waiting >= ring->capacity) {
        count_up(&ring->dropped);
        return false;
    }
    memcpy(place(ring, head), element, ring->element_size);
    atomic_store_explicit(&ring->head, head + 1u, memory_order_release);
    if (waiting + 1u > atomic_load_explicit(&ring->high_water, memory_order_relaxed)) {
        atomic_store_explicit(&ring->high_water, waiting + 1u, memory_order_relaxed);
    }
    return true;
}

bool canopy_ring_pop(canopy_ring_t *ring, void *element)
{
    const uint32_t tail = atomic_load_explicit(&ring->tail, memory_order_relaxed);
    if (atomic_load_explicit(&ring->head, memory_order_acquire) == tail) {
        return false;
    }
    memcpy(element, place(ring, tail), ring->element_size);
    atomic_store_explicit(&ring->tail, tail + 1u, memory_order_release);
    return true;
}

uint32_t canopy_ring_count(const canopy_ring_t *ring)
{
    /* tail first: head can only have moved on since, so the difference is never negative, but may exceed capacity. */
    const uint32_t tail = atomic_load_explicit(&ring->tail, memory_order_acquire);
    const uint32_t waiting = atomic_load_explicit(&ring->head, memory_order_acquire) - tail;
    return waiting < ring->capacity ? waiting : ring->capacity;
}

uint32_t canopy_ring_dropped(const canopy_ring_t *ring)
{
    return atomic_load_explicit(&ring->dropped, memory_order_relaxed);
}

uint32_t canopy_ring_high_water(const canopy_ring_t *ring)
{
    return atomic_load_explicit(&ring->high_water, memory_order_relaxed);
}
