/* SPDX-License-Identifier: MIT */
/**
 * @file
 * canopy_bench sizes                     what a node costs
 * canopy_bench run WORKLOAD N TICKS      ticks a tree; valgrind counts the instructions
 * canopy_bench time WORKLOAD N           the shortest of many ticks
 *
 * Prints one line of JSON. The exit status is 2 when the arguments are wrong.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "workloads.h"

/** Ticks 2 ms apart, so that a Timeout of 1 ms has run out in the tick after its first. */
static canopy_status_t tick(uint32_t count)
{
    canopy_status_t status = CANOPY_IDLE;

    for (uint32_t number = 0; number < count; number++) {
        status = canopy_tree_tick(&bench_instance, (canopy_time_t)number * 2000u);
    }
    return status;
}

static uint64_t nanoseconds(void)
{
    struct timespec now;

    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000000u + (uint64_t)now.tv_nsec;
}

static uint64_t shortest_tick(void)
{
    uint64_t shortest = UINT64_MAX;

    for (unsigned trial = 0; trial < 2000u; trial++) {
        uint64_t start = nanoseconds();
        uint64_t duration;

        (void)tick(1);
        duration = nanoseconds() - start;
        if (duration < shortest) {
            shortest = duration;
        }
    }
    return shortest;
}

static int usage(void)
{
    (void)fprintf(stderr, "usage: canopy_bench sizes | run WORKLOAD N TICKS | time WORKLOAD N\n");
    return 2;
}

static bool build(const char *name, const char *n)
{
    for (unsigned workload = 0; workload < BENCH_WORKLOADS; workload++) {
        if (strcmp(name, bench_names[workload]) == 0) {
            return bench_build((bench_workload_t)workload, (uint32_t)strtoul(n, NULL, 10)) != 0u;
        }
    }
    return false;
}

int main(int count, char **arguments)
{
    if (count == 2 && strcmp(arguments[1], "sizes") == 0) {
        (void)printf("{\"flash_per_node\": %zu, \"ram_per_node\": %zu, \"ram_per_word\": %zu, \"instance\": %zu}\n",
                     sizeof(canopy_node_t), sizeof *bench_instance.status, sizeof *bench_instance.words,
                     sizeof(canopy_tree_instance_t));
        return 0;
    }
    if (count == 5 && strcmp(arguments[1], "run") == 0 && build(arguments[2], arguments[3])) {
        canopy_status_t status = tick((uint32_t)strtoul(arguments[4], NULL, 10));

        (void)printf("{\"nodes\": %u, \"leaf_calls\": %u, \"status\": %d}\n", (unsigned)bench_instance.tree->node_count,
                     (unsigned)bench_leaf_calls, (int)status);
        return 0;
    }
    if (count == 4 && strcmp(arguments[1], "time") == 0 && build(arguments[2], arguments[3])) {
        uint64_t shortest = shortest_tick();
        uint32_t calls = bench_leaf_calls;

        (void)tick(1);
        (void)printf("{\"nanoseconds\": %llu, \"leaf_calls\": %u}\n", (unsigned long long)shortest,
                     (unsigned)(bench_leaf_calls - calls));
        return 0;
    }
    return usage();
}
