/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The program's stop flag, set by SIGINT and SIGTERM; the contract is in clock/posix.h.
 */
#include <signal.h>
#include <stdbool.h>
#include <stddef.h>

#include "canopy/clock/posix.h"

/* A signal handler may touch lock-free atomics only (C11 7.14.1.1). */
_Static_assert(ATOMIC_BOOL_LOCK_FREE == 2, "the stop flag must be lock-free");

static atomic_bool stop_flag;

static void on_signal(int number)
{
    (void)number;
    atomic_store_explicit(&stop_flag, true, memory_order_relaxed);
}

canopy_error_t canopy_posix_stop_on_signals(const atomic_bool **stop)
{
    static const int signals[] = {SIGINT, SIGTERM};
    if (stop == NULL) {
        return CANOPY_ERROR_ARGUMENT;
    }
    struct sigaction action = {.sa_handler = on_signal, .sa_flags = (int)SA_RESETHAND};
    (void)sigemptyset(&action.sa_mask);
    for (size_t i = 0; i < sizeof signals / sizeof signals[0]; i++) {
        if (sigaction(signals[i], &action, NULL) != 0) {
            return CANOPY_ERROR_IO;
        }
    }
    *stop = &stop_flag;
    return CANOPY_OK;
}
