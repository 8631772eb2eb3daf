/* SPDX-License-Identifier: MIT */
/**
 * @file
 * A queue of fixed-size elements from one producer to one consumer: the only way in which a receive interrupt (or a
 * driver's receive thread) hands frames to the loop.
 *
 * Threads: exactly one context calls canopy_ring_push() (the producer), exactly one calls canopy_ring_pop() (the
 * consumer); the two may be the same, two threads, or an interrupt and the code that it interrupts, either way round.
 * The three functions that read counters may be called from anywhere at any time. canopy_ring_init() comes before all
 * of them and races with none.
 *
 * Memory order: the producer writes the element, then publishes it by a release store of `head`; the consumer's acquire
 * load of `head` therefore sees the whole element. The consumer reads the element, then gives its place back by a
 * release store of `tail`; the producer's acquire load of `tail` therefore never overwrites an element that is still
 * being read. What else the producer wrote before a push is visible to the consumer after the pop of that element.
 * Only loads and stores are used, no read-modify-write: cores without such instructions (Cortex-M0+) need no library.
 *
 * Blocking and memory: nothing blocks, spins or allocates; the storage is the caller's. A full ring refuses the new
 * element and counts it; it never overwrites an old one.
 */
#ifndef CANOPY_RING_H
#define CANOPY_RING_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "canopy/status.h"

/**
 * A ring. Owned by the caller; treat the members as private. `head` and `tail` run freely through all 32-bit values,
 * so full (head - tail == capacity) and empty (head == tail) differ without a place being wasted.
 */
typedef struct {
    uint8_t *storage;            /**< capacity * element_size bytes. */
    size_t element_size;         /**< [bytes] */
    uint32_t capacity;           /**< [elements] A power of two. */
    _Atomic uint32_t head;       /**< Elements ever pushed. Written by the producer only. */
    _Atomic uint32_t tail;       /**< Elements ever popped. Written by the consumer only. */
    _Atomic uint32_t dropped;    /**< Written by the producer only. */
    _Atomic uint32_t high_water; /**< Written by the producer only. */
} canopy_ring_t;

/**
 * Makes an empty ring over the caller's storage, which must live as long as the ring.
 *
 * @param ring          the ring
 * @param storage       at least capacity * element_size bytes, of any alignment
 * @param storage_size  its size [bytes]
 * @param element_size  size of one element [bytes], 1 or more
 * @param capacity      most elements that can wait: a power of two, 1..2^31
 * @return CANOPY_OK, or CANOPY_ERROR_ARGUMENT: a NULL, a value out of range, or too little storage.
 *
 * Complexity: O(1).
 */
canopy_error_t canopy_ring_init(canopy_ring_t *ring, void *storage, size_t storage_size, size_t element_size,
                                uint32_t capacity);

/**
 * Copies one element into the ring. Producer only; may be called in an interrupt.
 *
 * @return true, or false when the ring was full: the element is lost and counted.
 *
 * Complexity: O(element_size).
 */
bool canopy_ring_push(canopy_ring_t *ring, const void *element);

/**
 * Copies the oldest element out and removes it. Consumer only; may be called in an interrupt.
 *
 * @return true, or false when the ring was empty: *element is untouched.
 *
 * Complexity: O(element_size).
 */
bool canopy_ring_pop(canopy_ring_t *ring, void *element);

/**
 * Number of elements that wait. Anyone. For the consumer it is a lower bound (more may arrive meanwhile), for the
 * producer an upper bound, for others a snapshot that is 0..capacity but may be old.
 *
 * Complexity: O(1).
 */
uint32_t canopy_ring_count(const canopy_ring_t *ring);

/** Number of elements refused because the ring was full, modulo 2^32. Anyone. Never reset. O(1). */
uint32_t canopy_ring_dropped(const canopy_ring_t *ring);

/**
 * Most elements that ever waited at once, as the producer saw it at a push: an element that the consumer was just
 * taking still counts. Anyone. Never reset. O(1).
 */
uint32_t canopy_ring_high_water(const canopy_ring_t *ring);

#endif
