/* SPDX-License-Identifier: MIT */
/** @file Prints: CheckFreestanding.cmake must refuse it. */
int puts(const char *text);
int poison_print(void);

int poison_print(void)
{
    return puts("poison");
}
