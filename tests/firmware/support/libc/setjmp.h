/* SPDX-License-Identifier: MIT */
/**
 * @file
 * <setjmp.h> for Cortex-M without floating-point registers: how Unity leaves a test that has failed.
 */
#ifndef CANOPY_TESTS_SETJMP_H
#define CANOPY_TESTS_SETJMP_H

/** r4..r11, sp, lr. */
typedef unsigned int jmp_buf[10];

__attribute__((returns_twice)) int setjmp(jmp_buf buffer);
_Noreturn void longjmp(jmp_buf buffer, int value);

#endif
