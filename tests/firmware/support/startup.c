/* SPDX-License-Identifier: MIT */
/**
 * @file
 * Start-up of a Cortex-M core: the vector table, .data and .bss, main(), and out.
 */
#include <stdint.h>

#include "semihosting.h"

/** Exit status of a program that died of an exception: none of Unity's, which are counts of failures. */
#define EXIT_STATUS_FAULT 99

/* Made by the linker script. */
extern uint32_t firmware_data_source[];
extern uint32_t firmware_data_start[];
extern uint32_t firmware_data_end[];
extern uint32_t firmware_bss_start[];
extern uint32_t firmware_bss_end[];
extern uint32_t firmware_stack_top[];

int main(void);
void firmware_reset(void);

static void fault(void)
{
    semihosting_put("\nThe core took an exception that nothing handles.\n");
    semihosting_exit(EXIT_STATUS_FAULT);
}

void firmware_reset(void)
{
    const uint32_t *source = firmware_data_source;

    for (uint32_t *word = firmware_data_start; word < firmware_data_end; word++) {
        *word = *source++;
    }
    for (uint32_t *word = firmware_bss_start; word < firmware_bss_end; word++) {
        *word = 0;
    }
    semihosting_exit(main());
}

/** Initial stack, reset, and the system exceptions; the boards' interrupts stay off. */
typedef struct {
    uint32_t *stack;
    void (*exceptions[15])(void);
} vectors_t;

extern const vectors_t firmware_vectors;

__attribute__((section(".vectors"), used)) const vectors_t firmware_vectors = {
    .stack = firmware_stack_top,
    .exceptions = {firmware_reset, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault,
                   fault, fault},
};
