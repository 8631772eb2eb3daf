/* SPDX-License-Identifier: MIT */
/** @file Any pushes and pops at a ring of any shape, against a plain queue. */
#include <string.h>

#include "canopy/ring.h"
#include "input.h"

enum { STORAGE = 256, ELEMENT_MAX = 16, GUARD = 0xA5 };

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    input_t input = {.next = data, .end = data + size};
    uint8_t storage[STORAGE + 1];
    canopy_ring_t ring;
    uint8_t queue[STORAGE]; /* first bytes of the elements that wait */
    uint32_t waiting = 0;
    uint32_t dropped = 0;
    uint32_t most = 0;
    size_t storage_size = take8(&input);
    size_t element_size = take8(&input) % (ELEMENT_MAX + 1u);
    uint32_t capacity = take8(&input) < 240u ? UINT32_C(1) << (take8(&input) % 9u) : take32(&input);

    storage[storage_size] = GUARD;
    if (canopy_ring_init(&ring, storage, storage_size, element_size, capacity) != CANOPY_OK) {
        return 0;
    }
    EXPECT(element_size != 0u && (uint64_t)element_size * capacity <= storage_size);
    /* Anywhere in the counters' range, the wrap-around included. */
    atomic_store(&ring.head, take32(&input));
    atomic_store(&ring.tail, atomic_load(&ring.head));
    while (input.next != input.end) {
        uint8_t what = take8(&input);
        uint8_t element[ELEMENT_MAX];

        memset(element, what, sizeof element);
        if (what % 2u == 0u) {
            bool taken = canopy_ring_push(&ring, element);

            EXPECT(taken == (waiting < capacity));
            if (taken) {
                queue[waiting++] = what;
            }
            dropped += taken ? 0u : 1u;
            most = waiting > most ? waiting : most;
        } else {
            bool given = canopy_ring_pop(&ring, element);

            EXPECT(given == (waiting > 0u));
            if (given) {
                EXPECT(element[0] == queue[0] && element[element_size - 1u] == queue[0]);
                memmove(queue, queue + 1, --waiting);
            }
        }
        EXPECT(canopy_ring_count(&ring) == waiting && canopy_ring_dropped(&ring) == dropped);
        EXPECT(canopy_ring_high_water(&ring) == most);
    }
    EXPECT(storage[storage_size] == GUARD);
    return 0;
}
