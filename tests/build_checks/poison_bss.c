/* SPDX-License-Identifier: MIT */
/** @file Has a variable that starts at 0: CheckFreestanding.cmake must refuse it. */
int *poison_address(void);

static int poison_count;

int *poison_address(void)
{
    return &poison_count;
}
