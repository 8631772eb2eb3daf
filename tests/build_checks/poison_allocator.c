/* SPDX-License-Identifier: MIT */
/** @file Calls an allocator: CheckFreestanding.cmake must refuse it. */
#include <stddef.h>

void *malloc(size_t size);
void *poison_allocate(void);

void *poison_allocate(void)
{
    return malloc(16);
}
