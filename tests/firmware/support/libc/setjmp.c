/* SPDX-License-Identifier: MIT */
/**
 * @file
 * setjmp() and longjmp() in the instructions that all Cortex-M cores have. Sixteen-bit Thumb loads and stores only the
 * low registers, so r8 and up, sp and lr go through r1..r3.
 */
#include <setjmp.h>

__attribute__((naked)) int setjmp(__attribute__((unused)) jmp_buf buffer)
{
    __asm__(".syntax unified\n"
            "stmia r0!, {r4-r7}\n"
            "mov r1, r8\n"
            "mov r2, r9\n"
            "mov r3, r10\n"
            "stmia r0!, {r1-r3}\n"
            "mov r1, r11\n"
            "mov r2, sp\n"
            "mov r3, lr\n"
            "stmia r0!, {r1-r3}\n"
            "movs r0, #0\n"
            "bx lr\n");
}

__attribute__((naked)) void longjmp(__attribute__((unused)) jmp_buf buffer, __attribute__((unused)) int value)
{
    __asm__(".syntax unified\n"
            "adds r0, #16\n"
            "ldmia r0!, {r2-r4}\n"
            "mov r8, r2\n"
            "mov r9, r3\n"
            "mov r10, r4\n"
            "ldmia r0!, {r2-r4}\n"
            "mov r11, r2\n"
            "mov sp, r3\n"
            "mov lr, r4\n"
            "subs r0, #40\n"
            "ldmia r0!, {r4-r7}\n"
            "movs r0, r1\n" /* setjmp() returns value, but never 0 */
            "bne 1f\n"
            "movs r0, #1\n"
            "1: bx lr\n");
}
