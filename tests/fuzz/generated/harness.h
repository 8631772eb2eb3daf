/* SPDX-License-Identifier: MIT */
/** @file What the leaves of fuzzed applications use, and the run of one application. */
#ifndef CANOPY_FUZZ_HARNESS_H
#define CANOPY_FUZZ_HARNESS_H

#include <stddef.h>
#include <stdint.h>

#include "canopy/loop.h"

/** A random number (xorshift64). */
uint64_t fuzz_next(void);

/** Reads every byte, so that the sanitizers see it. */
void fuzz_read(const void *bytes, size_t size);

/** The same of a text; NULL is none. */
void fuzz_read_text(const char *text);

/** Runs an application for some ticks with random frames. Aborts when a table says what cannot be. */
void fuzz_run(const canopy_app_t *app, uint64_t seed);

/** What code in the texts of a file calls: says so, and aborts. */
void canopy_fuzz_injected(void);

#endif
