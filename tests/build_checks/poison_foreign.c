/* SPDX-License-Identifier: MIT */
/** @file Needs a function of somewhere else: CheckFreestanding.cmake must refuse it. */
void poison_elsewhere(void);
void poison_call(void);

void poison_call(void)
{
    poison_elsewhere();
}
