/* SPDX-License-Identifier: MIT */
/** @file What must hold; else the program ends, with the place. */
#ifndef CANOPY_TESTS_TRACE_CHECK_H
#define CANOPY_TESTS_TRACE_CHECK_H

#include <stdio.h>
#include <stdlib.h>

#define CHECK(condition)                                                          \
    do {                                                                          \
        if (!(condition)) {                                                       \
            (void)fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition); \
            exit(1);                                                              \
        }                                                                         \
    } while (0)

#endif
