/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Semihosting of the M profile: operation in r0, parameter in r1, `bkpt 0xab`.
 */
#include "semihosting.h"

#include <stddef.h>
#include <stdint.h>

enum { SYS_WRITE0 = 0x04, SYS_EXIT_EXTENDED = 0x20, ADP_STOPPED_APPLICATION_EXIT = 0x20026 };

/* A call stops the emulator: one a line, not one a character. The last byte ends the text. */
static char line[128];
static size_t used;

static void call(uint32_t operation, const void *parameter)
{
    register uint32_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = parameter;

    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
}

void semihosting_flush(void)
{
    if (used > 0u) {
        line[used] = '\0';
        used = 0;
        call(SYS_WRITE0, line);
    }
}

void semihosting_put_char(char character)
{
    line[used++] = character;
    if (character == '\n' || used == sizeof(line) - 1u) {
        semihosting_flush();
    }
}

void semihosting_put(const char *text)
{
    for (; *text != '\0'; text++) {
        semihosting_put_char(*text);
    }
}

void semihosting_put_number(unsigned long number)
{
    char digits[3 * sizeof(number)];
    size_t count = 0;

    do {
        digits[count++] = (char)('0' + (char)(number % 10u));
        number /= 10u;
    } while (number != 0u);
    while (count > 0u) {
        semihosting_put_char(digits[--count]);
    }
}

void semihosting_exit(int status)
{
    uint32_t block[2] = {ADP_STOPPED_APPLICATION_EXIT, (uint32_t)status};

    semihosting_flush();
    call(SYS_EXIT_EXTENDED, block);
    for (;;) {}
}
