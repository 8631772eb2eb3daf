/* SPDX-License-Identifier: MIT */
/** @file bench_cycle CYCLES: runs so many cycles of BENCH_APP; exit status 1 when one of them went wrong. */
#include <stdio.h>
#include <stdlib.h>

#include "cycle.h"

int main(int count, char **arguments)
{
    unsigned long cycles = count == 2 ? strtoul(arguments[1], NULL, 10) : 0u;

    if (cycles == 0u || bench_cycle_start() != 0) {
        (void)fprintf(stderr, "usage: bench_cycle CYCLES\n");
        return 2;
    }
    for (unsigned long cycle = 0; cycle < cycles; cycle++) {
        bench_cycle_prepare();
        (void)canopy_loop_step(&bench_loop);
        while (bench_cycle_let_out()) {
            bench_cycle_interrupt();
        }
    }
    (void)printf("{\"ticks\": %lu, \"failures\": %lu}\n", (unsigned long)bench_loop.ticks,
                 (unsigned long)bench_cycle_failures());
    return bench_cycle_failures() == 0u ? 0 : 1;
}
