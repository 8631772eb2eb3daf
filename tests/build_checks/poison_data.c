/* SPDX-License-Identifier: MIT */
/** @file Has a variable with a start value: CheckFreestanding.cmake must refuse it. */
int *poison_address(void);

static int poison_counter = 7;

int *poison_address(void)
{
    return &poison_counter;
}
