/* SPDX-License-Identifier: MIT */
/** @file For Frama-C: memcpy() between bytes, which WP understands; its own one speaks of char. */
#ifndef PROOF_STRING_H
#define PROOF_STRING_H

#include <stddef.h>
#include <stdint.h>

/*@ requires size <= SIZE_MAX;
    requires \valid((uint8_t *)to + (0 .. size - 1));
    requires \valid_read((uint8_t *)from + (0 .. size - 1));
    requires \separated((uint8_t *)to + (0 .. size - 1), (uint8_t *)from + (0 .. size - 1));
    assigns ((uint8_t *)to)[0 .. size - 1] \from ((uint8_t *)from)[0 .. size - 1];
    assigns \result \from to;
    ensures \forall integer byte; 0 <= byte < size ==> ((uint8_t *)to)[byte] == ((uint8_t *)from)[byte];
    ensures \result == to;
*/
void *memcpy(void *to, const void *from, size_t size);

#endif
