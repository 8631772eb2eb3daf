/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Arm semihosting: a program in an emulator (or under a debugger) prints and ends through its host.
 * Source: Arm, "Semihosting for AArch32 and AArch64", the operations SYS_WRITE0 and SYS_EXIT_EXTENDED.
 */
#ifndef CANOPY_TESTS_SEMIHOSTING_H
#define CANOPY_TESTS_SEMIHOSTING_H

/** Appends to the line being printed; the line goes out at its end, or when it is longer than the buffer. */
void semihosting_put_char(char character);

/** As semihosting_put_char() for each character of a text. */
void semihosting_put(const char *text);

/** Prints a number in decimal. */
void semihosting_put_number(unsigned long number);

/** Hands out what was not printed yet. */
void semihosting_flush(void);

/** Ends the program; the emulator's exit status is `status` (0..255). */
_Noreturn void semihosting_exit(int status);

#endif
