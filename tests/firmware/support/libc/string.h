/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The part of the standard's <string.h> that is used here: what freestanding code may ask for, and the compiler on its
 * own; and for tests only, functions on text. (That the runtime does not call those, CheckFreestanding.cmake sees.)
 */
#ifndef CANOPY_TESTS_STRING_H
#define CANOPY_TESTS_STRING_H

#include <stddef.h>

void *memcpy(void *restrict to, const void *restrict from, size_t size);
void *memmove(void *to, const void *from, size_t size);
void *memset(void *to, int byte, size_t size);
int memcmp(const void *a, const void *b, size_t size);

size_t strlen(const char *text);
char *strcpy(char *restrict to, const char *restrict from);
int strcmp(const char *a, const char *b);

#endif
