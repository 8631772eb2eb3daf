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

/*
 * The comments that begin with an at sign are contracts in ACSL: Frama-C's WP proves them (docs/verification.md), for
 * one context at a time. A ring is sound between any two calls once canopy_ring_init() has said CANOPY_OK.
 */
/*@ logic integer canopy_ring_waiting(canopy_ring_t *ring) =
        ring->head - ring->tail + (ring->head < ring->tail ? 0x100000000 : 0);
    logic integer canopy_ring_bytes(canopy_ring_t *ring) = ring->capacity * ring->element_size;
    logic integer canopy_ring_place(canopy_ring_t *ring, integer index) =
        (index & (ring->capacity - 1)) * ring->element_size;

    predicate canopy_ring_is_sound(canopy_ring_t *ring) =
        \valid(ring) && 1 <= ring->capacity <= 0x80000000 && 1 <= ring->element_size &&
        canopy_ring_bytes(ring) <= SIZE_MAX && \valid(ring->storage + (0 .. canopy_ring_bytes(ring) - 1)) &&
        \separated(ring, ring->storage + (0 .. canopy_ring_bytes(ring) - 1)) &&
        canopy_ring_waiting(ring) <= ring->capacity && ring->high_water <= ring->capacity;
*/

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
/*@ requires ring == \null || \valid(ring);
    requires storage == \null || \valid((uint8_t *)storage + (0 .. storage_size - 1));
    requires \separated(ring, (uint8_t *)storage + (0 .. storage_size - 1));
    assigns *ring;
    ensures \result == CANOPY_OK || \result == CANOPY_ERROR_ARGUMENT;
    ensures \result == CANOPY_OK ==> canopy_ring_is_sound(ring) && canopy_ring_waiting(ring) == 0 &&
            ring->storage == storage && ring->element_size == element_size && ring->capacity == capacity;
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
/*@ requires canopy_ring_is_sound(ring);
    requires \valid_read((uint8_t *)element + (0 .. ring->element_size - 1));
    requires \separated((uint8_t *)element + (0 .. ring->element_size - 1), ring,
                        ring->storage + (0 .. canopy_ring_bytes(ring) - 1));
    assigns ring->head, ring->dropped, ring->high_water, ring->storage[0 .. canopy_ring_bytes(ring) - 1];
    ensures canopy_ring_is_sound(ring);
    ensures \old(ring->high_water) <= ring->high_water;
    behavior full:
      assumes canopy_ring_waiting(ring) == ring->capacity;
      assigns ring->dropped;
      ensures \result == false && ring->dropped == (uint32_t)(\old(ring->dropped) + 1);
    behavior room:
      assumes canopy_ring_waiting(ring) < ring->capacity;
      assigns ring->head, ring->high_water,
              ring->storage[canopy_ring_place(ring, ring->head) ..
                            canopy_ring_place(ring, ring->head) + ring->element_size - 1];
      ensures \result == true && ring->head == (uint32_t)(\old(ring->head) + 1);
      ensures canopy_ring_waiting(ring) == \old(canopy_ring_waiting(ring)) + 1 <= ring->high_water;
      ensures \forall integer byte; 0 <= byte < ring->element_size ==>
              ring->storage[canopy_ring_place(ring, \old(ring->head)) + byte] == ((uint8_t *)element)[byte];
    complete behaviors;
    disjoint behaviors;
*/
bool canopy_ring_push(canopy_ring_t *ring, const void *element);

/**
 * Copies the oldest element out and removes it. Consumer only; may be called in an interrupt.
 *
 * @return true, or false when the ring was empty: *element is untouched.
 *
 * Complexity: O(element_size).
 */
/*@ requires canopy_ring_is_sound(ring);
    requires \valid((uint8_t *)element + (0 .. ring->element_size - 1));
    requires \separated((uint8_t *)element + (0 .. ring->element_size - 1), ring,
                        ring->storage + (0 .. canopy_ring_bytes(ring) - 1));
    assigns ring->tail, ((uint8_t *)element)[0 .. ring->element_size - 1];
    ensures canopy_ring_is_sound(ring);
    behavior empty:
      assumes canopy_ring_waiting(ring) == 0;
      assigns \nothing;
      ensures \result == false;
    behavior waiting:
      assumes canopy_ring_waiting(ring) > 0;
      assigns ring->tail, ((uint8_t *)element)[0 .. ring->element_size - 1];
      ensures \result == true && ring->tail == (uint32_t)(\old(ring->tail) + 1);
      ensures canopy_ring_waiting(ring) == \old(canopy_ring_waiting(ring)) - 1;
      ensures \forall integer byte; 0 <= byte < ring->element_size ==>
              ((uint8_t *)element)[byte] == ring->storage[canopy_ring_place(ring, \old(ring->tail)) + byte];
    complete behaviors;
    disjoint behaviors;
*/
bool canopy_ring_pop(canopy_ring_t *ring, void *element);

/**
 * Number of elements that wait. Anyone. For the consumer it is a lower bound (more may arrive meanwhile), for the
 * producer an upper bound, for others a snapshot that is 0..capacity but may be old.
 *
 * Complexity: O(1).
 */
/*@ requires canopy_ring_is_sound(ring);
    assigns \nothing;
    ensures \result == canopy_ring_waiting(ring);
*/
uint32_t canopy_ring_count(const canopy_ring_t *ring);

/** Number of elements refused because the ring was full, modulo 2^32. Anyone. Never reset. O(1). */
/*@ requires \valid_read(ring);
    assigns \nothing;
    ensures \result == ring->dropped;
*/
uint32_t canopy_ring_dropped(const canopy_ring_t *ring);

/**
 * Most elements that ever waited at once, as the producer saw it at a push: an element that the consumer was just
 * taking still counts. Anyone. Never reset. O(1).
 */
/*@ requires \valid_read(ring);
    assigns \nothing;
    ensures \result == ring->high_water;
*/
uint32_t canopy_ring_high_water(const canopy_ring_t *ring);

#endif
