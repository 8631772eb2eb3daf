/* SPDX-License-Identifier: MIT */
/** @file Calls an allocator: CheckFreestanding.cmake must refuse it. */
#include <stdlib.h>

void *poison_allocate(void);

void *poison_allocate(void)
{
    return malloc(16);
}
