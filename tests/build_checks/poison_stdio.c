/* SPDX-License-Identifier: MIT */
/** @file Prints: CheckFreestanding.cmake must refuse it. */
#include <stdio.h>

int poison_print(void);

int poison_print(void)
{
    return puts("poison");
}
